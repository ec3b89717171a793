/** Percepts by channel: a level as mean and deviation, a view as a strip of its numbers. */

import type { Palette } from "../scene/palette";
import type { RememberedPercept } from "../wire";
import { h, say, sharpContext } from "./dom";
import { ramp } from "./object_model";

/** Cells of a strip: a longer vector is shown by means. */
const CELLS_MAX = 64;

export class PerceptList {
  readonly element = h("ul", { class: "percepts" });
  private strips: { canvas: HTMLCanvasElement; cells: number[] }[] = [];
  private drawn = "";

  show(percepts: RememberedPercept[], palette: Palette): void {
    this.strips = [];
    this.drawn = "";
    this.element.replaceChildren(...percepts.map((percept) => this.row(percept)));
    this.draw(palette);
  }

  /** Draws the strips where they are of another size or in other colours. */
  draw(palette: Palette): void {
    const drawn = `${palette.shade} ${this.element.clientWidth}`;
    if (drawn === this.drawn) {
      return;
    }
    this.drawn = drawn;
    for (const { canvas, cells } of this.strips) {
      drawStrip(canvas, cells, palette);
    }
  }

  private row({ channel, expected, percepts }: RememberedPercept): HTMLElement {
    const what = h("span", { class: "number" });
    const times = percepts === 1 ? "felt once" : `felt ${percepts} times`;
    const row = h("li", { title: times, attributes: { "data-channel": channel } });
    if (expected.level !== undefined) {
      const { mean, sd } = expected.level;
      say(what, `${mean.toPrecision(3)} ± ${sd.toPrecision(2)}`);
      row.append(h("b", {}, channel), what);
      return row;
    }
    const vector = expected.descriptor?.vector ?? [];
    const canvas = h("canvas", { class: "strip" });
    this.strips.push({ canvas, cells: shortened(vector) });
    say(what, `${percepts} ${percepts === 1 ? "view" : "views"}`);
    row.append(h("b", {}, channel), canvas, what);
    row.title = `A view of ${vector.length} numbers, the mean of ${percepts}`;
    return row;
  }
}

/** The numbers of a vector, or means of neighbours where there are too many. */
export function shortened(vector: number[]): number[] {
  const each = Math.ceil(vector.length / CELLS_MAX);
  const cells = Math.ceil(vector.length / Math.max(each, 1));
  return Array.from({ length: cells }, (_, i) => {
    const part = vector.slice(each * i, each * (i + 1));
    return part.reduce((sum, x) => sum + x, 0) / part.length;
  });
}

function drawStrip(canvas: HTMLCanvasElement, cells: number[], palette: Palette): void {
  const context = sharpContext(canvas);
  if (context === null || cells.length === 0) {
    return;
  }
  const most = Math.max(...cells.map(Math.abs), 1e-9);
  const width = canvas.clientWidth / cells.length;
  cells.forEach((x, i) => {
    context.fillStyle = ramp(palette.age, 0.5 + x / (2 * most));
    context.fillRect(i * width, 0, Math.max(width - 0.6, 0.6), canvas.clientHeight);
  });
}
