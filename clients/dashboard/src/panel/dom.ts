/** Makes elements of the page. */

type Child = Node | string | null | false | undefined;
type Handlers = { [K in keyof HTMLElementEventMap]?: (event: HTMLElementEventMap[K]) => void };

export interface Properties {
  class?: string;
  title?: string;
  on?: Handlers;
  attributes?: Record<string, string>;
}

export function h<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  properties: Properties = {},
  ...children: Child[]
): HTMLElementTagNameMap[K] {
  const element = document.createElement(tag);
  if (properties.class !== undefined) {
    element.className = properties.class;
  }
  if (properties.title !== undefined) {
    element.title = properties.title;
  }
  for (const [name, value] of Object.entries(properties.attributes ?? {})) {
    element.setAttribute(name, value);
  }
  for (const [name, handler] of Object.entries(properties.on ?? {})) {
    element.addEventListener(name, handler as EventListener);
  }
  element.append(...children.filter((child): child is Node | string => !!child));
  return element;
}

/** The drawing of a button that closes. */
export const CLOSE = "M5 5 L15 15 M15 5 L5 15";

/** A drawing of lines, 20 by 20. */
export function icon(path: string): SVGSVGElement {
  const space = "http://www.w3.org/2000/svg";
  const svg = document.createElementNS(space, "svg");
  svg.setAttribute("viewBox", "0 0 20 20");
  svg.setAttribute("aria-hidden", "true");
  svg.classList.add("icon");
  const line = document.createElementNS(space, "path");
  line.setAttribute("d", path);
  svg.append(line);
  return svg;
}

export function button(
  label: string,
  title: string,
  press: () => void,
  drawing?: string,
): HTMLButtonElement {
  const attributes = { type: "button", "aria-label": title };
  const made = h("button", { title, attributes, on: { click: press } });
  if (drawing !== undefined) {
    made.append(icon(drawing));
  }
  if (label !== "") {
    made.append(label);
  }
  return made;
}

/** Sets a text where it is another one. */
export function say(element: Element, text: string): void {
  if (element.textContent !== text) {
    element.textContent = text;
  }
}

/** A canvas with as many pixels as it has on the screen, and its context in CSS pixels. */
export function sharpContext(canvas: HTMLCanvasElement): CanvasRenderingContext2D | null {
  const ratio = Math.min(window.devicePixelRatio, 2);
  const width = Math.round(canvas.clientWidth * ratio);
  const height = Math.round(canvas.clientHeight * ratio);
  if (width === 0 || height === 0) {
    return null;
  }
  if (canvas.width !== width || canvas.height !== height) {
    canvas.width = width;
    canvas.height = height;
  }
  const context = canvas.getContext("2d")!;
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, canvas.clientWidth, canvas.clientHeight);
  return context;
}
