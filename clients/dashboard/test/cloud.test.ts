import assert from "node:assert/strict";
import { test } from "node:test";
import { Clock } from "../src/memory/clock";
import { Cloud } from "../src/memory/cloud";
import type { CloudFile } from "../src/ply";

function file(ids: number[], sinceRevision: bigint, forgotten: number[] = []): CloudFile {
  const n = ids.length;
  return {
    revision: 9n,
    sinceRevision,
    n,
    id: Uint32Array.from(ids),
    position: Float32Array.from(ids.flatMap((id) => [id, 0, 0])),
    strength: new Float32Array(n).fill(1),
    visits: new Uint32Array(n).fill(1),
    firstS: new Float64Array(n).fill(1_700_000_000),
    lastS: new Float64Array(n).fill(1_700_000_001),
    forgotten: Uint32Array.from(forgotten),
  };
}

test("changes are put where their places are, and forgotten places go", () => {
  const cloud = new Cloud(new Clock());
  cloud.apply(file([3, 5], 0n));
  cloud.apply(file([5, 7], 4n, [3]));
  assert.equal(cloud.positionOf(3), null);
  assert.deepEqual(cloud.positionOf(7), [7, 0, 0]);
  assert.equal(cloud.n, 3);
  cloud.apply(file([1], 0n));
  assert.equal(cloud.n, 1);
  assert.equal(cloud.positionOf(5), null);
});

test("only the rows that changed are sent to the graphics card", () => {
  const cloud = new Cloud(new Clock());
  cloud.apply(file([0, 1, 2, 3], 0n));
  cloud.dirty = null;
  cloud.apply(file([2], 4n));
  assert.deepEqual(cloud.dirty, { from: 2, to: 3, isReplaced: false });
});

test("a place is shown as soon as an event tells of it, and room is made for many", () => {
  const cloud = new Cloud(new Clock());
  for (let id = 0; id < 3000; id += 1) {
    cloud.recruit(id, [id, 1, 2], id);
  }
  assert.equal(cloud.n, 3000);
  assert.deepEqual(cloud.positionOf(2999), [2999, 1, 2]);
});
