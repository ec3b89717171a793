/** Figures of the page, for tests and for who is curious. */

import type { App } from "./app";
import type { Vec3 } from "./wire";

export function figures(app: App) {
  return {
    stats: () => {
      const { stage, memory } = app;
      return {
        connection: memory?.connection.state ?? "none",
        space: memory?.space.name ?? null,
        revision: String(memory?.revision ?? 0),
        agents: memory?.agents.size ?? 0,
        places: memory?.cloud.n ?? 0,
        landmarks: memory?.landmarks.length ?? 0,
        trips: memory?.trips.trips.size ?? 0,
        frames: stage.frames.n,
        scriptMs: stage.frames.figures,
        drawCalls: stage.drawCalls,
        selected: stage.focus.selected,
        recalled: stage.focus.recalled?.places.map(({ place }) => place.id) ?? null,
        routeSteps: stage.focus.route?.steps.length ?? null,
        following: [...(memory?.wayfinding.followed.keys() ?? [])],
        blockages: memory?.wayfinding.blockages.length ?? 0,
        time: stage.focus.time,
        view: stage.view,
      };
    },
    /** The object that a model is drawn of, and the contacts on it, in its frame [m]. */
    felt: () => app.felt,
    /** Where a position of `map` lies in the window [px]; null behind the eye. */
    onScreen: (at: Vec3) => app.stage.onScreen(at),
    agent: (name: string) => app.stage.positionOf(name),
    place: (id: number) => app.memory?.cloud.positionOf(id) ?? null,
    /** Forgets the times of earlier frames. */
    restart: () => app.stage.frames.forget(),
  };
}
