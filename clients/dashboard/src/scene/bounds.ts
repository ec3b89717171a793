/** The part of the map that the scene shows. */

import type { Vec3 } from "../wire";

export class Bounds {
  min: Vec3 = [Infinity, Infinity, Infinity];
  max: Vec3 = [-Infinity, -Infinity, -Infinity];

  include(x: number, y: number, z: number): void {
    this.min = [Math.min(this.min[0], x), Math.min(this.min[1], y), Math.min(this.min[2], z)];
    this.max = [Math.max(this.max[0], x), Math.max(this.max[1], y), Math.max(this.max[2], z)];
  }

  get isEmpty(): boolean {
    return !(this.min[0] <= this.max[0]);
  }

  get centre(): Vec3 {
    return this.isEmpty ? [0, 0, 0] : (this.min.map((low, i) => (low + this.max[i]!) / 2) as Vec3);
  }

  /** Half of the diagonal, at least two metres [m]. */
  get radius(): number {
    const size = this.isEmpty ? [0, 0, 0] : this.min.map((low, i) => this.max[i]! - low);
    return Math.max(2, Math.hypot(...size) / 2);
  }
}

/** The number 1, 2 or 5 times a power of ten that is next above. */
export function roundStep(least: number): number {
  const power = 10 ** Math.floor(Math.log10(least));
  const digit = [1, 2, 5, 10].find((candidate) => candidate * power >= least * 0.999) ?? 10;
  return digit * power;
}
