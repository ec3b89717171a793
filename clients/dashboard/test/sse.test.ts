import assert from "node:assert/strict";
import { test } from "node:test";
import { EventParser } from "../src/sse";

const STREAM =
  ': hello\n\nevent: tick\ndata: {"a":1}\n\nevent: lagged\r\ndata: x\r\ndata: y\r\n\r\n\ndata:z\n\n';
const EVENTS = [
  { event: "tick", data: '{"a":1}' },
  { event: "lagged", data: "x\ny" },
  { event: "message", data: "z" },
];

test("events are the same however the stream is cut", () => {
  for (let size = 1; size <= STREAM.length; size += 1) {
    const parser = new EventParser();
    const found = [];
    for (let at = 0; at < STREAM.length; at += size) {
      found.push(...parser.push(STREAM.slice(at, at + size)));
    }
    assert.deepEqual(found, EVENTS, `in pieces of ${size}`);
  }
});
