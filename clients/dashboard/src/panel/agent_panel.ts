/** An agent: where it is and how sure that is, its grid cells, what it touches. */

import type { Agent } from "../memory/agent";
import type { Memory } from "../memory/memory";
import { agentColour, type Palette } from "../scene/palette";
import type { AgentDetail, FollowedSummary } from "../wire";
import { button, CLOSE, h, say } from "./dom";
import { Facts } from "./facts";
import { count, degrees, deviation, exact, metres, percent, position, span, time } from "./format";
import { GridPanel } from "./grid_panel";
import { badge, glyph } from "./status";
import { TouchPanel } from "./touch_panel";

const FOLLOW =
  "M10 3 V7 M10 13 V17 M3 10 H7 M13 10 H17 M10 8.5 A1.5 1.5 0 1 0 10 11.5 A1.5 1.5 0 1 0 10 8.5";
const REFINE = "M3 14 C6 4 9 17 12 8 S16 6 17 5";

export interface AgentActions {
  follow(): void;
  refine(): void;
  chooseModule(module: number): void;
  close(): void;
}

/** What is shown of the agent elsewhere on the page. */
export interface ShownAgent {
  isFollowed: boolean;
  module: number | null;
  isRefining: boolean;
}

export class AgentPanel {
  readonly element = h("section", { class: "inspect agent-panel" });
  readonly grid: GridPanel;
  readonly touch = new TouchPanel();
  private readonly mark = h("span", { class: "mark" });
  private readonly name = h("h2");
  private readonly status = h("span");
  private readonly facts = new Facts();
  private readonly follow: HTMLButtonElement;
  private readonly refine: HTMLButtonElement;
  private drawn = "";

  constructor(actions: AgentActions) {
    this.grid = new GridPanel((module) => actions.chooseModule(module));
    this.follow = button(
      "Follow",
      "Keep this agent in the middle (F)",
      () => actions.follow(),
      FOLLOW,
    );
    this.refine = button(
      "Refined trail",
      "Ask for its way by all that has been seen since, and draw it beside the causal one",
      () => actions.refine(),
      REFINE,
    );
    this.element.append(
      h("header", {}, this.mark, this.name, this.status, button("", "Close", actions.close, CLOSE)),
      h("div", { class: "actions" }, this.follow, this.refine),
      this.facts.element,
      this.touch.element,
      this.grid.element,
    );
  }

  update(
    agent: Agent,
    detail: AgentDetail | null,
    memory: Memory,
    palette: Palette,
    { isFollowed, module, isRefining }: ShownAgent,
  ): void {
    const { live } = agent;
    const colour = agentColour(palette, agent.colour);
    const drawn = `${agent.name}${live.status}${colour}`;
    if (drawn !== this.drawn) {
      this.drawn = drawn;
      this.mark.replaceChildren(glyph(live.status, colour));
      this.status.replaceChildren(badge(live.status));
      say(this.name, agent.name);
    }
    this.follow.setAttribute("aria-pressed", String(isFollowed));
    this.refine.setAttribute("aria-pressed", String(agent.refined !== null));
    this.refine.disabled = isRefining;
    const facts = this.facts;
    facts.set(
      "position",
      `${position(live.translation_m)} m`,
      agent.isPlaced ? "x, y, z in map" : "x, y, z in a frame of its own: it is not in the map yet",
    );
    const turned = degrees(Math.max(...live.rotation_sd_rad));
    facts.set(
      "sure to",
      agent.isPlaced ? `±${deviation(agent.positionSdM)}  ±${turned}` : "unknown: not in the map",
      "Standard deviation of the position, over all axes, and of the rotation about the worst one",
    );
    facts.set(
      "heading",
      degrees(agent.headingRad),
      "In the x-y plane of the same frame, against x",
    );
    facts.set(
      "place",
      live.place === null ? "none" : `${live.place} · ${percent(live.confidence)}`,
      "The place cell that answers strongest, and its confidence",
    );
    const route = memory.wayfinding.following.get(agent.name);
    facts.set(
      "route",
      route === undefined ? null : routeLeft(route),
      "What is left of the route that it follows",
    );
    facts.set("stamp", time(live.stamp_ns), exact(live.stamp_ns));
    facts.set(
      "heard",
      heard(agent),
      "When the service received its latest message; a session ends when the robot says so",
    );
    facts.set("lag", `${count(live.lag_samples)} samples`, "Received and not yet on disk");
    facts.set("travelled", detail === null ? null : metres(detail.travelled_m), "In this session");
    const evidence = detail?.evidence;
    facts.set(
      "sightings",
      evidence === undefined
        ? null
        : `${count(evidence.accepted)} used, ${count(evidence.refused)} refused`,
    );
    const ink = palette.label;
    this.touch.update(agent, memory, palette);
    this.grid.draw(colour, ink, module);
  }
}

function heard(agent: Agent): string {
  const silentS = agent.silentS(performance.now());
  const ago =
    silentS === null
      ? "not since the service started"
      : silentS < 2
        ? "just now"
        : `${span(silentS)} ago`;
  return agent.live.session_ended ? `${ago}, session ended` : ago;
}

function routeLeft({ length_m, steps_left, duration_s }: FollowedSummary): string {
  return steps_left === 0 ? "arrived" : `${metres(length_m)} left, some ${span(duration_s)}`;
}
