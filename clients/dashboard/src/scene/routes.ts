/** The routes that agents follow, and the one that was asked for, in one draw call. */

import type { Memory } from "../memory/memory";
import type { TrackPose } from "../memory/track";
import type { Vec3 } from "../wire";
import type { Focus } from "./focus";
import { Lines, LineWriter } from "./lines";
import { agentColour, rgb, type Palette } from "./palette";

/** Steps that are drawn. */
const STEPS_MAX = 4096;

export class Routes {
  readonly lines = new Lines();

  /** Draws them anew; in the past there are none. */
  update(
    memory: Memory,
    focus: Focus,
    poses: ReadonlyMap<string, TrackPose>,
    palette: Palette,
  ): void {
    const routes = focus.time === null ? shown(memory, focus) : [];
    this.lines.reserve(
      Math.min(
        routes.reduce((n, { steps }) => n + steps.length, 1),
        STEPS_MAX,
      ),
    );
    const writer = new LineWriter(this.lines);
    for (const { agent, steps, isAsked } of routes) {
      let from = poses.get(agent)?.position ?? null;
      const colour = agentColour(palette, memory.agents.get(agent)?.colour ?? 0);
      const paint = rgb(isAsked ? palette.recall : colour);
      for (const to of steps) {
        if (from !== null && writer.n < STEPS_MAX) {
          writer.add(from, to, paint, 0.9, isAsked ? 2.4 : 3);
        }
        from = to;
      }
    }
    writer.finish();
  }
}

interface ShownRoute {
  agent: string;
  steps: Vec3[];
  isAsked: boolean;
}

function shown({ wayfinding }: Memory, { route }: Focus): ShownRoute[] {
  const followed = [...wayfinding.followed.values()].map(({ agent, steps }) => ({
    agent,
    steps: steps.map(({ translation_m }) => translation_m),
    isAsked: false,
  }));
  return route === null ? followed : [...followed, { ...route, isAsked: true }];
}
