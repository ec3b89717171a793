/** What the memory holds, and what the colours of the places mean. */

import type { Memory } from "../memory/memory";
import type { Palette } from "../scene/palette";
import type { PlaceColour } from "../scene/places";
import { h, say } from "./dom";
import { count } from "./format";

export class Legend {
  readonly element = h("div", { class: "legend" });
  private readonly counts = {
    places: h("dd"),
    trips: h("dd"),
    landmarks: h("dd"),
    objects: h("dd"),
  };
  private readonly ramp = h("canvas", { class: "ramp", attributes: { width: "160", height: "1" } });
  private readonly least = h("span");
  private readonly most = h("span");
  private readonly choices: Record<PlaceColour, HTMLButtonElement>;
  private drawn = "";

  constructor(private readonly choose: (colour: PlaceColour) => void) {
    const choice = (colour: PlaceColour, title: string): HTMLButtonElement => {
      const attributes = { type: "button" };
      return h("button", { title, attributes, on: { click: () => this.choose(colour) } }, colour);
    };
    this.choices = {
      strength: choice("strength", "How much a place has been used, fading with time"),
      age: choice("age", "How long ago a place was visited last"),
    };
    const figures = Object.entries(this.counts).map(([name, value]) =>
      h("div", {}, h("dt", {}, name), value),
    );
    this.element.append(
      h("dl", { class: "counts" }, ...figures),
      h(
        "div",
        { class: "row" },
        h("span", { class: "soft" }, "places by"),
        h("span", { class: "segmented" }, this.choices.strength, this.choices.age),
      ),
      this.ramp,
      h("div", { class: "row ends soft" }, this.least, this.most),
    );
  }

  update(memory: Memory, palette: Palette, colour: PlaceColour): void {
    const names = ["places", "trips", "landmarks", "objects"] as const;
    names.forEach((name) => say(this.counts[name], count(memory.counts[name])));
    say(this.least, colour === "strength" ? "once" : "long ago");
    const most = memory.cloud.strengthMax.toFixed(memory.cloud.strengthMax < 10 ? 1 : 0);
    say(this.most, colour === "strength" ? `strength ${most}` : "just now");
    const drawn = palette.shade + colour;
    if (drawn === this.drawn) {
      return;
    }
    this.drawn = drawn;
    for (const [name, element] of Object.entries(this.choices)) {
      element.setAttribute("aria-pressed", String(name === colour));
    }
    const context = this.ramp.getContext("2d")!;
    const gradient = context.createLinearGradient(0, 0, this.ramp.width, 0);
    palette[colour].forEach((stop, i, all) => gradient.addColorStop(i / (all.length - 1), stop));
    context.fillStyle = gradient;
    context.fillRect(0, 0, this.ramp.width, 1);
  }
}
