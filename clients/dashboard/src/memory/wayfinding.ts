/** What stands in the way, and the routes that agents follow. */

import type { Space } from "../service";
import type { Blockage, FollowedRoute, FollowedSummary, Vec3 } from "../wire";
import type { Cloud } from "./cloud";

/** Agents whose routes are drawn. */
const DRAWN_MAX = 16;

export class Wayfinding {
  blockages: Blockage[] = [];
  /** What is left of the routes that agents follow, by the names of the agents. */
  following = new Map<string, FollowedSummary>();
  /** Their steps, of the first ones and of those that are asked for. */
  readonly followed = new Map<string, FollowedRoute>();
  /** The agent that was chosen: its route is drawn however many others there are. */
  chosen: string | null = null;

  async read(space: Space): Promise<void> {
    this.blockages = await space.blockages();
    const summaries = await space.following();
    this.following = new Map(summaries.map((summary) => [summary.agent, summary]));
    const names = [...this.following.keys()].sort((a, b) => this.rank(a) - this.rank(b));
    const drawn = names.slice(0, DRAWN_MAX);
    for (const name of this.followed.keys()) {
      if (!drawn.includes(name)) {
        this.followed.delete(name);
      }
    }
    await Promise.all(drawn.map((name) => this.readSteps(space, name)));
  }

  private rank(name: string): number {
    return name === this.chosen ? 0 : 1;
  }

  private async readSteps(space: Space, name: string): Promise<void> {
    const route = await space.followedRoute(name).catch(() => null);
    if (route === null) {
      // It has arrived meanwhile, or somebody took the route back.
      this.following.delete(name);
      this.followed.delete(name);
    } else {
      this.followed.set(name, route);
    }
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
