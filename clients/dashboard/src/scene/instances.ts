/** Many copies of one mesh in one draw call: a column of numbers for each attribute. */

import {
  DynamicDrawUsage,
  InstancedBufferAttribute,
  type InstancedBufferGeometry,
  type Mesh,
} from "three";

export class Instances<Name extends string> {
  private readonly mesh: Mesh<InstancedBufferGeometry>;
  private readonly sizes: Record<Name, number>;
  private columns!: Record<Name, InstancedBufferAttribute>;
  private capacity = 0;
  private n = 0;

  /** `sizes` are the numbers that one copy has of each attribute. */
  constructor(mesh: Mesh<InstancedBufferGeometry>, sizes: Record<Name, number>, capacity: number) {
    this.mesh = mesh;
    this.sizes = sizes;
    mesh.frustumCulled = false;
    this.reserve(capacity);
  }

  /** Begins a new drawing, with room for `n` copies at least. */
  begin(n: number): void {
    this.reserve(n);
    this.n = 0;
  }

  get isFull(): boolean {
    return this.n >= this.capacity;
  }

  add(copy: Record<Name, ArrayLike<number>>): void {
    for (const name in this.columns) {
      this.columns[name].array.set(copy[name], this.sizes[name] * this.n);
    }
    this.n += 1;
  }

  /** Sends what was added to the graphics card. */
  finish(): void {
    this.mesh.geometry.instanceCount = this.n;
    this.mesh.visible = this.n > 0;
    for (const name in this.columns) {
      const column = this.columns[name];
      column.clearUpdateRanges();
      column.addUpdateRange(0, this.n * column.itemSize);
      column.needsUpdate = true;
    }
  }

  private reserve(n: number): void {
    if (n <= this.capacity) {
      return;
    }
    this.capacity = Math.max(n, 2 * this.capacity);
    const columns: Partial<Record<Name, InstancedBufferAttribute>> = {};
    // A geometry on the graphics card can't grow: it goes, and is sent again.
    this.mesh.geometry.dispose();
    for (const name in this.sizes) {
      const array = new Float32Array(this.sizes[name] * this.capacity);
      const column = new InstancedBufferAttribute(array, this.sizes[name]);
      columns[name] = column.setUsage(DynamicDrawUsage);
      this.mesh.geometry.setAttribute(name, column);
    }
    this.columns = columns as Record<Name, InstancedBufferAttribute>;
  }
}
