/** An agent as the page knows it. */

import type { AgentObject, LiveAgent } from "../wire";
import { Track, type TrackPose } from "./track";

/** Poses of one episode that are kept: some minutes. */
const TOUCH_POSES_MAX = 2000;

export class Agent {
  readonly track = new Track();
  /** Its past by all that has been seen since, once somebody asked for it. */
  refined: Track | null = null;
  /** What its episode with an object says, while there is one. */
  touch: AgentObject | null = null;
  /** Poses of the body since the episode under way began; empty where that is not known. */
  touchPath: TrackPose[] = [];
  private isTouching = false;
  private wasSeenFree = false;

  constructor(
    /** Which of the colours is its own. */
    readonly colour: number,
    public live: LiveAgent,
  ) {}

  get name(): string {
    return this.live.name;
  }

  /**
   * Notes where the body is at a time [s] while it touches an object. An episode counts from where
   * the body was when it began. That is known only of a body that had been at rest: ticks do not
   * say when an episode began.
   */
  feel(s: number): void {
    const { contacts, translation_m, rotation_xyzw } = this.live;
    if (contacts === null) {
      this.isTouching = false;
      this.wasSeenFree = true;
      return;
    }
    if (!this.isTouching) {
      this.isTouching = true;
      const rest = this.wasSeenFree ? this.track.restBefore(s) : null;
      this.touchPath = rest === null ? [] : [rest];
    }
    if (this.touchPath.length > 0 && this.touchPath.length < TOUCH_POSES_MAX) {
      this.touchPath.push({ position: translation_m, rotation: rotation_xyzw });
    }
  }

  /** Standard deviation of the position along its worst axis, at most √trace [m]. */
  get positionSdM(): number {
    const c = this.live.position_covariance_m2;
    return Math.sqrt(Math.max(c[0], c[3], c[5], 0));
  }

  /** Angle of the body's x axis in the x-y plane of `map`, against x [rad]. */
  get headingRad(): number {
    const [x, y, z, w] = this.live.rotation_xyzw;
    return Math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z));
  }
}
