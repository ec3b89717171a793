/** Where an agent was: poses by time, in columns. */

import type { Quat, Vec3 } from "../wire";

/** Poses that a track keeps; an hour at ten poses a second. Beyond, the older half goes. */
const POSES_MAX = 36_000;
/** Breaks that a track keeps. */
const BREAKS_MAX = 32;
/** Numbers of a pose: time, position, rotation. */
const STRIDE = 8;
/** Two poses farther apart than this are not joined by a line [s]. */
const GAP_S = 3;
/** Nor are those between which the agent would have moved faster than this [m/s]. */
const SPEED_MAX_M_S = 40;

export interface TrackPose {
  position: Vec3;
  rotation: Quat;
}

export class Track {
  private rows = new Float64Array(STRIDE * 256);
  /** Number of poses. */
  n = 0;
  /** Grows with each change other than poses added at the end. */
  rewrites = 0;
  /** Times at which the frame of the poses became another one [s]. */
  private breaks: number[] = [];
  /** Times between which the poses were of another frame [s]. */
  private hidden: [number, number][] = [];

  push(s: number, position: Vec3, rotation: Quat): void {
    if (this.n > 0 && s <= this.time(this.n - 1)) {
      return;
    }
    if (this.n === POSES_MAX) {
      this.rows.copyWithin(0, (STRIDE * POSES_MAX) / 2);
      this.n = POSES_MAX / 2;
      this.rewrites += 1;
    }
    if (STRIDE * (this.n + 1) > this.rows.length) {
      const larger = new Float64Array(this.rows.length * 2);
      larger.set(this.rows);
      this.rows = larger;
    }
    this.rows.set([s, ...position, ...rotation], STRIDE * this.n);
    this.n += 1;
  }

  /** Puts poses among those that are there, each where its time says. */
  merge(poses: { s: number; position: Vec3; rotation: Quat }[]): void {
    const own = Array.from({ length: this.n }, (_, i) => ({ s: this.time(i), ...this.pose(i) }));
    this.n = 0;
    for (const { s, position, rotation } of [...own, ...poses].sort((a, b) => a.s - b.s)) {
      this.push(s, position, rotation);
    }
    this.rewrites += 1;
  }

  time(i: number): number {
    return this.rows[STRIDE * i]!;
  }

  /** Coordinate of a pose [m]. */
  at(i: number, axis: number): number {
    return this.rows[STRIDE * i + 1 + axis]!;
  }

  pose(i: number): TrackPose {
    const r = this.rows.subarray(STRIDE * i, STRIDE * (i + 1));
    return { position: [r[1]!, r[2]!, r[3]!], rotation: [r[4]!, r[5]!, r[6]!, r[7]!] };
  }

  /** Parts what was before a time from what is since: it became known where the agent is [s]. */
  part(s: number): void {
    this.breaks.push(s);
    this.breaks.splice(0, Math.max(0, this.breaks.length - BREAKS_MAX));
    this.rewrites += 1;
  }

  /** Says that poses between these times are of another frame than `map`: they are not drawn [s]. */
  hide(from: number, to: number): void {
    this.hidden.push([from, to]);
    this.hidden.splice(0, Math.max(0, this.hidden.length - BREAKS_MAX));
    this.rewrites += 1;
  }

  /** Whether pose `i` follows the one before without a break: no gap, no leap. */
  isJoined(i: number): boolean {
    if (i === 0) {
      return false;
    }
    if (this.breaks.some((at) => at > this.time(i - 1) && at <= this.time(i))) {
      return false;
    }
    if (this.hidden.some(([from, to]) => from <= this.time(i) && this.time(i) < to)) {
      return false;
    }
    const s = this.time(i) - this.time(i - 1);
    const step = (axis: number): number => this.at(i, axis) - this.at(i - 1, axis);
    const m = Math.hypot(step(0), step(1), step(2));
    return s < GAP_S && m < Math.max(0.75, SPEED_MAX_M_S * s);
  }

  /** Number of poses up to a time. */
  countUntil(s: number): number {
    let low = 0;
    let high = this.n;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.time(middle) <= s) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    return low;
  }

  /** The latest pose up to a time; none before the first one. */
  before(s: number): TrackPose | null {
    const n = this.countUntil(s);
    return n === 0 ? null : this.pose(n - 1);
  }
}
