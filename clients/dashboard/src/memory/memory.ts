/** What the page knows of a space: it follows the live stream and asks for what a tick leaves out. */

import type { Int64 } from "../json";
import type { Connection } from "../stream";
import { LiveStream } from "../stream";
import { Problem } from "../problem";
import type { Space } from "../service";
import type {
  Counts, EventRecord, Health, Landmark, Leg, LiveSighting, ObjectSummary, Tick, Trip,
} from "../wire";
import { Agent } from "./agent";
import { Clock } from "./clock";
import { Cloud } from "./cloud";

/** Ticks a second: estimates come in groups of some tens of milliseconds. */
const RATE_HZ = 10;
/** How much of the past is asked for when the page opens [s], and pages of it for one agent. */
const PAST_S = 600;
const PAST_PAGES_MAX = 8;
/** Poses of the past that are closer than this are left out [s]. */
const PAST_STEP_S = 0.08;
/** Agents whose past is asked for. */
const PAST_AGENTS_MAX = 64;
/** Legs that are asked for when the page opens: those of the latest trips. */
const LEGS_MAX = 6000;
/** Events that the page keeps. */
const EVENTS_MAX = 1500;
/** How often it asks for what ticks leave out [ms]. */
const REFRESH_MS = 2000;
const TOUCH_MS = 400;

/** A trip: what the service said of it, and what events have added since. */
export interface ShownTrip {
  trip: Trip;
  legs: Leg[];
}

export interface ShownEvent extends EventRecord {
  /** Time on the view's clock [s]; 0 for events without a stamp. */
  s: number;
  kind: string;
  fields: { [field: string]: unknown };
}

export interface MemoryListener {
  connectionChanged(connection: Connection): void;
  /** A tick was taken in. */
  ticked(tick: Tick, events: ShownEvent[]): void;
  /** Events from before the page was opened were read. */
  recounted(events: ShownEvent[]): void;
  sighted(sightings: LiveSighting[]): void;
  /** Places, trips, landmarks, objects or the past of an agent were read. */
  refreshed(): void;
  /** Work was done beside the frames [ms]. */
  worked(ms: number): void;
}

export class Memory {
  readonly clock = new Clock();
  readonly agents = new Map<string, Agent>();
  readonly cloud = new Cloud(this.clock);
  readonly trips = new Map<number, ShownTrip>();
  landmarks: Landmark[] = [];
  objects: ObjectSummary[] = [];
  readonly events: ShownEvent[] = [];
  counts: Counts = { agents: 0, places: 0, trips: 0, landmarks: 0, objects: 0 };
  health: Health | null = null;
  revision: Int64 = 0;
  lagged = 0;
  connection: Connection = { state: "connecting" };
  /** Whether the places were read at least once. */
  isLoaded = false;
  /** Range of the stamps that came, on the view's clock [s]. */
  begin = Infinity;
  end = -Infinity;

  private readonly stream: LiveStream;
  private readonly timers: number[];
  private cloudRevision: bigint | null = null;
  private seenCounts = "";
  private nColours = 0;
  /** For each agent its trip, the place where its latest leg ended, and when. */
  private readonly underWay = new Map<string, { id: number; place: number | null; s: number }>();
  private isRefreshing = false;
  private hasTrips = false;
  private hasEvents = false;
  private isClosed = false;

  constructor(
    readonly space: Space,
    private readonly listener: MemoryListener,
  ) {
    this.stream = new LiveStream(space, RATE_HZ, {
      opened: () => {
        // The service may have restarted: what was read before may be of another past.
        this.cloudRevision = null;
        this.seenCounts = "";
        void this.refresh();
      },
      ticked: (tick) => this.apply(tick),
      lagged: (ticks) => (this.lagged += ticks),
      changed: (connection) => {
        this.connection = connection;
        listener.connectionChanged(connection);
      },
    });
    this.timers = [
      window.setInterval(() => void this.refresh(), REFRESH_MS),
      window.setInterval(() => void this.askTouches(), TOUCH_MS),
    ];
  }

  close(): void {
    this.isClosed = true;
    this.stream.close();
    this.timers.forEach((timer) => window.clearInterval(timer));
  }

  /** Reads an agent's past by all that has been seen since. */
  async refine(name: string): Promise<void> {
    const agent = this.agents.get(name);
    const begin = agent?.track.n ? agent.track.time(0) : 0;
    const poses = await this.past(name, "refined", begin);
    if (agent !== undefined) {
      agent.refined = new Agent(agent.colour, agent.live).track;
      agent.refined.prepend(poses);
      this.listener.refreshed();
    }
  }

  private apply(tick: Tick): void {
    const began = performance.now();
    this.revision = tick.map_revision;
    this.counts = tick.counts;
    this.health = tick.health;
    for (const live of tick.agents) {
      const s = this.clock.seconds(live.stamp_ns);
      let agent = this.agents.get(live.name);
      if (agent === undefined) {
        agent = new Agent(this.nColours, live);
        this.nColours += 1;
        this.agents.set(live.name, agent);
        if (this.agents.size <= PAST_AGENTS_MAX) {
          void this.readPast(agent, s - PAST_S);
        }
      }
      agent.live = live;
      agent.feel();
      agent.track.push(s, live.translation_m, live.rotation_xyzw);
      this.note(s);
    }
    tick.removed.forEach((name) => this.agents.delete(name));
    if (tick.missed !== null) {
      // What happened in between is not known: no leg joins what is on either side.
      this.underWay.clear();
    }
    const events = tick.events.map((record) => this.shown(record));
    for (const event of events) {
      this.remember(event);
    }
    this.events.push(...events);
    this.events.splice(0, Math.max(0, this.events.length - EVENTS_MAX));
    this.listener.ticked(tick, events);
    if (tick.sightings.length > 0) {
      this.listener.sighted(tick.sightings);
    }
    this.listener.worked(performance.now() - began);
  }

  private shown(record: EventRecord): ShownEvent {
    const [kind, fields] = Object.entries(record.event.kind)[0] ?? ["unknown", {}];
    const s = Number(record.event.stamp_ns) === 0 ? 0 : this.clock.seconds(record.event.stamp_ns);
    return { ...record, s, kind, fields };
  }

  /** The events from before the page was opened, and those that came meanwhile. */
  private async readEvents(): Promise<void> {
    const known = new Set(this.events.map(({ id }) => id));
    const earlier = (await this.space.events()).map((record) => this.shown(record));
    const fresh = earlier.filter(({ id }) => !known.has(id));
    this.events.unshift(...fresh);
    this.listener.recounted(fresh);
  }

  /** What an event says of the map is shown at once; the next reading of the map makes it exact. */
  private remember({ kind, fields, s, event }: ShownEvent): void {
    const place = fields["place"] as number;
    if (kind === "place_recruited") {
      this.cloud.recruit(place, fields["translation_m"] as never, s);
    } else if (kind === "place_forgotten") {
      this.cloud.forget(place);
    } else if (kind === "trip_started") {
      this.startTrip(fields["trip"] as number, event.agent, event.stamp_ns);
    }
    if (kind === "place_recruited" || kind === "place_entered") {
      this.extendTrip(event.agent, place, s);
    }
  }

  private startTrip(id: number, agent: string, stampNs: Int64): void {
    const trip: Trip = {
      id, agent, start_stamp_ns: stampNs, end_stamp_ns: stampNs, ended: null, leg_count: 0,
      length_m: 0, strength: 1,
    };
    this.trips.set(id, { trip, legs: [] });
    this.underWay.set(agent, { id, place: null, s: this.clock.seconds(stampNs) });
  }

  /** A leg ends where the agent comes to another place. */
  private extendTrip(agent: string, place: number, s: number): void {
    const running = this.underWay.get(agent) ?? this.latestTrip(agent);
    if (running === null) {
      return;
    }
    if (running.place !== null && running.place !== place) {
      const legs = this.trips.get(running.id)?.legs;
      legs?.push({ from: running.place, to: place, duration_s: Math.max(0, s - running.s) });
    }
    this.underWay.set(agent, { id: running.id, place, s });
  }

  /** The trip that an agent was on when the page was opened. */
  private latestTrip(agent: string): { id: number; place: number | null; s: number } | null {
    const own = [...this.trips.values()].filter(({ trip }) => trip.agent === agent && trip.ended === null);
    const latest = own.sort((a, b) => b.trip.id - a.trip.id)[0];
    if (latest === undefined) {
      return null;
    }
    const s = this.clock.seconds(latest.trip.end_stamp_ns);
    return { id: latest.trip.id, place: latest.legs.at(-1)?.to ?? null, s };
  }

  private note(s: number): void {
    this.begin = Math.min(this.begin, s);
    this.end = Math.max(this.end, s);
  }

  /** Reads what changed in the map. */
  private async refresh(): Promise<void> {
    if (this.isRefreshing || this.isClosed || this.connection.state !== "live") {
      return;
    }
    this.isRefreshing = true;
    try {
      const known = this.cloudRevision;
      if (known === null || BigInt(this.revision) !== known) {
        const file = await this.space.cloud(known ?? undefined);
        if (this.isClosed) {
          return;
        }
        const began = performance.now();
        this.cloud.apply(file);
        this.listener.worked(performance.now() - began);
        this.cloudRevision = file.revision;
        this.isLoaded = true;
        this.landmarks = await this.space.landmarks();
      }
      if (!this.hasTrips) {
        this.hasTrips = true;
        void this.readTrips().catch(() => (this.hasTrips = false));
      }
      if (!this.hasEvents) {
        this.hasEvents = true;
        await this.readEvents();
      }
      const counts = JSON.stringify(this.counts);
      if (counts !== this.seenCounts) {
        this.seenCounts = counts;
        this.objects = await this.space.objects();
      }
      this.listener.refreshed();
    } catch (error) {
      // The stream says what is wrong with the connection; the next round asks again.
      console.debug("cogmap: the map was not read:", Problem.from(error).message);
    } finally {
      this.isRefreshing = false;
    }
  }

  /** Reads the latest trips, once; events tell how they go on. */
  private async readTrips(): Promise<void> {
    const since = Number.isFinite(this.end) ? this.clock.stamp(this.end - PAST_S) : undefined;
    const listed = (await this.space.trips(since)).reverse();
    let n = 0;
    for (const trip of listed) {
      n += trip.leg_count;
      if (n > LEGS_MAX || this.isClosed) {
        break;
      }
      if (!this.trips.has(trip.id)) {
        this.trips.set(trip.id, { trip, legs: await this.space.legs(trip.id) });
        this.listener.refreshed();
      }
    }
  }

  private async readPast(agent: Agent, fromS: number): Promise<void> {
    try {
      const poses = await this.past(agent.name, "causal", fromS);
      agent.track.prepend(poses);
      if (poses[0] !== undefined) {
        this.note(poses[0].s);
      }
      this.listener.refreshed();
    } catch (error) {
      console.debug("cogmap: no past of", agent.name, Problem.from(error).message);
    }
  }

  private async past(
    name: string, kind: "causal" | "refined", fromS: number,
  ): Promise<Parameters<Agent["track"]["prepend"]>[0]> {
    const poses: Parameters<Agent["track"]["prepend"]>[0] = [];
    let from: Int64 | null = this.clock.stamp(fromS);
    for (let page = 0; page < PAST_PAGES_MAX && from !== null; page += 1) {
      const answer = await this.space.trajectory(name, kind, from);
      for (const pose of answer.poses) {
        const s = this.clock.seconds(pose.stamp_ns);
        if (s - (poses.at(-1)?.s ?? -Infinity) < PAST_STEP_S) {
          continue;
        }
        poses.push({ s, position: pose.translation_m, rotation: pose.rotation_xyzw });
      }
      from = answer.next_from_ns;
    }
    return poses;
  }

  /** Asks what the episodes with objects say. */
  private async askTouches(): Promise<void> {
    const touching = [...this.agents.values()].filter(({ live }) => live.contacts !== null);
    for (const agent of touching.slice(0, 4)) {
      try {
        agent.touch = await this.space.agentObject(agent.name);
      } catch {
        // The agent may be gone.
      }
    }
    for (const agent of this.agents.values()) {
      if (agent.live.contacts === null && agent.touch?.episode) {
        agent.touch = await this.space.agentObject(agent.name).catch(() => null);
      }
    }
  }
}
