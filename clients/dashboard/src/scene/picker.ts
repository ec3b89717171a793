/** What lies under a point of the picture. */

import type { PerspectiveCamera } from "three";
import { Matrix4, Vector3 } from "three";
import type { Cloud } from "../memory/cloud";
import type { Vec3 } from "../wire";

export type Picked =
  | { kind: "agent"; name: string }
  | { kind: "landmark"; name: string }
  | { kind: "place"; id: number }
  | { kind: "object"; name: string };

/** How near the point has to be to what is meant [px]. */
const REACH_PX = { agent: 18, landmark: 12, place: 11 };

/** Puts points of `map` onto the picture. */
export class Projection {
  private readonly matrix = new Matrix4();
  private readonly eye = new Vector3();

  constructor(
    camera: PerspectiveCamera,
    readonly width: number,
    readonly height: number,
  ) {
    camera.updateMatrixWorld();
    this.matrix.multiplyMatrices(camera.projectionMatrix, camera.matrixWorldInverse);
    camera.getWorldPosition(this.eye);
  }

  /** Place on the picture [px] and distance along the view [m]; none behind the eye. */
  at(point: ArrayLike<number>): { x: number; y: number; depth: number } | null {
    const e = this.matrix.elements;
    const [x, y, z] = [point[0]!, point[1]!, point[2]!];
    const w = e[3]! * x + e[7]! * y + e[11]! * z + e[15]!;
    if (w <= 0.001) {
      return null;
    }
    const u = (e[0]! * x + e[4]! * y + e[8]! * z + e[12]!) / w;
    const v = (e[1]! * x + e[5]! * y + e[9]! * z + e[13]!) / w;
    return { x: (u * 0.5 + 0.5) * this.width, y: (0.5 - v * 0.5) * this.height, depth: w };
  }

  /** Where the line of sight through a pixel meets a height [m]; none where it does not. */
  onHeight(camera: PerspectiveCamera, x: number, y: number, z: number): Vec3 | null {
    const far = new Vector3((2 * x) / this.width - 1, 1 - (2 * y) / this.height, 0.5).unproject(
      camera,
    );
    const way = far.sub(this.eye);
    const times = (z - this.eye.z) / way.z;
    if (!Number.isFinite(times) || times <= 0) {
      return null;
    }
    const met = this.eye.clone().addScaledVector(way, times);
    return [met.x, met.y, met.z];
  }

  /** The place nearest to a pixel, of those that were there at a time; nearer ones win. */
  place(cloud: Cloud, nowS: number, x: number, y: number): number | null {
    const e = this.matrix.elements;
    const { position, facts, n } = cloud;
    let best = REACH_PX.place ** 2;
    let bestDepth = Infinity;
    let found: number | null = null;
    for (let row = 0, at = 0; row < n; row += 1, at += 3) {
      if (facts[4 * row]! < 0 || facts[4 * row + 2]! > nowS) {
        continue;
      }
      const [px, py, pz] = [position[at]!, position[at + 1]!, position[at + 2]!];
      const w = e[3]! * px + e[7]! * py + e[11]! * pz + e[15]!;
      if (w <= 0.001) {
        continue;
      }
      const u = (e[0]! * px + e[4]! * py + e[8]! * pz + e[12]!) / w;
      const dx = (u * 0.5 + 0.5) * this.width - x;
      if (dx > REACH_PX.place || dx < -REACH_PX.place) {
        continue;
      }
      const v = (e[1]! * px + e[5]! * py + e[9]! * pz + e[13]!) / w;
      const dy = (0.5 - v * 0.5) * this.height - y;
      // Of two that are about as close to the pixel, the one in front is seen.
      const off = dx * dx + dy * dy;
      if (off < best - 4 || (off < best + 4 && w < bestDepth && off < REACH_PX.place ** 2)) {
        best = off;
        bestDepth = w;
        found = row;
      }
    }
    return found;
  }

  /** The nearest of some named points. */
  named(
    points: Iterable<{ name: string; at: ArrayLike<number> }>,
    kind: "agent" | "landmark",
    x: number,
    y: number,
  ): string | null {
    let best: number = REACH_PX[kind];
    let found: string | null = null;
    for (const { name, at } of points) {
      const seen = this.at(at);
      const off = seen === null ? Infinity : Math.hypot(seen.x - x, seen.y - y);
      if (off < best) {
        best = off;
        found = name;
      }
    }
    return found;
  }
}
