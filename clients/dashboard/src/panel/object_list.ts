/** The objects that the team has learned, by name. */

import type { Memory } from "../memory/memory";
import { h } from "./dom";

/** Names that are shown: those first in the alphabet. */
const NAMES_MAX = 40;

export class ObjectList {
  readonly element = h("ul", { class: "objects" });
  private drawn = "";

  constructor(private readonly choose: (name: string) => void) {}

  update(memory: Memory, chosen: string | null): void {
    const names = memory.objects.slice(0, NAMES_MAX).map(({ name }) => name);
    const drawn = JSON.stringify([names, chosen]);
    if (drawn === this.drawn) {
      return;
    }
    this.drawn = drawn;
    this.element.hidden = names.length === 0;
    this.element.replaceChildren(
      ...names.map((name) => {
        const pressed = String(name === chosen);
        const attributes = { type: "button", "data-object": name, "aria-pressed": pressed };
        const on = { click: () => this.choose(name) };
        return h("li", {}, h("button", { attributes, on }, name));
      }),
    );
  }
}
