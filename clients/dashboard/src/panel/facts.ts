/** Named values, one a line. */

import { h, say } from "./dom";

export class Facts {
  readonly element = h("dl", { class: "facts" });
  private readonly values = new Map<string, HTMLElement>();

  /** Shows a value under a name; null takes the line away. */
  set(name: string, value: string | null, title = ""): void {
    const known = this.values.get(name);
    if (value === null) {
      known?.parentElement?.remove();
      this.values.delete(name);
      return;
    }
    if (known !== undefined) {
      say(known, value);
      known.title = title;
      return;
    }
    const element = h("dd", { title }, value);
    this.values.set(name, element);
    this.element.append(h("div", {}, h("dt", {}, name), element));
  }
}
