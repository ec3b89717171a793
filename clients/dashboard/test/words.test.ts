import assert from "node:assert/strict";
import { test } from "node:test";
import { bytes, degrees, deviation, exact, metres, percent, span, time } from "../src/panel/format";
import { inWords } from "../src/panel/event_feed";
import { roundStep } from "../src/scene/bounds";

test("numbers are short and have their units", () => {
  assert.equal(metres(-1.234), "−1.23 m");
  assert.equal(metres(15.06), "15.1 m");
  assert.equal(deviation(0.0123), "1.2 cm");
  assert.equal(deviation(0.5), "50 cm");
  assert.equal(deviation(5.2), "5.20 m");
  assert.equal(degrees(-Math.PI / 2), "−90°");
  assert.deepEqual([0, 0.42, 0.9999999, 1].map(percent), ["0 %", "42 %", "99.9 %", "100 %"]);
  assert.equal(bytes(61_000_000), "61 MB");
  assert.equal(bytes(512), "512 B");
  assert.equal(span(4.04), "4.0 s");
  assert.equal(span(125), "2 min 05");
});

test("stamps are told to a tenth of a second, and exactly where asked", () => {
  assert.equal(exact(1795264924668453163n), "1795264924668453163 ns");
  assert.match(time(1795264924668453163n), /^\d\d:\d\d:04\.6$/);
  assert.equal(time(2_500_000_000), "2.5 s");
});

test("steps of a scale are round", () => {
  assert.deepEqual([0.9, 1, 1.1, 3, 7, 45].map(roundStep), [1, 1, 2, 5, 10, 50]);
});

test("one leg is a leg", () => {
  const ended = (legs: number): string | null =>
    inWords({
      kind: "trip_ended",
      fields: { legs, reason: "session_end" },
    } as unknown as Parameters<typeof inWords>[0]);
  assert.equal(ended(1), "ended a trip of 1 leg (session end)");
  assert.equal(ended(12), "ended a trip of 12 legs (session end)");
});

test("samples that are not in the map are told with their numbers and why", () => {
  const words = (fields: { [field: string]: unknown }): string | null =>
    inWords({ kind: "samples_skipped", fields } as unknown as Parameters<typeof inWords>[0]);
  const refused = words({ from: 4, to: 5, reason: "non_unit_quaternion" });
  assert.equal(refused, "refused sample 4 (non unit quaternion)");
  assert.equal(words({ from: 4, to: 7, reason: "lost" }), "samples 4 to 6 never came");
});
