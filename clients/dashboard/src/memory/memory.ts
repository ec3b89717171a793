/** What the page knows of a space: the live stream, and what it asks for beside that. */

import type { Int64 } from "../json";
import type { Connection } from "../stream";
import { LiveStream } from "../stream";
import { Problem } from "../problem";
import type { Space } from "../service";
import type {
  Channel,
  Counts,
  EventRecord,
  Health,
  Landmark,
  LiveSighting,
  ObjectSummary,
  Tick,
} from "../wire";
import { Agent } from "./agent";
import { Clock } from "./clock";
import { Cloud } from "./cloud";
import { Spans } from "./spans";
import { TripLog } from "./trip_log";
import { Wayfinding } from "./wayfinding";

const BY_NAME = new Intl.Collator("en", { numeric: true }).compare;
/** Ticks a second: estimates come in groups of some tens of milliseconds. */
const RATE_HZ = 10;
/** How much of the past is asked for when the page opens [s], and pages of it for one agent. */
const PAST_S = 600;
const PAST_PAGES_MAX = 8;
/** Poses of the past that are closer than this are left out [s]. */
const PAST_STEP_S = 0.08;
/** Agents whose past is asked for. */
const PAST_AGENTS_MAX = 64;
/** Events that the page keeps. */
const EVENTS_MAX = 1500;
/** How often it asks for what ticks leave out [ms]. */
const REFRESH_MS = 2000;
const TOUCH_MS = 400;
/** How often it asks what was learned of the channels [ms]. */
const CHANNELS_MS = 10_000;
/** Agents whose episodes are asked for at a time: judging one takes the service milliseconds. */
const TOUCHING_MAX = 4;

/** What only agents do whose place in the map is known. */
const LEAVES_TRACE = new Set(["place_recruited", "place_entered", "trip_started"]);

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
  recounted(): void;
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
  readonly trips = new TripLog(this.clock);
  landmarks: Landmark[] = [];
  objects: ObjectSummary[] = [];
  channels: Channel[] = [];
  readonly wayfinding = new Wayfinding();
  readonly events: ShownEvent[] = [];
  counts: Counts = { agents: 0, places: 0, trips: 0, landmarks: 0, objects: 0 };
  health: Health | null = null;
  revision: Int64 = 0;
  lagged = 0;
  connection: Connection = { state: "connecting" };
  /** Whether the places were read at least once. */
  isLoaded = false;
  private readonly spans = new Spans();

  private readonly stream: LiveStream;
  private readonly timers: number[];
  private cloudRevision: bigint | null = null;
  private seenCounts = "";
  private channelsMs = -Infinity;
  /** Which colour is whose; a name that comes back has its own again. */
  private readonly colours = new Map<string, number>();
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
        this.trips.interrupt();
        // What happened while there was no connection is asked for.
        for (const agent of this.agents.values()) {
          void this.readPast(agent, agent.track.time(agent.track.n - 1));
        }
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

  /** Earliest stamp of the clock that is shown, on the view's clock [s]. */
  get begin(): number {
    return this.spans.begin;
  }

  /** Latest stamp of it [s]. */
  get end(): number {
    return this.spans.end;
  }

  /** Names of the agents, those with numbers in the order of these. */
  agentNames(): string[] {
    return [...this.agents.keys()].sort(BY_NAME);
  }

  /** Reads an agent's past by all that has been seen since. */
  async refine(name: string): Promise<void> {
    const agent = this.agents.get(name);
    const begin = agent?.track.n ? agent.track.time(0) : 0;
    const poses = await this.past(name, "refined", begin);
    if (agent !== undefined) {
      agent.refined = new Agent(agent.colour, agent.live).track;
      agent.refined.merge(poses);
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
        agent = new Agent(this.colourOf(live.name), live);
        this.agents.set(live.name, agent);
        if (this.agents.size <= PAST_AGENTS_MAX) {
          void this.readPast(agent, s - PAST_S);
        }
      }
      agent.hear(live, began);
      agent.track.push(s, live.translation_m, live.rotation_xyzw);
      this.spans.hear(s, began);
    }
    tick.removed.forEach((name) => this.agents.delete(name));
    if (tick.missed !== null) {
      this.trips.interrupt();
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

  private colourOf(name: string): number {
    const colour = this.colours.get(name) ?? this.colours.size;
    this.colours.set(name, colour);
    return colour;
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
    // All of them, in their order: what began before is told by those that were known already.
    for (const { kind, event, s } of earlier) {
      this.follow(kind, event.agent, s);
    }
    this.listener.recounted();
  }

  /** What an event says of the map is shown at once; the next reading of the map makes it exact. */
  private remember({ kind, fields, s, event }: ShownEvent): void {
    const place = fields["place"] as number;
    if (kind === "place_recruited") {
      this.cloud.recruit(place, fields["translation_m"] as never, s);
    } else if (kind === "place_forgotten") {
      this.cloud.forget(place);
    } else if (kind === "trip_started") {
      this.trips.start(fields["trip"] as number, event.agent, event.stamp_ns);
    }
    this.follow(kind, event.agent, s);
    if (kind === "place_recruited" || kind === "place_entered") {
      this.trips.extend(event.agent, place, s);
    }
  }

  /** Notes since when it is known where an agent is. */
  private follow(kind: string, name: string, s: number): void {
    const agent = this.agents.get(name);
    if (kind === "session_started") {
      agent?.begin(s);
    } else if (kind === "agent_placed") {
      agent?.place(s);
    } else if (LEAVES_TRACE.has(kind)) {
      agent?.leaveTrace();
    }
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
        await this.wayfinding.read(this.space);
        await this.readChannels();
      }
      if (!this.hasTrips) {
        this.hasTrips = true;
        void this.readTrips();
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

  private async readChannels(): Promise<void> {
    if (performance.now() - this.channelsMs > CHANNELS_MS) {
      this.channelsMs = performance.now();
      this.channels = await this.space.channels();
    }
  }

  private async readTrips(): Promise<void> {
    const since = Number.isFinite(this.end) ? this.clock.stamp(this.end - PAST_S) : undefined;
    try {
      await this.trips.read(this.space, since, () => this.listener.refreshed());
    } catch {
      this.hasTrips = false;
    }
  }

  private async readPast(agent: Agent, fromS: number): Promise<void> {
    try {
      const poses = await this.past(agent.name, "causal", fromS);
      agent.track.merge(poses);
      if (poses[0] !== undefined) {
        this.spans.note(poses[0].s);
      }
      this.listener.refreshed();
    } catch (error) {
      console.debug("cogmap: no past of", agent.name, Problem.from(error).message);
    }
  }

  private async past(
    name: string,
    kind: "causal" | "refined",
    fromS: number,
  ): Promise<Parameters<Agent["track"]["merge"]>[0]> {
    const poses: Parameters<Agent["track"]["merge"]>[0] = [];
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

  /** Asks what an agent touches, or touched last. */
  async askTouch(agent: Agent): Promise<void> {
    agent.touch = await this.space.agentObject(agent.name).catch(() => null);
    // Contacts of an episode that has ended stay in sight until the next one begins.
    if (agent.touch?.episode) {
      agent.contacts = agent.touch.contacts;
    }
  }

  /** Asks what the episodes with objects say, and once more when they have ended. */
  private async askTouches(): Promise<void> {
    const agents = [...this.agents.values()];
    const touching = agents.filter(({ live }) => live.contacts !== null).slice(0, TOUCHING_MAX);
    const ended = agents.filter(({ live, touch }) => live.contacts === null && touch?.episode);
    await Promise.all([...touching, ...ended].map((agent) => this.askTouch(agent)));
  }
}
