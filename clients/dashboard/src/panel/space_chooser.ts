/** Which space is shown. */

import type { SpaceInfo } from "../wire";
import { h } from "./dom";

export class SpaceChooser {
  readonly element: HTMLSelectElement;
  private names = "";
  private isByPointer = false;

  constructor(choose: (space: string) => void) {
    this.element = h("select", {
      class: "space",
      title: "Space",
      attributes: { "aria-label": "space" },
      on: {
        // Whoever chose with the pointer has the keys of the page again; who uses keys goes on.
        pointerdown: () => (this.isByPointer = true),
        keydown: () => (this.isByPointer = false),
        change: () => {
          if (this.isByPointer) {
            this.element.blur();
          }
          choose(this.element.value);
        },
      },
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
