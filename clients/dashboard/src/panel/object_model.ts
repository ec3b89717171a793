/**
 * An object as it was felt: its places as points that turn slowly, coloured by a level, and on them
 * the contacts of an episode.
 */

import { rgb, type Palette } from "../scene/palette";
import type { Contact, ObjectDetail, Vec3 } from "../wire";
import { sharpContext } from "./dom";

/** The view turns by one radian in this time [ms]. */
const TURN_MS = 4000;
/** Part of the drawing that the object takes. */
const FILLED = 0.88;
/** How much of a height, and of a way from the eye, is seen as one upwards. */
const UPRIGHT = 0.9;
const LEANING = 0.42;
/** The normal of a contact is so long, as a part of the object's size. */
const NORMAL = 0.06;
/** The latest contacts stand out. */
const LATEST = 16;
/** Distance of points where no model says one [m]: that of things that a hand can hold. */
const SPACING_M = 0.004;

/** What is drawn: a model, contacts in its frame, and where the next touch would tell most. */
export interface Felt {
  /** None where nothing like it was learned yet: the contacts alone are shown. */
  model: ObjectDetail | null;
  contacts: Contact[];
  nextTouch: Vec3 | null;
  /** Colour of the agent. */
  colour: string;
}

interface Seen {
  x: number;
  y: number;
  /** 0 for what is farthest, 1 for what is nearest. */
  near: number;
}

/** Turns the view, and puts what is at a position where it is seen. */
type Put = (at: Vec3) => Seen;

export function drawModel(canvas: HTMLCanvasElement, felt: Felt, palette: Palette): void {
  const context = sharpContext(canvas);
  if (context === null) {
    return;
  }
  const { clientWidth: width, clientHeight: height } = canvas;
  const { low, high, spacingM } = extent(felt);
  const middle = low.map((x, i) => (x + high[i]!) / 2) as Vec3;
  const [dx, dy, dz] = low.map((x, i) => high[i]! - x) as Vec3;
  const size = Math.max(Math.hypot(dx, dy, dz), 1e-3);
  // It turns, and is to fit in all of its positions.
  const wide = Math.max(Math.hypot(dx, dy), 1e-3);
  const tall = UPRIGHT * dz + LEANING * wide;
  const scale = FILLED * Math.min(width / wide, height / tall);
  const turn = performance.now() / TURN_MS;
  const put: Put = (at) => {
    const [dx, dy, dz] = at.map((x, i) => x - middle[i]!) as Vec3;
    const x = dx * Math.cos(turn) - dy * Math.sin(turn);
    const away = dx * Math.sin(turn) + dy * Math.cos(turn);
    const up = UPRIGHT * dz + LEANING * away;
    const near = Math.min(1, Math.max(0, 0.5 - away / size));
    return { x: width / 2 + scale * x, y: height / 2 - scale * up, near };
  };
  const radius = Math.min(4.5, Math.max(1.8, 0.35 * scale * spacingM));
  drawPlaces(context, felt.model, put, radius, palette);
  drawContacts(context, felt, put, NORMAL * size, palette);
  if (felt.nextTouch !== null) {
    drawCross(context, put(felt.nextTouch), palette);
  }
  context.globalAlpha = 1;
}

function extent({ model, contacts }: Felt): { low: Vec3; high: Vec3; spacingM: number } {
  if (model !== null) {
    const { min_m, max_m, spacing_m } = model.summary;
    return { low: min_m, high: max_m, spacingM: spacing_m };
  }
  const along = (axis: number): number[] => contacts.map(({ position_m }) => position_m[axis]!);
  const axes = [0, 1, 2];
  return {
    low: axes.map((axis) => Math.min(...along(axis))) as Vec3,
    high: axes.map((axis) => Math.max(...along(axis))) as Vec3,
    spacingM: SPACING_M,
  };
}

function drawPlaces(
  context: CanvasRenderingContext2D,
  model: ObjectDetail | null,
  put: Put,
  radius: number,
  palette: Palette,
): void {
  const places = model?.places ?? [];
  const levels = places.map((place) => place.levels[0]?.mean ?? 0);
  const [least, most] = [Math.min(...levels), Math.max(...levels)];
  const points = places.map((place, i) => ({
    ...put(place.position_m),
    level: most > least ? (levels[i]! - least) / (most - least) : 0.5,
  }));
  for (const { x, y, near, level } of points.sort((a, b) => a.near - b.near)) {
    context.globalAlpha = 0.35 + 0.6 * near;
    context.fillStyle = ramp(palette.age.slice(1), level);
    disc(context, x, y, radius * (0.8 + 0.4 * near));
  }
}

/** Contacts in the agent's colour, with the surface's normal where it was felt; the last is ringed. */
function drawContacts(
  context: CanvasRenderingContext2D,
  { contacts, colour }: Felt,
  put: Put,
  normalM: number,
  palette: Palette,
): void {
  context.lineCap = "round";
  contacts.forEach(({ position_m, normal }, i) => {
    const at = put(position_m);
    const isLast = i === contacts.length - 1;
    const isLate = i >= contacts.length - LATEST;
    context.globalAlpha = (isLate ? 0.75 : 0.4) + 0.25 * at.near;
    context.strokeStyle = colour;
    context.lineWidth = isLate ? 1.5 : 1;
    if (normal !== null) {
      const out = put(position_m.map((x, axis) => x + normalM * normal[axis]!) as Vec3);
      context.beginPath();
      context.moveTo(at.x, at.y);
      context.lineTo(out.x, out.y);
      context.stroke();
    }
    if (isLate) {
      context.fillStyle = palette.labelHalo;
      disc(context, at.x, at.y, 4);
    }
    context.fillStyle = colour;
    disc(context, at.x, at.y, isLast ? 4.4 : isLate ? 3 : 1.8);
    if (isLast) {
      context.globalAlpha = 0.9;
      context.beginPath();
      context.arc(at.x, at.y, 8, 0, 2 * Math.PI);
      context.stroke();
    }
  });
}

function drawCross(context: CanvasRenderingContext2D, { x, y }: Seen, palette: Palette): void {
  context.globalAlpha = 0.95;
  context.strokeStyle = palette.recall;
  context.lineWidth = 1.5;
  context.beginPath();
  for (const [dx, dy] of [
    [1, 1],
    [1, -1],
  ] as const) {
    context.moveTo(x - 4 * dx, y - 4 * dy);
    context.lineTo(x + 4 * dx, y + 4 * dy);
  }
  context.stroke();
}

function disc(context: CanvasRenderingContext2D, x: number, y: number, radius: number): void {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fill();
}

/** A colour between the stops. */
export function ramp(stops: string[], part: number): string {
  const at = Math.min(0.999, Math.max(0, part)) * (stops.length - 1);
  const [low, high] = [rgb(stops[Math.floor(at)]!), rgb(stops[Math.floor(at) + 1]!)];
  const mixed = low.map((x, i) => Math.round(255 * (x + (at % 1) * (high[i]! - x))));
  return `rgb(${mixed.join(" ")})`;
}
