/** Recall: a position as a cue, the places that answer it, best first. */

import type { RecalledPlace, Vec3 } from "../wire";
import { button, CLOSE, h, say } from "./dom";
import { metres, percent } from "./format";

const CROSS = "M10 2 V7 M10 13 V18 M2 10 H7 M13 10 H18";

export interface RecallActions {
  ask(at: Vec3): void;
  aim(): void;
  close(): void;
  choose(place: number): void;
}

export class RecallPanel {
  readonly element = h("section", { class: "inspect recall-panel" });
  private readonly inputs = (["x", "y", "z"] as const).map((axis) =>
    h("input", {
      attributes: {
        type: "number",
        step: "any",
        required: "",
        "aria-label": `${axis} in metres`,
        placeholder: axis,
      },
    }),
  );
  private readonly results = h("ol", { class: "recalled" });
  private readonly note = h("p", { class: "soft" });
  private readonly aim: HTMLButtonElement;

  constructor(private readonly actions: RecallActions) {
    this.aim = button(
      "Point in the map",
      "Click a position in the map (R)",
      () => actions.aim(),
      CROSS,
    );
    const submit = (event: Event): void => {
      event.preventDefault();
      actions.ask(this.inputs.map((input) => Number(input.value)) as Vec3);
    };
    this.element.append(
      h(
        "header",
        {},
        h("h2", {}, "Recall by position"),
        button("", "Close", () => actions.close(), CLOSE),
      ),
      h("form", { class: "cue", on: { submit } }, ...this.inputs, h("button", {}, "Recall")),
      h("div", { class: "actions" }, this.aim),
      this.note,
      this.results,
    );
  }

  set isAiming(isAiming: boolean) {
    this.aim.setAttribute("aria-pressed", String(isAiming));
  }

  show(cue: Vec3 | null, places: RecalledPlace[], said: string): void {
    cue?.forEach((x, i) => (this.inputs[i]!.value = x.toFixed(2)));
    say(this.note, said);
    this.results.replaceChildren(...places.map((recalled) => this.row(recalled)));
  }

  private row({ place, confidence, cosine, distance_m }: RecalledPlace): HTMLElement {
    const bar = h("i");
    bar.style.width = `${100 * (confidence ?? 0)}%`;
    const attributes = { type: "button", "data-place": String(place.id) };
    return h(
      "li",
      {},
      h(
        "button",
        { attributes, on: { click: () => this.actions.choose(place.id) } },
        h("span", { class: "what" }, `Place ${place.id}`),
        h("span", { class: "bar", title: "Confidence" }, bar),
        h(
          "span",
          { class: "number", title: "Confidence" },
          confidence === null ? "" : percent(confidence),
        ),
        h(
          "span",
          { class: "soft number", title: "Distance; cosine of the grid codes" },
          `${distance_m === null ? "" : metres(distance_m)} · ${cosine?.toFixed(3) ?? ""}`,
        ),
      ),
    );
  }
}
