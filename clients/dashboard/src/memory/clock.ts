/** Seconds since the epoch of a view: stamps are too long for the numbers of a graphics card. */

import { secondsBetween, stampAfter, type Int64 } from "../json";

export class Clock {
  private epoch: bigint | null = null;

  /** Seconds of a stamp since the epoch, which the first stamp asked for becomes. */
  seconds(stampNs: Int64): number {
    this.epoch ??= BigInt(stampNs);
    return secondsBetween(this.epoch, stampNs);
  }

  /** Seconds since the epoch of a time in Unix seconds, exact to some 0.2 µs. */
  ofUnix(unixS: number): number {
    this.epoch ??= BigInt(Math.round(unixS)) * 1_000_000_000n;
    const whole = this.epoch / 1_000_000_000n;
    return unixS - Number(whole) - Number(this.epoch % 1_000_000_000n) * 1e-9;
  }

  /** The stamp of a time of the view [ns]. */
  stamp(seconds: number): bigint {
    return stampAfter(this.epoch ?? 0n, seconds);
  }
}
