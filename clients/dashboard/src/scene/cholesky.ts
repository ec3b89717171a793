/** The factor of a covariance: C = L Lᵀ with L lower triangular. */

import type { Vec3 } from "../wire";

/** Least standard deviation of a factor [m]: an ellipsoid keeps a body. */
const SD_MIN_M = 1e-4;

/**
 * The columns of L for the upper triangle (xx, xy, xz, yy, yz, zz). The unit sphere becomes, under
 * L, the ellipsoid of one standard deviation. Of a covariance that is not positive, the parts that
 * are not are taken as nearly zero.
 */
export function choleskyColumns(c: ArrayLike<number>): [Vec3, Vec3, Vec3] {
  const root = (x: number): number => Math.max(Math.sqrt(Math.max(x, 0)), SD_MIN_M);
  const xx = root(c[0]!);
  const yx = c[1]! / xx;
  const zx = c[2]! / xx;
  const yy = root(c[3]! - yx * yx);
  const zy = (c[4]! - zx * yx) / yy;
  const zz = root(c[5]! - zx * zx - zy * zy);
  return [
    [xx, yx, zx],
    [0, yy, zy],
    [0, 0, zz],
  ];
}
