/** Trips: the latest ones are asked for once, and events tell how they go on. */

import type { Int64 } from "../json";
import type { Space } from "../service";
import type { Leg, Trip } from "../wire";
import type { Clock } from "./clock";

/** Legs that are asked for when the page opens: those of the latest trips. */
const LEGS_MAX = 6000;

/** A trip: what the service said of it, and what events have added since. */
export interface ShownTrip {
  trip: Trip;
  legs: Pick<Leg, "from" | "to" | "duration_s">[];
}

/** How far a trip has come: where its latest leg ended, and when [s]. */
interface Progress {
  trip: number;
  place: number | null;
  s: number;
}

export class TripLog {
  readonly trips = new Map<number, ShownTrip>();
  private readonly underWay = new Map<string, Progress>();

  constructor(private readonly clock: Clock) {}

  /** Reads the trips that were under way at or after a stamp, the latest first. */
  async read(space: Space, sinceNs: Int64 | undefined, changed: () => void): Promise<void> {
    const listed = (await space.trips(sinceNs)).reverse();
    let n = 0;
    for (const trip of listed) {
      n += trip.leg_count;
      if (n > LEGS_MAX) {
        break;
      }
      if (!this.trips.has(trip.id)) {
        this.trips.set(trip.id, { trip, legs: await space.legs(trip.id) });
        changed();
      }
    }
  }

  start(id: number, agent: string, stampNs: Int64): void {
    const trip: Trip = {
      id,
      agent,
      start_stamp_ns: stampNs,
      end_stamp_ns: stampNs,
      ended: null,
      leg_count: 0,
      length_m: 0,
      strength: 1,
      pinned: false,
    };
    this.trips.set(id, { trip, legs: [] });
    this.underWay.set(agent, { trip: id, place: null, s: this.clock.seconds(stampNs) });
  }

  /** An agent came to a place: a leg ends there if it was at another one before. */
  extend(agent: string, place: number, s: number): void {
    const running = this.underWay.get(agent) ?? this.latest(agent);
    if (running === null) {
      return;
    }
    if (running.place !== null && running.place !== place) {
      const duration_s = Math.max(0, s - running.s);
      this.trips.get(running.trip)?.legs.push({ from: running.place, to: place, duration_s });
    }
    this.underWay.set(agent, { trip: running.trip, place, s });
  }

  /** Events were missed: no leg joins what is on either side. */
  interrupt(): void {
    this.underWay.clear();
  }

  /** The trip that an agent was on when the page was opened. */
  private latest(agent: string): Progress | null {
    let latest: ShownTrip | null = null;
    for (const shown of this.trips.values()) {
      const isOwn = shown.trip.agent === agent && shown.trip.ended === null;
      if (isOwn && (latest === null || shown.trip.id > latest.trip.id)) {
        latest = shown;
      }
    }
    if (latest === null) {
      return null;
    }
    const s = this.clock.seconds(latest.trip.end_stamp_ns);
    return { trip: latest.trip.id, place: latest.legs.at(-1)?.to ?? null, s };
  }
}
