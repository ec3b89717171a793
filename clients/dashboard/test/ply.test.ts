import assert from "node:assert/strict";
import { test } from "node:test";
import { readCloud } from "../src/ply";

const PROPERTIES = [
  "uint id",
  "float x",
  "float y",
  "float z",
  "float strength",
  "uint visits",
  "double first_s",
  "double last_s",
];

function file(places: number[][], forgotten: number[], properties = PROPERTIES): ArrayBuffer {
  const head = [
    "ply",
    "format binary_little_endian 1.0",
    "comment places of the cogmap space den",
    "comment revision 18446744073709551615",
    "comment since_revision 12",
    `element vertex ${places.length}`,
    ...properties.map((property) => `property ${property}`),
    `element forgotten ${forgotten.length}`,
    "property uint id",
    "end_header",
    "",
  ].join("\n");
  const bytes = new Uint8Array(head.length + 40 * places.length + 4 * forgotten.length);
  bytes.set(new TextEncoder().encode(head));
  const view = new DataView(bytes.buffer);
  let at = head.length;
  for (const [id, x, y, z, strength, visits, first, last] of places as [
    number,
    number,
    number,
    number,
    number,
    number,
    number,
    number,
  ][]) {
    view.setUint32(at, id, true);
    [x, y, z, strength].forEach((value, i) => view.setFloat32(at + 4 + 4 * i, value, true));
    view.setUint32(at + 20, visits, true);
    view.setFloat64(at + 24, first, true);
    view.setFloat64(at + 32, last, true);
    at += 40;
  }
  forgotten.forEach((id, i) => view.setUint32(at + 4 * i, id, true));
  return bytes.buffer;
}

test("a cloud is read field by field", () => {
  const cloud = readCloud(
    file(
      [
        [7, 1, -2, 3.5, 0.25, 9, 1.7e9 + 0.125, 1.7e9 + 0.5],
        [8, 0, 0, 0, 1, 1, 2, 3],
      ],
      [4, 5],
    ),
  );
  assert.equal(cloud.revision, 18446744073709551615n);
  assert.equal(cloud.sinceRevision, 12n);
  assert.deepEqual([...cloud.id], [7, 8]);
  assert.deepEqual([...cloud.position], [1, -2, 3.5, 0, 0, 0]);
  assert.deepEqual([...cloud.strength, ...cloud.visits], [0.25, 1, 9, 1]);
  assert.deepEqual([...cloud.firstS, ...cloud.lastS], [1.7e9 + 0.125, 2, 1.7e9 + 0.5, 3]);
  assert.deepEqual([...cloud.forgotten], [4, 5]);
});

test("an empty cloud is a cloud", () => {
  assert.equal(readCloud(file([], [])).n, 0);
});

test("another file, another order and a short one are refused", () => {
  assert.throws(() =>
    readCloud(new TextEncoder().encode("ply\nformat ascii 1.0\n").buffer as ArrayBuffer),
  );
  const swapped = [PROPERTIES[0]!, PROPERTIES[2]!, PROPERTIES[1]!, ...PROPERTIES.slice(3)];
  assert.throws(() => readCloud(file([[1, 0, 0, 0, 1, 1, 0, 0]], [], swapped)), /other properties/);
  const whole = file([[1, 0, 0, 0, 1, 1, 0, 0]], []);
  assert.throws(() => readCloud(whole.slice(0, -1)), /shorter/);
});
