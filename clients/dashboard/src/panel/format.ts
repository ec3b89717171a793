/** Numbers for people. */

import type { Int64 } from "../json";
import type { Vec3 } from "../wire";

const whole = new Intl.NumberFormat("en", { maximumFractionDigits: 0 });

export function count(n: number): string {
  return n >= 100_000 ? `${whole.format(n / 1000)} k` : whole.format(n);
}

/** So many things, by their name. */
export function some(n: number, thing: string): string {
  return `${count(n)} ${thing}${n === 1 ? "" : "s"}`;
}

/** A length with as many digits as mean something [m]. */
export function metres(m: number): string {
  const size = Math.abs(m);
  const digits = size < 10 ? 2 : size < 1000 ? 1 : 0;
  return `${m.toFixed(digits).replace("-", "−")} m`;
}

export function position(at: Vec3): string {
  return at.map((x) => x.toFixed(Math.abs(x) < 1000 ? 2 : 0).replace("-", "−")).join("  ");
}

/** A small length: in centimetres below one metre. */
export function deviation(m: number): string {
  if (!Number.isFinite(m)) {
    return "—";
  }
  if (m < 0.0995) {
    return `${(100 * m).toFixed(1)} cm`;
  }
  return m < 1 ? `${(100 * m).toFixed(0)} cm` : metres(m);
}

export function degrees(rad: number): string {
  return `${((rad * 180) / Math.PI).toFixed(Math.abs(rad) < 0.17 ? 1 : 0).replace("-", "−")}°`;
}

/** A probability; what is not quite sure is never said to be 100 %. */
export function percent(part: number): string {
  const isNearlySure = part > 0.995 && part < 1;
  return isNearlySure
    ? `${(Math.floor(1000 * part) / 10).toFixed(1)} %`
    : `${(100 * part).toFixed(0)} %`;
}

export function bytes(n: number): string {
  const units = ["B", "kB", "MB", "GB", "TB"];
  const power = Math.min(4, Math.max(0, Math.floor(Math.log10(Math.max(n, 1)) / 3)));
  const value = n / 1000 ** power;
  return `${value.toFixed(value < 10 && power > 0 ? 1 : 0)} ${units[power]}`;
}

/** Time of day of a stamp; seconds where the sensor's clock does not count from 1970. */
export function time(stampNs: Int64): string {
  const ns = BigInt(stampNs);
  if (ns < 1_000_000_000_000_000_000n) {
    return `${(Number(ns) / 1e9).toFixed(1)} s`;
  }
  const ms = Number(ns / 1_000_000n);
  const day = new Date(ms);
  const tenth = Math.floor((ms % 1000) / 100);
  return `${day.toLocaleTimeString("en-GB")}.${tenth}`;
}

/** A stamp with all of its digits. */
export function exact(stampNs: Int64): string {
  return `${BigInt(stampNs)} ns`;
}

/** A span of time in words as short as they get. */
export function span(s: number): string {
  const size = Math.abs(s);
  if (size < 99.5) {
    return `${size.toFixed(size < 10 ? 1 : 0)} s`;
  }
  const minutes = Math.floor(size / 60);
  return minutes < 100
    ? `${minutes} min ${String(Math.floor(size % 60)).padStart(2, "0")}`
    : `${(size / 3600).toFixed(1)} h`;
}
