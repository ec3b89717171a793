/** A place: what it is, who was there, and what an agent would feel there. */

import { conjugate, multiply, rotate } from "../grid/lattice";
import type { Agent } from "../memory/agent";
import type { Memory } from "../memory/memory";
import { Problem } from "../problem";
import type { Place, Prediction, Route, Vec3 } from "../wire";
import { button, CLOSE, h, say } from "./dom";
import { Facts } from "./facts";
import { deviation, exact, metres, percent, position, time } from "./format";

export interface PlaceActions {
  recall(at: Vec3): void;
  route(place: number): void;
  close(): void;
}

export class PlacePanel {
  readonly element = h("section", { class: "inspect place-panel" });
  private readonly name = h("h2");
  private readonly facts = new Facts();
  private readonly visitors = h("ul", { class: "visitors" });
  private readonly expected = h("ul", { class: "percepts" });
  private readonly expectedTitle = h("h3");
  private readonly note = h("p", { class: "soft" });

  private readonly way = h("p", { class: "soft way" });
  private here: Vec3 | null = null;
  private id = 0;

  constructor(actions: PlaceActions) {
    const ask = button(
      "Recall from here",
      "Ask which places answer at this position (R)",
      () => this.here !== null && actions.recall(this.here),
    );
    const route = button(
      "Route here",
      "The shortest route over the team's ways, from the agent that was chosen last",
      () => actions.route(this.id),
    );
    this.element.append(
      h(
        "header",
        {},
        h("span", { class: "mark place" }),
        this.name,
        button("", "Close", () => actions.close(), CLOSE),
      ),
      h("div", { class: "actions" }, ask, route),
      this.way,
      this.facts.element,
      h("h3", {}, "Who was there"),
      this.visitors,
      this.expectedTitle,
      this.expected,
      this.note,
    );
  }

  /** Says what a route to the place is like, or why there is none. */
  set route(text: string) {
    say(this.way, text);
  }

  /** Asks for a place, and what the agent that is nearest would feel there. */
  async show(id: number, memory: Memory, isWanted: () => boolean): Promise<void> {
    say(this.name, `Place ${id}`);
    [this.id, this.route] = [id, ""];
    try {
      const place = await memory.space.place(id);
      if (!isWanted()) {
        return;
      }
      this.here = place.translation_m;
      this.showFacts(place);
      this.showVisitors(place, memory);
      const agent = nearest(memory, place.translation_m);
      if (agent !== null) {
        this.showPrediction(agent, place, await predictAt(place, memory, agent));
      }
    } catch (error) {
      if (isWanted()) {
        say(this.note, Problem.from(error).message);
      }
    }
  }

  private showFacts(place: Place): void {
    const facts = this.facts;
    facts.set("position", `${position(place.translation_m)} m`, "x, y, z in map");
    facts.set(
      "sure to",
      `±${deviation(Math.max(...place.position_sd_m))}`,
      "Standard deviation of the position at the founding, along the worst axis",
    );
    facts.set("visits", String(place.visits), "Times an agent came here, the founding included");
    facts.set(
      "strength",
      place.strength.toFixed(2),
      "The founding and each visit count one, and half as much after every half-life",
    );
    facts.set(
      "founded",
      `${time(place.first_stamp_ns)} by ${place.founder}`,
      exact(place.first_stamp_ns),
    );
    facts.set("last visit", time(place.last_stamp_ns), exact(place.last_stamp_ns));
  }

  /** The founder, and the agents whose trips go through here. */
  private showVisitors(place: Place, memory: Memory): void {
    const passes = new Map<string, number>();
    for (const { trip, legs } of memory.trips.trips.values()) {
      const n =
        legs.filter((leg) => leg.to === place.id).length + (legs[0]?.from === place.id ? 1 : 0);
      if (n > 0) {
        passes.set(trip.agent, (passes.get(trip.agent) ?? 0) + n);
      }
    }
    const rows = [...passes]
      .sort((a, b) => b[1] - a[1])
      .map(([name, n]) =>
        h(
          "li",
          {},
          h("b", {}, name),
          ` passed ${n === 1 ? "once" : `${n} times`}` +
            (name === place.founder ? ", founded it" : ""),
        ),
      );
    if (!passes.has(place.founder)) {
      rows.unshift(h("li", {}, h("b", {}, place.founder), " founded it"));
    }
    this.visitors.replaceChildren(...rows);
  }

  private showPrediction(
    agent: Agent,
    there: Place,
    { place, confidence, percepts }: Prediction,
  ): void {
    const from = agent.live.translation_m;
    const way = Math.hypot(...there.translation_m.map((x, i) => x - from[i]!));
    say(this.expectedTitle, `What ${agent.name} would feel there`);
    this.expected.replaceChildren(
      ...percepts.map(({ channel, expected, percepts: n }) => {
        const level = expected.level;
        const what =
          level === undefined
            ? `a view of ${expected.descriptor?.vector.length ?? 0} numbers`
            : `${level.mean.toPrecision(3)} ± ${level.sd.toPrecision(2)}`;
        return h("li", { title: `Learned from ${n} percepts` }, h("b", {}, channel), ` ${what}`);
      }),
    );
    const answers =
      place === null
        ? "No place would answer after the way there."
        : `Place ${place} would answer, with a confidence of ${percent(confidence)} after the ` +
          `noise of the ${metres(way)} there.`;
    say(
      this.note,
      percepts.length > 0 ? answers : `${answers} Nothing was felt here that is remembered.`,
    );
  }
}

/** The agent that has the shortest way to a position, of those that know where they are. */
export function nearest(memory: Memory, at: Vec3): Agent | null {
  let found: Agent | null = null;
  let least = Infinity;
  for (const agent of memory.agents.values()) {
    const way = Math.hypot(...agent.live.translation_m.map((x, i) => x - at[i]!));
    if (agent.live.status !== "lost" && way < least) {
      [found, least] = [agent, way];
    }
  }
  return found;
}

/** What an agent would feel if it moved straight to a place. */
async function predictAt(place: Place, memory: Memory, agent: Agent): Promise<Prediction> {
  const { translation_m: from, rotation_xyzw: turned } = agent.live;
  const away = place.translation_m.map((x, i) => x - from[i]!) as Vec3;
  const back = conjugate(turned);
  return memory.space.predict(agent.name, rotate(back, away), multiply(back, turned));
}

/** A route in a few words. */
export function routeInWords(agent: string, { length_m, duration_s, sd_m }: Route): string {
  const length = `${metres(length_m)} from ${agent}`;
  return `${length}, some ${Math.round(duration_s)} s, sure to ±${deviation(sd_m)} at its end.`;
}
