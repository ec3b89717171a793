import assert from "node:assert/strict";
import { test } from "node:test";
import { Spans } from "../src/memory/spans";

const DAY = 86_400;

test("a span reaches from the earliest to the latest stamp of its clock", () => {
  const spans = new Spans();
  assert.ok(!(spans.end > spans.begin));
  spans.hear(100, 0);
  spans.hear(50, 0);
  spans.note(-400);
  assert.deepEqual([spans.begin, spans.end], [-400, 100]);
});

test("another clock does not stretch the span that is shown", () => {
  const spans = new Spans();
  spans.hear(-20_000 * DAY, 0);
  spans.hear(10, 0);
  spans.hear(11, 100);
  spans.hear(-20_000 * DAY + 5, 100);
  assert.deepEqual([spans.begin, spans.end], [10, 11], "of the first tick the latest");
  // The first clock falls silent.
  spans.hear(-20_000 * DAY + 20, 10_200);
  assert.deepEqual([spans.begin, spans.end], [-20_000 * DAY, -20_000 * DAY + 20]);
  spans.hear(12, 10_300);
  assert.equal(spans.end, -20_000 * DAY + 20, "and stays until the other one does");
});

test("a clock that leaps leaves the span that is shown", () => {
  const spans = new Spans();
  spans.hear(0, 0);
  for (let leap = 1; leap <= 100; leap += 1) {
    spans.hear(DAY * leap, 100 * leap);
    spans.hear(leap, 100 * leap);
  }
  assert.deepEqual([spans.begin, spans.end], [0, 100]);
  // The first leaps are forgotten: one between two of them has nothing to join.
  spans.hear(DAY + 1000, 30_000);
  assert.deepEqual([spans.begin, spans.end], [DAY + 1000, DAY + 1000]);
});

test("what comes between two spans joins them", () => {
  const spans = new Spans();
  spans.note(0);
  spans.hear(6000, 0);
  assert.deepEqual([spans.begin, spans.end], [6000, 6000]);
  spans.note(3000);
  assert.deepEqual([spans.begin, spans.end], [0, 6000]);
});
