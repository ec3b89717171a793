import assert from "node:assert/strict";
import { test } from "node:test";
import { choleskyColumns } from "../src/scene/cholesky";

test("the factor times its transpose is the covariance", () => {
  const c = [0.9, 0.2, -0.1, 0.5, 0.07, 0.3];
  const [a, b, d] = choleskyColumns(c);
  const entry = (i: number, j: number): number => a[i]! * a[j]! + b[i]! * b[j]! + d[i]! * d[j]!;
  const pairs = [
    [0, 0],
    [0, 1],
    [0, 2],
    [1, 1],
    [1, 2],
    [2, 2],
  ] as const;
  pairs.forEach(([i, j], at) => assert.ok(Math.abs(entry(i, j) - c[at]!) < 1e-12));
});

test("a covariance that is not positive gives finite columns", () => {
  for (const c of [
    [0, 0, 0, 0, 0, 0],
    [1, 1, 1, 1, 1, 1],
    [-1, 0, 0, 2, 0, -3],
  ]) {
    assert.ok(choleskyColumns(c).flat().every(Number.isFinite));
  }
});
