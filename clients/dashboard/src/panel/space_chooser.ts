/** Which space is shown. */

import type { SpaceInfo } from "../wire";
import { h } from "./dom";

export class SpaceChooser {
  readonly element: HTMLSelectElement;
  private names = "";

  constructor(choose: (space: string) => void) {
    this.element = h("select", {
      class: "space",
      title: "Space",
      attributes: { "aria-label": "space" },
      on: { change: () => choose(this.element.value) },
    });
  }

  update(spaces: SpaceInfo[], shown: string | null): void {
    const names = spaces.map(({ name }) => name);
    if (shown !== null && !names.includes(shown)) {
      names.push(shown);
    }
    if (names.join("\n") !== this.names) {
      this.names = names.join("\n");
      this.element.replaceChildren(...names.map((name) => h("option", {}, name)));
    }
    this.element.value = shown ?? "";
    this.element.hidden = names.length === 0;
  }
}
