/** Where agents are shown: on the way to their newest pose, or at one of the past. */

import type { Agent } from "../memory/agent";
import type { TrackPose } from "../memory/track";
import type { Quat, Vec3 } from "../wire";

/** An agent goes to its newest pose within about this time [s]. */
const SMOOTHING_S = 0.09;
/** A step longer than this is a leap, and shown as one [m]. */
const LEAP_M = 2;

export class Movement {
  readonly poses = new Map<string, TrackPose>();

  /**
   * Brings agents nearer to where they are, or to where they were at a time [s]. Says whether any
   * has moved.
   */
  advance(agents: ReadonlyMap<string, Agent>, time: number | null, elapsedS: number): boolean {
    let moved = false;
    for (const name of this.poses.keys()) {
      if (!agents.has(name)) {
        moved = this.poses.delete(name);
      }
    }
    const part = 1 - Math.exp(-elapsedS / SMOOTHING_S);
    for (const [name, agent] of agents) {
      const goal = goalOf(agent, time);
      moved = (goal === null ? this.poses.delete(name) : this.approach(name, goal, part)) || moved;
    }
    return moved;
  }

  private approach(name: string, goal: TrackPose, part: number): boolean {
    const now = this.poses.get(name);
    const step = now?.position.map((x, i) => goal.position[i]! - x) ?? [Infinity];
    const length = Math.hypot(...step);
    if (now === undefined || length > LEAP_M) {
      this.poses.set(name, { position: [...goal.position], rotation: [...goal.rotation] });
      return true;
    }
    if (length < 1e-4 && areAlike(now.rotation, goal.rotation)) {
      return false;
    }
    now.position = now.position.map((x, i) => x + part * step[i]!) as Vec3;
    now.rotation = between(now.rotation, goal.rotation, part);
    return true;
  }
}

/** Where an agent is to be shown; nowhere before its first pose, and where the map has none. */
function goalOf(agent: Agent, time: number | null): TrackPose | null {
  if (time !== null) {
    return agent.track.before(time);
  }
  if (!agent.isPlaced) {
    return null;
  }
  return { position: agent.live.translation_m, rotation: agent.live.rotation_xyzw };
}

function areAlike(a: Quat, b: Quat): boolean {
  return Math.abs(dot(a, b)) > 1 - 1e-7;
}

/** A rotation on the way from one to another. */
function between(a: Quat, b: Quat, part: number): Quat {
  const sign = dot(a, b) < 0 ? -1 : 1;
  const mixed = a.map((x, i) => x + part * (sign * b[i]! - x));
  const norm = Math.hypot(...mixed);
  return mixed.map((x) => x / norm) as Quat;
}

function dot(a: Quat, b: Quat): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}
