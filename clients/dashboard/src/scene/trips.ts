/** Trips as lines from place to place, in one draw call. */

import type { Cloud } from "../memory/cloud";
import type { Clock } from "../memory/clock";
import type { ShownTrip } from "../memory/trip_log";
import { Lines, LineWriter } from "./lines";
import { rgb, type Palette } from "./palette";

/** Most legs that are drawn: those of the latest trips. */
const LEGS_MAX = 20_000;

export class Trips {
  readonly lines = new Lines();

  /** Draws all trips anew. A leg is there once it was travelled. */
  update(trips: Iterable<ShownTrip>, cloud: Cloud, clock: Clock, palette: Palette): void {
    const latest = [...trips].sort((a, b) => b.trip.id - a.trip.id);
    const total = latest.reduce((sum, { legs }) => sum + legs.length, 0);
    this.lines.reserve(Math.min(total, LEGS_MAX) + 1);
    const writer = new LineWriter(this.lines);
    const colour = rgb(palette.trip);
    for (const { trip, legs } of latest) {
      let s = clock.seconds(trip.start_stamp_ns);
      for (const leg of legs) {
        s += leg.duration_s;
        const from = cloud.positionOf(leg.from);
        const to = cloud.positionOf(leg.to);
        if (from !== null && to !== null && writer.n < LEGS_MAX) {
          writer.add(from, to, colour, palette.shade === "dark" ? 0.3 : 0.34, 1, s);
        }
      }
    }
    writer.finish();
  }
}
