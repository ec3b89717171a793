import assert from "node:assert/strict";
import { test } from "node:test";
import { Track } from "../src/memory/track";
import type { Quat } from "../src/wire";

const AHEAD: Quat = [0, 0, 0, 1];

function track(times: number[]): Track {
  const made = new Track();
  times.forEach((s) => made.push(s, [s, 0, 0], AHEAD));
  return made;
}

test("a pose is found by its time", () => {
  const made = track([1, 2, 4]);
  assert.equal(made.before(0.5), null);
  assert.deepEqual(made.before(1)?.position, [1, 0, 0]);
  assert.deepEqual(made.before(3.9)?.position, [2, 0, 0]);
  assert.deepEqual(made.before(99)?.position, [4, 0, 0]);
});

test("poses that are older than the latest one are left out", () => {
  assert.equal(track([1, 2, 2, 1.5, 3]).n, 3);
});

test("the past is put where it belongs, without what is there already", () => {
  const made = track([10, 11, 15]);
  made.merge([8, 9, 10, 11, 13].map((s) => ({ s, position: [s, 0, 0], rotation: AHEAD })));
  assert.deepEqual(
    [0, 1, 2, 3, 4, 5].map((i) => made.time(i)),
    [8, 9, 10, 11, 13, 15],
  );
  assert.equal(made.n, 6);
});

test("no line joins what a gap or a leap parts", () => {
  const made = track([0, 0.1, 9]);
  made.push(9.1, [90, 0, 0], AHEAD);
  assert.deepEqual(
    [0, 1, 2, 3].map((i) => made.isJoined(i)),
    [false, true, false, false],
  );
});

test("no line is drawn through what was of another frame", () => {
  const made = track([1, 1.1, 1.2, 1.3, 1.4]);
  made.hide(1, 1.3);
  assert.deepEqual(
    [1, 2, 3, 4].map((i) => made.isJoined(i)),
    [false, false, true, true],
  );
  made.part(1.3);
  assert.equal(made.isJoined(3), false);
});

test("no line joins the frame of a lost agent with the map", () => {
  const made = track([1, 1.1, 1.2, 1.3]);
  made.part(1.2);
  assert.deepEqual(
    [1, 2, 3].map((i) => made.isJoined(i)),
    [true, false, true],
  );
});

test("a long track keeps its later half", () => {
  const made = new Track();
  for (let i = 0; i < 40_000; i += 1) {
    made.push(i, [i, 0, 0], AHEAD);
  }
  assert.ok(made.n <= 36_000);
  assert.equal(made.time(made.n - 1), 39_999);
  assert.deepEqual(made.before(39_000)?.position, [39_000, 0, 0]);
});
