/**
 * The lattices of the grid modules, as `service/core/grid` has them: face-centred cubic, module m
 * turned by Aᵐ Bᵐ.
 */

import type { GridModule, Quat, Vec3 } from "../wire";

/** Columns of the standard basis, for a spacing of one. */
const ROOT_3 = Math.sqrt(3);
const ROOT_6 = Math.sqrt(6);
export const STANDARD: [Vec3, Vec3, Vec3] = [
  [1, 0, 0],
  [1 / 2, ROOT_3 / 2, 0],
  [1 / 2, ROOT_3 / 6, ROOT_6 / 3],
];
const FIRST = unit([-1, 0, -1, 5]);
const SECOND = unit([0, -1, 2, 4]);

function unit(q: Quat): Quat {
  const norm = Math.hypot(...q);
  return q.map((x) => x / norm) as Quat;
}

/** Product of two quaternions `[x, y, z, w]`. */
export function multiply(a: Quat, b: Quat): Quat {
  const [ax, ay, az, aw] = a;
  const [bx, by, bz, bw] = b;
  return [
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
    aw * bw - ax * bx - ay * by - az * bz,
  ];
}

export function conjugate([x, y, z, w]: Quat): Quat {
  return [-x, -y, -z, w];
}

/** A vector turned by a unit quaternion. */
export function rotate(q: Quat, v: Vec3): Vec3 {
  const [x, y, z] = multiply(multiply(q, [...v, 0]), conjugate(q));
  return [x, y, z];
}

/** The lattice axes of a module in `map` [m per turn]. */
export function basis(module: number, spacingM: number): [Vec3, Vec3, Vec3] {
  let turn: Quat = [0, 0, 0, 1];
  for (let m = 0; m < module; m += 1) {
    turn = unit(multiply(multiply(FIRST, turn), SECOND));
  }
  return STANDARD.map((axis) => rotate(turn, axis).map((x) => x * spacingM)) as [Vec3, Vec3, Vec3];
}

/** Where the coordinates along some axes lead. */
export function combine(axes: [Vec3, Vec3, Vec3], turns: ArrayLike<number>): Vec3 {
  return [0, 1, 2].map(
    (i) => axes[0][i]! * turns[0]! + axes[1][i]! * turns[1]! + axes[2][i]! * turns[2]!,
  ) as Vec3;
}

/**
 * The positions around a point that have the module's phase: the firing fields of the cells that
 * are active now [m]. None where the service's lattice is another than this page knows.
 */
export function firingFields(
  number: number,
  module: GridModule,
  around: Vec3,
  radiusM: number,
): Vec3[] {
  const axes = basis(number, module.spacing_m);
  const reference = combine(axes, module.reference);
  const off = Math.hypot(...reference.map((x, i) => x - module.reference_m[i]!));
  if (off > 1e-6 * Math.max(1, Math.hypot(...reference)) + 1e-6) {
    return [];
  }
  const shells = Math.min(4, Math.ceil((1.3 * radiusM) / module.spacing_m));
  const found: Vec3[] = [];
  for (let i = -shells; i <= shells; i += 1) {
    for (let j = -shells; j <= shells; j += 1) {
      for (let k = -shells; k <= shells; k += 1) {
        const away = combine(axes, [i, j, k]);
        if (Math.hypot(...away) <= radiusM) {
          found.push(away.map((x, axis) => x + around[axis]!) as Vec3);
        }
      }
    }
  }
  return found;
}
