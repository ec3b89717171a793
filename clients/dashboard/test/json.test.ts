import assert from "node:assert/strict";
import { test } from "node:test";
import { parse, secondsBetween, stampAfter, stringify } from "../src/json";

test("stamps keep all of their digits", () => {
  const read = parse(
    '{"stamp_ns":1795264924668453163,"list":[-9223372036854775808,18446744073709551615]}',
  );
  assert.deepEqual(read, {
    stamp_ns: 1795264924668453163n,
    list: [-9223372036854775808n, 18446744073709551615n],
  });
});

test("numbers that a double holds stay numbers", () => {
  const text =
    '{"a":9007199254740991,"b":0.7930670352198552,"c":-1.7930670352198552e-12,"d":1e300,"e":12}';
  assert.deepEqual(parse(text), JSON.parse(text));
  assert.equal(
    (parse("[1795264924668453163, 0.1234567890123456789]") as number[])[1],
    0.1234567890123456789,
  );
  assert.equal(
    (parse("[1795264924668453163, 1234567890123456789.5]") as number[])[1],
    1234567890123456789.5,
  );
  assert.equal(
    (parse("[1795264924668453163, 1234567890123456789e2]") as number[])[1],
    1234567890123456789e2,
  );
});

test("digits within strings are left alone", () => {
  const text =
    '{"label":"door 1795264924668453163, \\"9007199254740993\\"","9007199254740993":1795264924668453163}';
  assert.deepEqual(parse(text), {
    label: 'door 1795264924668453163, "9007199254740993"',
    "9007199254740993": 1795264924668453163n,
  });
});

test("what is no JSON is refused", () => {
  assert.throws(() => parse("{"), SyntaxError);
  assert.throws(() => parse("[1795264924668453163,]"), SyntaxError);
});

test("what was read is written again with the same digits", () => {
  const text = '{"since_ns":1795264924668453163,"n":-1,"s":"int64:5"}';
  assert.equal(stringify(parse(text)), text);
});

test("spans between stamps are exact to a nanosecond", () => {
  const [from, to] = [1795264924668453163n, 1795264925668453164n];
  assert.equal(secondsBetween(from, to), 1.000000001);
  assert.equal(stampAfter(from, 1.000000001), to);
});
