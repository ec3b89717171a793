/** The floor: a grid under the map with a scale, and the axes of `map`. */

import type { Vec3 } from "../wire";
import { roundStep, type Bounds } from "./bounds";
import { Lines, LineWriter } from "./lines";
import { rgb, type Palette } from "./palette";

/** About so many cells lie along the longer side. */
const CELLS = 10;
/** A map that is lower than this part of its radius is flat. */
const FLAT = 0.02;

export interface Mark {
  at: Vec3;
  text: string;
  axis: "x" | "y" | "z";
  isName: boolean;
}

interface Extent {
  x: [number, number];
  y: [number, number];
}

/** Height of the floor [m]: that of a flat map, so that what is clicked on is what is drawn; else
 * somewhat below the map. */
function heightUnder({ min, max, radius }: Bounds, step: number): number {
  const isFlat = max[2] - min[2] < FLAT * radius;
  const rounded = step / (isFlat ? 100 : 4);
  return Math.floor((isFlat ? min[2] : min[2] - 0.04 * radius) / rounded) * rounded;
}

export class Floor {
  readonly lines = new Lines();
  private names: Mark[] = [];
  private extent: Extent | null = null;
  /** Height of the floor [m]. */
  z = 0;
  step = 1;
  private drawn = "";

  /** Draws the floor anew where the map has outgrown it. */
  update(bounds: Bounds, palette: Palette): void {
    if (bounds.isEmpty) {
      return;
    }
    const wide = Math.max(bounds.max[0] - bounds.min[0], bounds.max[1] - bounds.min[1], 1);
    const step = roundStep(wide / CELLS);
    const low = (axis: 0 | 1): number => Math.floor(bounds.min[axis] / step - 0.5) * step;
    const high = (axis: 0 | 1): number => Math.ceil(bounds.max[axis] / step + 0.5) * step;
    const [x0, x1, y0, y1] = [low(0), high(0), low(1), high(1)];
    const floor = heightUnder(bounds, step);
    const asked = [x0, x1, y0, y1, floor, step, palette.shade].join();
    if (asked === this.drawn) {
      return;
    }
    this.drawn = asked;
    this.z = floor;
    this.step = step;
    const colour = rgb(palette.grid);
    const nX = Math.round((x1 - x0) / step);
    const nY = Math.round((y1 - y0) / step);
    this.lines.reserve(2 * (nX + nY) + 16);
    const writer = new LineWriter(this.lines);
    const alpha = (at: number): number => (Math.round(at / step) % 5 === 0 ? 0.3 : 0.13);
    this.extent = { x: [x0, x1], y: [y0, y1] };
    for (let i = 0; i <= nX; i += 1) {
      const x = x0 + i * step;
      writer.add([x, y0, floor], [x, y1, floor], colour, alpha(x), 1);
    }
    for (let i = 0; i <= nY; i += 1) {
      const y = y0 + i * step;
      writer.add([x0, y, floor], [x1, y, floor], colour, alpha(y), 1);
    }
    const origin: Vec3 = [x0, y0, floor];
    const axes = {
      x: [x0 + step, y0, floor],
      y: [x0, y0 + step, floor],
      z: [x0, y0, floor + step],
    };
    this.names = [];
    for (const [axis, end] of Object.entries(axes) as ["x" | "y" | "z", Vec3][]) {
      writer.add(origin, end, rgb(palette.axis[axis]), 0.95, 2);
      const name = end.map((value, i) => value + 0.22 * (value - origin[i]!)) as Vec3;
      this.names.push({ at: name, text: axis, axis, isName: true });
    }
    writer.finish();
  }

  /** Numbers along the edges that are nearest to the eye, and the names of the axes. */
  marks(eye: { x: number; y: number }): Mark[] {
    if (this.extent === null) {
      return [];
    }
    const {
      x: [x0, x1],
      y: [y0, y1],
    } = this.extent;
    const step = this.step;
    const near = (low: number, high: number, at: number): number =>
      Math.abs(at - low) < Math.abs(at - high) ? low - 0.4 * step : high + 0.4 * step;
    const [besideX, besideY] = [near(x0, x1, eye.x), near(y0, y1, eye.y)];
    const marks = [...this.names];
    for (let x = x0; x <= x1 + step / 2; x += step) {
      marks.push({ at: [x, besideY, this.z], text: metres(x, step), axis: "x", isName: false });
    }
    for (let y = y0; y <= y1 + step / 2; y += step) {
      marks.push({ at: [besideX, y, this.z], text: metres(y, step), axis: "y", isName: false });
    }
    return marks;
  }
}

function metres(value: number, step: number): string {
  const digits = Math.max(0, -Math.floor(Math.log10(step)));
  return `${value
    .toFixed(digits)
    .replace("-", "−")
    .replace(/^−(0(\.0*)?)$/, "$1")}`;
}
