/** The places of a space, in columns, as the graphics card takes them. */

import type { CloudFile } from "../ply";
import { Bounds } from "../scene/bounds";
import type { Vec3 } from "../wire";
import type { Clock } from "./clock";

export class Cloud {
  /** Number of rows; some may be of forgotten places. */
  n = 0;
  /** Number of the place of each row. */
  id = new Uint32Array(1024);
  position = new Float32Array(3 * 1024);
  /** Strength (−1 of a forgotten place), visits, first and last second of the view's clock. */
  facts = new Float32Array(4 * 1024);
  /** Rows that changed since the last look, as a range; and whether the columns were replaced. */
  dirty: { from: number; to: number; isReplaced: boolean } | null = null;
  strengthMax = 1;
  visitsMax = 1;
  bounds = new Bounds();
  private rows = new Map<number, number>();

  constructor(private readonly clock: Clock) {}

  /** Takes a file in: in place of all, or what changed. */
  apply(file: CloudFile): void {
    if (file.sinceRevision === 0n) {
      this.clear();
      this.reserve(file.n);
    }
    for (let i = 0; i < file.n; i += 1) {
      const at = 3 * i;
      this.put(
        file.id[i]!,
        [file.position[at]!, file.position[at + 1]!, file.position[at + 2]!],
        file.strength[i]!,
        file.visits[i]!,
        this.clock.ofUnix(file.firstS[i]!),
        this.clock.ofUnix(file.lastS[i]!),
      );
    }
    file.forgotten.forEach((id) => this.forget(id));
  }

  clear(): void {
    this.n = 0;
    this.rows.clear();
    this.strengthMax = 1;
    this.visitsMax = 1;
    this.bounds = new Bounds();
    this.dirty = { from: 0, to: 0, isReplaced: true };
  }

  /** A place that was just recruited. */
  recruit(id: number, position: Vec3, s: number): void {
    if (!this.rows.has(id)) {
      this.put(id, position, 1, 1, s, s);
    }
  }

  forget(id: number): void {
    const row = this.rows.get(id);
    if (row !== undefined) {
      this.facts[4 * row] = -1;
      this.touch(row);
    }
  }

  /** Row of a place that is remembered. */
  rowOf(id: number): number | null {
    const row = this.rows.get(id);
    return row === undefined || this.facts[4 * row]! < 0 ? null : row;
  }

  positionOf(id: number): Vec3 | null {
    const row = this.rowOf(id);
    return row === null ? null : this.positionAt(row);
  }

  positionAt(row: number): Vec3 {
    const at = 3 * row;
    return [this.position[at]!, this.position[at + 1]!, this.position[at + 2]!];
  }

  private put(
    id: number,
    position: Vec3,
    strength: number,
    visits: number,
    firstS: number,
    lastS: number,
  ): void {
    let row = this.rows.get(id);
    if (row === undefined) {
      row = this.n;
      this.reserve(row + 1);
      this.n += 1;
      this.rows.set(id, row);
      this.id[row] = id;
    }
    this.position.set(position, 3 * row);
    this.bounds.include(...position);
    this.facts[4 * row] = strength;
    this.facts[4 * row + 1] = visits;
    this.facts[4 * row + 2] = firstS;
    this.facts[4 * row + 3] = lastS;
    this.strengthMax = Math.max(this.strengthMax, strength);
    this.visitsMax = Math.max(this.visitsMax, visits);
    this.touch(row);
  }

  private touch(row: number): void {
    this.dirty ??= { from: row, to: row, isReplaced: false };
    this.dirty.from = Math.min(this.dirty.from, row);
    this.dirty.to = Math.max(this.dirty.to, row + 1);
  }

  private reserve(n: number): void {
    if (n <= this.id.length) {
      return;
    }
    const capacity = Math.max(n, 2 * this.id.length);
    const id = new Uint32Array(capacity);
    const position = new Float32Array(3 * capacity);
    const facts = new Float32Array(4 * capacity);
    id.set(this.id);
    position.set(this.position);
    facts.set(this.facts);
    [this.id, this.position, this.facts] = [id, position, facts];
    this.dirty = { from: 0, to: this.n, isReplaced: true };
  }
}
