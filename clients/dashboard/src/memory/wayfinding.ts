/** What stands in the way, and the routes that agents follow. */

import type { Space } from "../service";
import type { Blockage, FollowedRoute, Vec3 } from "../wire";
import type { Cloud } from "./cloud";

/** Agents whose routes are asked for at a time. */
const FOLLOWING_MAX = 16;

export class Wayfinding {
  blockages: Blockage[] = [];
  /** What is left of the routes that agents follow, by their names. */
  readonly followed = new Map<string, FollowedRoute>();
  /** The agents that follow a route, by what happened: others are not asked for one. */
  private readonly following = new Set<string>();

  note(kind: string, agent: string): void {
    if (kind === "route_progress" || kind === "route_left") {
      this.following.add(agent);
    } else if (["route_done", "route_failed", "agent_removed", "session_started"].includes(kind)) {
      this.following.delete(agent);
      this.followed.delete(agent);
    }
  }

  async read(space: Space): Promise<void> {
    this.blockages = await space.blockages();
    const names = [...this.following].slice(0, FOLLOWING_MAX);
    const read = async (name: string): Promise<void> => {
      const route = await space.followedRoute(name).catch(() => null);
      if (route === null || !this.following.has(name)) {
        // Somebody took it back.
        this.following.delete(name);
        this.followed.delete(name);
      } else {
        this.followed.set(name, route);
      }
    };
    await Promise.all(names.map(read));
  }
}

/** Where a blockage is; null where its places are not known. */
export function blockedAt({ place, from, to, at_m }: Blockage, cloud: Cloud): Vec3 | null {
  if (place !== null) {
    return cloud.positionOf(place);
  }
  if (from === null || to === null) {
    return at_m;
  }
  const ends = [cloud.positionOf(from), cloud.positionOf(to)] as const;
  if (ends[0] === null || ends[1] === null) {
    return null;
  }
  return ends[0].map((x, i) => (x + ends[1]![i]!) / 2) as Vec3;
}
