/** An agent as the page knows it. */

import type { AgentObject, Contact, LiveAgent } from "../wire";
import { Track } from "./track";

export class Agent {
  readonly track = new Track();
  /** Its past by all that has been seen since, once somebody asked for it. */
  refined: Track | null = null;
  /** What its episode with an object says, while there is one. */
  touch: AgentObject | null = null;
  /** Contacts of its latest episode that the page has seen, in the frame in which it began. */
  contacts: Contact[] = [];

  /** When its session began, until it is known where it is in `map` [s]. */
  private unplacedSinceS: number | null = null;

  /** When a message of it came, on the clock of the page; null if none has since the service
   * started [ms]. */
  private heardMs: number | null = null;

  constructor(
    /** Which of the colours is its own. */
    readonly colour: number,
    public live: LiveAgent,
  ) {}

  get name(): string {
    return this.live.name;
  }

  /** A tick that came at `nowMs` tells where it is. */
  hear(live: LiveAgent, nowMs: number): void {
    this.live = live;
    this.heardMs = live.heard_ago_s === null ? null : nowMs - 1000 * live.heard_ago_s;
  }

  /** For how long nothing has come of it; null if nothing has since the service started [s]. */
  silentS(nowMs: number): number | null {
    return this.heardMs === null ? null : Math.max(nowMs - this.heardMs, 0) / 1000;
  }

  /** A session began: until the agent is placed, its poses are counted from where it woke up. */
  begin(s: number): void {
    this.unplacedSinceS = s;
  }

  /** The agent has left a trace in the map, so it is known where it is. */
  leaveTrace(): void {
    this.unplacedSinceS = null;
  }

  /** It became known where the agent is. */
  place(s: number): void {
    if (this.unplacedSinceS !== null) {
      this.track.hide(this.unplacedSinceS, s);
      this.unplacedSinceS = null;
    }
    this.track.part(s);
  }

  /** Whether its pose is one in the map, and not where it has gone since it woke up somewhere. */
  get isPlaced(): boolean {
    return this.live.frame === "map";
  }

  /** Standard deviation of the position, over all axes: the status goes by it [m]. */
  get positionSdM(): number {
    const c = this.live.position_covariance_m2;
    return Math.sqrt(Math.max(c[0] + c[3] + c[5], 0));
  }

  /** Angle of the body's x axis in the x-y plane of its frame, against x [rad]. */
  get headingRad(): number {
    const [x, y, z, w] = this.live.rotation_xyzw;
    return Math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z));
  }
}
