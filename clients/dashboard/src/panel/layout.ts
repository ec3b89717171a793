/** Where everything stands on the page. */

import logoUrl from "../logo.svg";
import type { Insets, ViewName } from "../scene/camera";
import type { Connection } from "../stream";
import { button, h, say } from "./dom";

/** Below this width, panels are a sheet at the bottom [px]. */
const NARROW_PX = 820;

export interface Parts {
  chooser: HTMLElement;
  health: HTMLElement;
  agents: HTMLElement;
  legend: HTMLElement;
  objects: HTMLElement;
  channels: HTMLElement;
  feed: HTMLElement;
  timeline: HTMLElement;
  notice: HTMLElement;
  help: HTMLElement;
  inspected: HTMLElement[];
}

export interface LayoutActions {
  look(view: ViewName): void;
  recall(): void;
  theme(): void;
  help(): void;
}

const STATES: Record<Connection["state"], string> = {
  connecting: "connecting",
  live: "live",
  reconnecting: "reconnecting",
  refused: "refused",
};

export class Layout {
  readonly element: HTMLElement;
  readonly view = h("div", { class: "view", attributes: { "aria-label": "map" } });
  readonly canvas = h("canvas", { class: "scene" });
  readonly labels = h("canvas", { class: "labels" });
  /** Called when the panels cover another part of the page. */
  resized: () => void = () => undefined;
  private readonly state = h(
    "span",
    { class: "state", attributes: { role: "status" } },
    "connecting",
  );
  private readonly left: HTMLElement;
  private readonly right: HTMLElement;
  private readonly views: Record<ViewName, HTMLButtonElement>;
  private readonly recallButton: HTMLButtonElement;

  constructor(parts: Parts, actions: LayoutActions) {
    this.view.append(this.canvas, this.labels);
    this.views = {
      orbit: button("Orbit", "View from the side and above (O)", () => actions.look("orbit")),
      top: button("Top", "View from above (T)", () => actions.look("top")),
      side: button("Side", "View from the side (S)", () => actions.look("side")),
    };
    this.recallButton = button(
      "Recall",
      "Ask which places answer at a position (R)",
      actions.recall,
    );
    const logo = h("img", { attributes: { src: logoUrl, alt: "", width: "22", height: "22" } });
    const header = h(
      "header",
      { class: "bar" },
      h(
        "a",
        { class: "brand", title: "The interface of the service", attributes: { href: "/docs/" } },
        logo,
        h("b", {}, "cogmap"),
      ),
      parts.chooser,
      this.state,
      parts.health,
      h(
        "nav",
        { class: "tools" },
        button(
          "",
          "Dark or light (D)",
          actions.theme,
          "M10 3 A7 7 0 1 0 10 17 Z M10 3 A7 7 0 1 1 10 17",
        ),
        button("?", "Keys and signs (?)", actions.help),
      ),
    );
    this.left = h(
      "aside",
      { class: "left" },
      h("section", { class: "card" }, h("h3", {}, "Team"), parts.agents),
      h(
        "section",
        { class: "card" },
        h("h3", {}, "Memory"),
        parts.legend,
        parts.objects,
        parts.channels,
      ),
    );
    this.right = h("aside", { class: "right" }, ...parts.inspected);
    const bottom = h(
      "footer",
      { class: "bottom" },
      h("section", { class: "events" }, parts.feed),
      h(
        "div",
        { class: "controls" },
        parts.timeline,
        h("div", { class: "segmented views" }, this.views.orbit, this.views.top, this.views.side),
        this.recallButton,
      ),
    );
    this.element = h(
      "div",
      { class: "page" },
      this.view,
      header,
      this.left,
      this.right,
      bottom,
      parts.notice,
      parts.help,
    );
    this.showView("orbit");
    new ResizeObserver(() => this.resized()).observe(this.right);
    new ResizeObserver(() => this.resized()).observe(bottom);
  }

  get isNarrow(): boolean {
    return window.innerWidth < NARROW_PX;
  }

  /** What panels cover of the view. */
  insets(): Insets {
    if (this.isNarrow) {
      return { left: 0, right: 0, top: 0, bottom: 0 };
    }
    const right = this.right.hidden ? 0 : this.right.offsetWidth;
    return { left: this.left.offsetWidth, right, top: 48, bottom: 70 };
  }

  connection(state: Connection["state"]): void {
    say(this.state, STATES[state]);
    this.state.dataset["state"] = state;
  }

  inspect(isShown: boolean): void {
    this.right.hidden = !isShown;
    this.element.classList.toggle("inspecting", isShown);
    this.resized();
  }

  aim(isAiming: boolean): void {
    this.view.classList.toggle("aiming", isAiming);
    this.recallButton.setAttribute("aria-pressed", String(isAiming));
  }

  showView(view: ViewName): void {
    for (const [name, element] of Object.entries(this.views)) {
      element.setAttribute("aria-pressed", String(name === view));
    }
  }
}
