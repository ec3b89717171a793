/** An object that the team has learned: its model, and what taught it. */

import type { Memory } from "../memory/memory";
import { Problem } from "../problem";
import type { Palette } from "../scene/palette";
import type { ObjectDetail } from "../wire";
import { button, CLOSE, h, say } from "./dom";
import { Facts } from "./facts";
import { count, deviation } from "./format";
import { drawModel } from "./object_model";

export class ObjectPanel {
  readonly element = h("section", { class: "inspect object-panel" });
  private readonly name = h("h2");
  private readonly model = h("canvas", { class: "model" });
  private readonly facts = new Facts();
  private readonly note = h("p", { class: "soft" });
  private detail: ObjectDetail | null = null;

  /** @param close - Called to let go. */
  constructor(close: () => void) {
    this.element.append(
      h(
        "header",
        {},
        h("span", { class: "mark object" }),
        this.name,
        button("", "Close", close, CLOSE),
      ),
      this.model,
      this.facts.element,
      this.note,
    );
  }

  /** Asks for an object. */
  async show(name: string, memory: Memory): Promise<void> {
    say(this.name, name);
    try {
      const detail = await memory.space.object(name);
      this.detail = detail;
      this.fill(detail);
      say(this.note, "Points are its places, coloured by what was felt there.");
    } catch (error) {
      this.detail = null;
      say(this.note, Problem.from(error).message);
    }
  }

  draw(palette: Palette): void {
    if (this.detail !== null) {
      const felt = { model: this.detail, contacts: [], nextTouch: null, colour: palette.label };
      drawModel(this.model, felt, palette);
    }
  }

  private fill({ summary, places }: ObjectDetail): void {
    const size = summary.max_m.map((high, axis) => deviation(high - summary.min_m[axis]!));
    this.facts.set("size", size.join(" × "), "Along the axes of its own frame");
    this.facts.set("places", count(summary.places));
    this.facts.set(
      "spacing",
      deviation(summary.spacing_m),
      "Contacts within this are of one place",
    );
    this.facts.set(
      "taught by",
      `${count(summary.contacts)} contacts, ${count(summary.visits)} visits`,
    );
    const channels = new Set(places.flatMap(({ levels }) => levels.map(({ channel }) => channel)));
    this.facts.set("felt", channels.size === 0 ? null : [...channels].join(", "));
  }
}
