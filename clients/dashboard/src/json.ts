/**
 * JSON with exact integers.
 *
 * Stamps, sessions and revisions are 64-bit integers, and `JSON.parse` rounds those beyond 2⁵³.
 * Here an integer that a double cannot hold becomes a `bigint`, and any other number a `number`.
 */

/** An integer of 64 bits, as it was read. */
export type Int64 = number | bigint;

export type Json = null | boolean | number | bigint | string | Json[] | { [key: string]: Json };

/** An integer of sixteen digits or more: a shorter one is never beyond 2⁵³. */
const LONG_INTEGER = /(?<![\d.])\d{16}/;
/** A string, or such an integer that is not a part of another number. */
const TOKEN = /"(?:[^"\\]|\\.)*"|(?<![\d.eE+-])-?\d{16,}(?![\d.eE])/g;
/** Marks a string that stands for an integer. */
const MARK = "\u0000int64:";

/** Reads JSON. Throws a `SyntaxError` where it is none. */
export function parse(text: string): Json {
  if (!LONG_INTEGER.test(text)) {
    return JSON.parse(text) as Json;
  }
  const marked = text.replace(TOKEN, (token) =>
    !token.startsWith('"') && !Number.isSafeInteger(Number(token))
      ? `"${MARK.replace("\u0000", "\\u0000")}${token}"`
      : token,
  );
  return JSON.parse(marked, (_key, value: Json) =>
    typeof value === "string" && value.startsWith(MARK) ? BigInt(value.slice(MARK.length)) : value,
  ) as Json;
}

/** Writes JSON; a `bigint` becomes an integer with all of its digits. */
export function stringify(value: unknown): string {
  const marked = JSON.stringify(value, (_key, part: unknown) =>
    typeof part === "bigint" ? `${MARK}${part}` : part,
  );
  return marked.replace(/"\\u0000int64:(-?\d+)"/g, "$1");
}

/** Seconds from one stamp to another [s]; exact to a nanosecond within a hundred days. */
export function secondsBetween(from: Int64, to: Int64): number {
  return Number(BigInt(to) - BigInt(from)) * 1e-9;
}

/** The stamp some seconds after another. */
export function stampAfter(from: Int64, seconds: number): bigint {
  return BigInt(from) + BigInt(Math.round(seconds * 1e9));
}
