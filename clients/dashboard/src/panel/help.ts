/** The shortcuts and signs, on request. */

import { SHORTCUTS } from "../keys";
import { button, CLOSE, h } from "./dom";
import { glyph } from "./status";

export class Help {
  readonly element = h("dialog", { class: "help", attributes: { "aria-label": "help" } });

  constructor() {
    const keys = SHORTCUTS.map(([key, does]) =>
      h("div", {}, h("dt", {}, h("kbd", {}, key)), h("dd", {}, does)),
    );
    const ink = "currentColor";
    const sign = (shape: Node, says: string): HTMLElement => h("li", {}, shape, says);
    this.element.append(
      h(
        "header",
        {},
        h("h2", {}, "Keys and signs"),
        button("", "Close", () => this.element.close(), CLOSE),
      ),
      h("dl", {}, ...keys),
      h(
        "ul",
        { class: "signs" },
        sign(glyph("localized", ink), "localized: the dart points ahead"),
        sign(glyph("uncertain", ink), "uncertain, with a ring"),
        sign(glyph("lost", ink), "lost: no heading, with a ring"),
        sign(
          h("span", { class: "sign shell" }),
          "shell around an agent or landmark: two standard deviations",
        ),
        sign(h("span", { class: "sign dot" }), "point: a place that the team remembers"),
        sign(h("span", { class: "sign line" }), "thin line: a trip from place to place"),
        sign(h("span", { class: "sign line thick" }), "thick line: a route that an agent follows"),
        sign(h("span", { class: "sign flash blocked" }), "red ring: no route leads across here"),
        sign(
          h("span", { class: "sign ray" }),
          "short ray: a sighting; the thick ones are of other agents",
        ),
        sign(
          h("span", { class: "sign flash" }),
          "flash: found, corrected by a loop, recognised, learned, merged, come back to",
        ),
      ),
      h(
        "p",
        { class: "soft" },
        "Drag to turn, drag with the right button to move, scroll to come near.",
      ),
    );
    this.element.addEventListener("click", (event) => {
      if (event.target === this.element) {
        this.element.close();
      }
    });
  }

  toggle(): void {
    if (this.element.open) {
      this.element.close();
    } else {
      this.element.showModal();
    }
  }
}
