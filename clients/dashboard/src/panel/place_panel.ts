/** A place: what it is, what it remembers and predicts, and who was there. */

import { conjugate, multiply, rotate } from "../grid/lattice";
import type { Agent } from "../memory/agent";
import type { Memory } from "../memory/memory";
import { Problem } from "../problem";
import type { Palette } from "../scene/palette";
import type { Place, Prediction, Route, Sequence, Vec3 } from "../wire";
import { button, CLOSE, h, say } from "./dom";
import { Facts } from "./facts";
import { deviation, exact, metres, percent, position, time } from "./format";
import { PerceptList } from "./percept_list";

/** Places that are told to come next. */
const NEXT_MAX = 4;

export interface PlaceActions {
  recall(at: Vec3): void;
  /** Asks for a route from an agent; from the one that fits best where none is named. */
  route(place: number, agent: string | null): void;
  choose(place: number): void;
  close(): void;
}

export class PlacePanel {
  readonly element = h("section", { class: "inspect place-panel" });
  private readonly name = h("h2");
  private readonly facts = new Facts();
  private readonly visitors = h("ul", { class: "visitors" });
  private readonly remembered = new PerceptList();
  private readonly forgets = h("p", { class: "soft nothing" });
  private readonly next = h("ul", { class: "next bars" });
  private readonly expectedTitle = h("h3");
  private readonly note = h("p", { class: "soft expected" });
  private readonly from = h("select", {
    class: "from",
    title: "The agent that the route begins at",
    attributes: { "aria-label": "route from" },
  });
  private readonly way = h("p", { class: "soft way" });
  private here: Vec3 | null = null;
  private id = 0;

  constructor(private readonly actions: PlaceActions) {
    const ask = button(
      "Recall from here",
      "Ask which places answer at this position (R)",
      () => this.here !== null && actions.recall(this.here),
    );
    const route = button(
      "Route here",
      "The shortest route over the team's ways, from the agent beside",
      () => actions.route(this.id, this.from.value || null),
    );
    this.from.addEventListener("change", () => actions.route(this.id, this.from.value || null));
    this.element.append(
      h(
        "header",
        {},
        h("span", { class: "mark place" }),
        this.name,
        button("", "Close", () => actions.close(), CLOSE),
      ),
      h(
        "div",
        { class: "actions" },
        ask,
        h("span", { class: "start" }, route, h("span", { class: "soft" }, "from"), this.from),
      ),
      this.way,
      this.facts.element,
      h("h3", {}, "What it remembers"),
      this.remembered.element,
      this.forgets,
      this.expectedTitle,
      this.note,
      h("h3", {}, "Where the team went on to"),
      this.next,
      h("h3", {}, "Who was there"),
      this.visitors,
    );
  }

  /** Says what a route to the place is like, or why there is none. */
  set route(text: string) {
    say(this.way, text);
  }

  /** The agents that a route may begin at, and the one that is proposed. */
  propose(agents: string[], agent: string | null): void {
    const options = agents.map((name) => h("option", { attributes: { value: name } }, name));
    this.from.replaceChildren(...options);
    this.from.disabled = agents.length === 0;
    this.from.value = agent ?? agents[0] ?? "";
  }

  draw(palette: Palette): void {
    this.remembered.draw(palette);
  }

  /** Asks for a place: what it remembers and predicts, and who was there. */
  async show(id: number, memory: Memory, palette: Palette, isWanted: () => boolean): Promise<void> {
    say(this.name, `Place ${id}`);
    [this.id, this.route] = [id, ""];
    [this.note, this.expectedTitle, this.forgets].forEach((element) => say(element, ""));
    [this.next, this.visitors].forEach((element) => element.replaceChildren());
    this.remembered.show([], palette);
    try {
      const { space } = memory;
      const asked = [space.place(id), space.percepts(id)] as const;
      const [place, percepts] = await Promise.all(asked);
      if (!isWanted()) {
        return;
      }
      this.here = place.translation_m;
      this.showFacts(place);
      this.remembered.show(percepts, palette);
      say(this.forgets, percepts.length === 0 ? "Nothing was felt or seen here." : "");
      this.showVisitors(place, memory);
      const next = await space.next(id, NEXT_MAX);
      if (isWanted()) {
        this.showNext(next);
      }
      const agent = nearest(memory, place.translation_m);
      if (agent !== null) {
        const predicted = await predictAt(place, memory, agent);
        if (isWanted()) {
          this.showPrediction(agent, place, predicted);
        }
      }
    } catch (error) {
      if (isWanted()) {
        say(this.note, Problem.from(error).message);
      }
    }
  }

  /** The places that came next on the trips through here, as bars. */
  private showNext({ next, others, none }: Sequence): void {
    const rows = next.map(({ place, probability }) => ({
      what: button(`Place ${place}`, `Look at place ${place}`, () => this.actions.choose(place)),
      part: probability,
    }));
    const rest = [
      { what: h("span", {}, "other places"), part: others },
      { what: h("span", { title: "Nobody went on from here" }, "nowhere yet"), part: none },
    ].filter(({ part }) => part >= 0.005);
    const made = [...rows, ...rest].map(({ what, part }) => {
      const bar = h("i");
      bar.style.width = `${100 * part}%`;
      what.classList.add("what");
      const number = h("span", { class: "number" }, percent(part));
      return h("li", {}, what, h("span", { class: "bar" }, bar), number);
    });
    this.next.replaceChildren(...made);
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
    if (place === null) {
      say(this.note, `Nothing that is sure: no place would answer after the ${metres(way)} there.`);
      return;
    }
    const expected = percepts.map(({ channel, expected: { level } }) =>
      level === undefined
        ? `the view that it has of ${channel}`
        : `${channel} ${level.mean.toPrecision(3)}`,
    );
    const what = expected.length === 0 ? "Nothing that is remembered" : expected.join(", ");
    const which = place === there.id ? "this place" : `place ${place}`;
    say(
      this.note,
      `${what}. After the ${metres(way)} there, ${which} would answer with ${percent(confidence)}.`,
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
