/** The agents of the space: shape, name, status, how sure, how far behind. */

import type { Agent } from "../memory/agent";
import type { Memory } from "../memory/memory";
import { agentColour, type Palette } from "../scene/palette";
import { h, say } from "./dom";
import { deviation, span } from "./format";
import { glyph } from "./status";

/** Rows that are made; with more agents the rest is counted. */
const ROWS_MAX = 200;
/** From this long on it is said that nothing has come of an agent [s]. */
const SILENT_S = 10;

interface Row {
  element: HTMLButtonElement;
  mark: HTMLElement;
  sd: HTMLElement;
  note: HTMLElement;
  drawn: string;
}

export class AgentList {
  readonly element = h("ul", { class: "agents" });
  private readonly rows = new Map<string, Row>();
  private readonly rest = h("li", { class: "soft rest" });

  constructor(private readonly choose: (name: string) => void) {}

  update(memory: Memory, palette: Palette, selected: string | null, followed: string | null): void {
    const names = memory.agentNames();
    const shown = names.slice(0, ROWS_MAX);
    for (const [name, row] of this.rows) {
      if (!shown.includes(name)) {
        row.element.parentElement?.remove();
        this.rows.delete(name);
      }
    }
    shown.forEach((name, i) => {
      const row = this.rows.get(name) ?? this.make(name);
      const item = row.element.parentElement!;
      if (this.element.children[i] !== item) {
        this.element.insertBefore(item, this.element.children[i] ?? null);
      }
      this.fill(row, memory.agents.get(name)!, palette);
      row.element.classList.toggle("selected", name === selected);
      row.element.classList.toggle("followed", name === followed);
      row.element.setAttribute("aria-pressed", String(name === selected));
    });
    const more = names.length - shown.length;
    say(this.rest, more > 0 ? `and ${more} more` : "");
    this.rest.hidden = more <= 0;
    this.element.append(this.rest);
  }

  private make(name: string): Row {
    const mark = h("span", { class: "mark" });
    const sd = h("span", { class: "number" });
    const note = h("span", { class: "note" });
    const attributes = { type: "button", "data-agent": name };
    const element = h(
      "button",
      { class: "agent", attributes, on: { click: () => this.choose(name) } },
      mark,
      h("span", { class: "name" }, name),
      note,
      sd,
    );
    this.element.append(h("li", {}, element));
    const row = { element, mark, sd, note, drawn: "" };
    this.rows.set(name, row);
    return row;
  }

  private fill(row: Row, agent: Agent, palette: Palette): void {
    const { status, contacts } = agent.live;
    const colour = agentColour(palette, agent.colour);
    const drawn = `${status}${colour}`;
    if (row.drawn !== drawn) {
      row.drawn = drawn;
      row.mark.replaceChildren(glyph(status, colour));
      row.element.dataset["status"] = status;
    }
    const best = agent.touch?.identification?.objects[0];
    const touching = contacts === null ? "" : best === undefined ? "touching" : best.name;
    say(row.note, status === "localized" ? touching : status);
    row.note.className = `note ${status}`;
    // Where it woke up is sure in its own frame alone: that says nothing of the map.
    const sd = agent.isPlaced ? `±${deviation(agent.positionSdM)}` : "";
    const absent = absence(agent);
    say(row.sd, absent || sd);
    row.sd.title = absent || "Standard deviation of the position, over all axes";
    row.element.title = agent.isPlaced ? "" : "Not in the map yet: it is not drawn";
  }
}

/** Whether its session has ended, or for how long nothing has come of it. */
function absence(agent: Agent): string {
  if (agent.live.session_ended) {
    return "ended";
  }
  const silentS = agent.silentS(performance.now());
  return silentS === null || silentS < SILENT_S ? "" : `silent ${span(silentS)}`;
}
