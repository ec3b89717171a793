import assert from "node:assert/strict";
import { test } from "node:test";
import { basis, combine, conjugate, firingFields, multiply, rotate } from "../src/grid/lattice";
import { octantSides } from "../src/panel/grid_panel";
import type { GridModule, Quat, Vec3 } from "../src/wire";

/** What a service answered for an agent: reference indices and points of its six modules. */
const ANSWERED: [number, Vec3, Vec3][] = [
  [1.2, [3, 1, 6], [7.799999999999999, 3.117691453623979, 5.878775382679627]],
  [1.9416, [6, -4, 2], [9.340404972200345, 2.6405895907137595, 6.441839933490211]],
  [3.1415088, [2, -5, 0], [10.978597925796155, -2.2887868981415282, 7.857755111205199]],
];

function near(a: Vec3, b: Vec3, within = 1e-9): void {
  a.forEach((x, i) => assert.ok(Math.abs(x - b[i]!) < within, `${a} is not ${b}`));
}

test("the lattices are those of the service", () => {
  ANSWERED.forEach(([spacing, reference, point], module) => {
    near(combine(basis(module, spacing), reference), point);
  });
});

test("firing fields are one spacing apart, twelve around the first", () => {
  const [spacing_m, reference, reference_m] = ANSWERED[1]!;
  const module: GridModule = {
    spacing_m,
    reference,
    reference_m,
    phase: [0, 0, 0],
    activation: [],
    octant_activation: 0,
  };
  const around: Vec3 = [1, 2, 3];
  const fields = firingFields(1, module, around, 1.01 * spacing_m);
  assert.equal(fields.length, 13);
  const far = fields.filter((at) => Math.hypot(...at.map((x, i) => x - around[i]!)) > 1e-9);
  far.forEach((at) => {
    const away = Math.hypot(...at.map((x, i) => x - around[i]!));
    assert.ok(Math.abs(away - spacing_m) < 1e-9);
  });
});

test("fields of another lattice than the service's are not drawn", () => {
  const module: GridModule = {
    spacing_m: 1.2,
    reference: [1, 0, 0],
    reference_m: [0, 1.2, 0],
    phase: [0, 0, 0],
    activation: [],
    octant_activation: 0,
  };
  assert.deepEqual(firingFields(0, module, [0, 0, 0], 3), []);
});

test("turning there and back leads home", () => {
  const q: Quat = [0.1, -0.5, 0.3, Math.sqrt(1 - 0.35)];
  near(rotate(conjugate(q), rotate(q, [1, 2, 3])), [1, 2, 3]);
  const [x, y, z, w] = multiply(q, conjugate(q));
  near([x, y, z], [0, 0, 0]);
  assert.ok(Math.abs(w - 1) < 1e-12);
});

test("octants have the signs of the seed paper", () => {
  const signs: Vec3[] = [
    [1, 1, 1],
    [-1, 1, 1],
    [-1, -1, 1],
    [1, -1, 1],
    [1, 1, -1],
    [-1, 1, -1],
    [-1, -1, -1],
    [1, -1, -1],
  ];
  assert.deepEqual([1, 2, 3, 4, 5, 6, 7, 8].map(octantSides), signs);
  assert.equal(octantSides(null), null);
});
