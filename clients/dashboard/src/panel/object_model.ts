/** An object as it was felt: its places as points that turn slowly, coloured by a level. */

import { rgb, type Palette } from "../scene/palette";
import type { ObjectDetail, Vec3 } from "../wire";
import { sharpContext } from "./dom";

/** The view turns by one radian in this time [ms]. */
const TURN_MS = 4000;
/** Part of the drawing that the object takes. */
const FILLED = 0.86;

/** Draws a model, and a way on it in a colour. */
export function drawModel(
  canvas: HTMLCanvasElement,
  model: ObjectDetail,
  way: Vec3[],
  wayColour: string,
  palette: Palette,
): void {
  const context = sharpContext(canvas);
  if (context === null) {
    return;
  }
  const { clientWidth: width, clientHeight: height } = canvas;
  const { min_m: low, max_m: high } = model.summary;
  const middle = low.map((x, i) => (x + high[i]!) / 2) as Vec3;
  const size = Math.max(Math.hypot(...low.map((x, i) => high[i]! - x)), 1e-3);
  const scale = (FILLED * Math.min(width, height)) / size;
  const turn = performance.now() / TURN_MS;
  const put = (at: Vec3): { x: number; y: number; depth: number } => {
    const [dx, dy, dz] = at.map((x, i) => x - middle[i]!) as Vec3;
    const x = dx * Math.cos(turn) - dy * Math.sin(turn);
    const away = dx * Math.sin(turn) + dy * Math.cos(turn);
    const up = 0.9 * dz + 0.42 * away;
    return { x: width / 2 + scale * x, y: height / 2 - scale * up, depth: away / size };
  };
  const levels = model.places.map((place) => place.levels[0]?.mean ?? 0);
  const [least, most] = [Math.min(...levels), Math.max(...levels)];
  const points = model.places.map((place, i) => ({
    ...put(place.position_m),
    level: most > least ? (levels[i]! - least) / (most - least) : 0.5,
  }));
  const radius = Math.min(4.5, Math.max(1.8, 0.35 * scale * model.summary.spacing_m));
  for (const { x, y, depth, level } of points.sort((a, b) => b.depth - a.depth)) {
    const near = Math.min(1, Math.max(0, 0.5 - depth));
    context.globalAlpha = 0.35 + 0.6 * near;
    context.fillStyle = ramp(palette.age.slice(1), level);
    disc(context, x, y, radius * (0.8 + 0.4 * near));
  }
  context.globalAlpha = 0.95;
  context.strokeStyle = context.fillStyle = wayColour;
  context.lineWidth = 1.6;
  context.lineJoin = "round";
  context.beginPath();
  way.forEach((at) => context.lineTo(put(at).x, put(at).y));
  context.stroke();
  const last = way.at(-1);
  if (last !== undefined) {
    disc(context, put(last).x, put(last).y, 4.5);
  }
  context.globalAlpha = 1;
}

function disc(context: CanvasRenderingContext2D, x: number, y: number, radius: number): void {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fill();
}

/** A colour between the stops. */
function ramp(stops: string[], part: number): string {
  const at = Math.min(0.999, Math.max(0, part)) * (stops.length - 1);
  const [low, high] = [rgb(stops[Math.floor(at)]!), rgb(stops[Math.floor(at) + 1]!)];
  const mixed = low.map((x, i) => Math.round(255 * (x + (at % 1) * (high[i]! - x))));
  return `rgb(${mixed.join(" ")})`;
}
