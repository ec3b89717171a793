/** Short lines: sightings that fade, stems from agents to the floor, links to what was recalled. */

import type { Vec3 } from "../wire";
import { Lines } from "./lines";
import type { Rgb } from "./palette";

/** A sighting is seen for this long [s]. */
const LASTS_S = 0.7;
/** Sightings that are shown at once, and other lines. */
const RAYS = 512;
const OTHERS = 320;

export class Rays {
  readonly lines = new Lines({ fadeS: LASTS_S });
  private next = 0;
  private n = 0;
  private latestMs = -Infinity;

  constructor() {
    this.lines.reserve(RAYS + OTHERS);
    for (let i = 0; i < RAYS + OTHERS; i += 1) {
      this.lines.clear(i);
    }
    this.lines.count = RAYS + OTHERS;
  }

  add(from: Vec3, to: Vec3, colour: Rgb, isOfAgent: boolean, nowMs: number): void {
    const s = nowMs / 1000;
    this.lines.set(
      OTHERS + this.next,
      from,
      to,
      colour,
      isOfAgent ? 0.95 : 0.5,
      isOfAgent ? 2.2 : 1.2,
      s,
    );
    this.lines.upload(OTHERS + this.next, 1);
    this.next = (this.next + 1) % RAYS;
    this.latestMs = nowMs;
  }

  isAlive(nowMs: number): boolean {
    return nowMs - this.latestMs < 1000 * LASTS_S;
  }

  /** Begins the lines that are drawn anew with each frame. */
  begin(nowMs: number): void {
    this.n = 0;
    this.lines.uniform("uNow", nowMs / 1000);
  }

  stem(top: Vec3, floorZ: number, colour: Rgb, nowMs: number): void {
    this.put(top, [top[0], top[1], floorZ], colour, 0.32, 1, nowMs);
    const arm = 0.012 * Math.max(4, Math.abs(top[2] - floorZ));
    this.put([top[0] - arm, top[1], floorZ], [top[0] + arm, top[1], floorZ], colour, 0.7, 1, nowMs);
    this.put([top[0], top[1] - arm, floorZ], [top[0], top[1] + arm, floorZ], colour, 0.7, 1, nowMs);
  }

  link(from: Vec3, to: Vec3, colour: Rgb, alpha: number, nowMs: number): void {
    this.put(from, to, colour, alpha, 1.3, nowMs);
  }

  finish(): void {
    for (let i = this.n; i < OTHERS; i += 1) {
      this.lines.clear(i);
    }
    this.lines.upload(0, OTHERS);
  }

  private put(
    from: Vec3,
    to: Vec3,
    colour: Rgb,
    alpha: number,
    width: number,
    nowMs: number,
  ): void {
    if (this.n < OTHERS) {
      this.lines.set(this.n, from, to, colour, alpha, width, nowMs / 1000);
      this.n += 1;
    }
  }
}
