/** A status as a shape and a colour. */

import type { Status } from "../wire";
import { h } from "./dom";

const SPACE = "http://www.w3.org/2000/svg";
/** The shapes that agents have in the scene, from above. */
const SHAPES: Record<Status, string> = {
  localized: "M17 10 L4 16 L7.5 10 L4 4 Z",
  uncertain: "M17.5 10 L10 15.5 L3.5 10 L10 4.5 Z",
  lost: "M4.5 4.5 H15.5 V15.5 H4.5 Z",
};

/** The shape of an agent in its colour. */
export function glyph(status: Status, colour: string): SVGSVGElement {
  const svg = document.createElementNS(SPACE, "svg");
  svg.setAttribute("viewBox", "0 0 20 20");
  svg.setAttribute("aria-hidden", "true");
  svg.classList.add("glyph");
  const path = document.createElementNS(SPACE, "path");
  path.setAttribute("d", SHAPES[status]);
  path.style.fill = colour;
  svg.append(path);
  return svg;
}

export function badge(status: Status): HTMLElement {
  return h("span", { class: `badge ${status}` }, status);
}
