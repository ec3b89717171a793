/** The grid cells of an agent: each module's phase in its lattice cell, and how its cells fire. */

import { combine, STANDARD } from "../grid/lattice";
import type { GridModule, GridState, Vec3 } from "../wire";
import { h, say, sharpContext } from "./dom";
import { degrees, metres } from "./format";

/** Cells along each axis of a module. */
const CELLS = 3;
/** Phases that a tail keeps. */
const TAIL = 14;
/** Corners of a cell, and the edges between them. */
const CORNERS: Vec3[] = Array.from({ length: 8 }, (_, i) => [(i >> 2) & 1, (i >> 1) & 1, i & 1]);
const EDGES = CORNERS.flatMap((_, i) =>
  [1, 2, 4].filter((bit) => !(i & bit)).map((bit) => [i, i | bit] as const),
);

interface Cell {
  element: HTMLButtonElement;
  canvas: HTMLCanvasElement;
  spacing: HTMLElement;
  tail: Vec3[];
}

export class GridPanel {
  readonly element = h("section", { class: "grid-cells" });
  private readonly cells: Cell[] = [];
  private readonly modules = h("div", { class: "modules" });
  private readonly octant = h("canvas", { class: "octant" });
  private readonly movement = h("p", { class: "soft movement" });
  private state: GridState | null = null;

  /** @param choose - Called with a module whose firing fields are to be shown, or not any more. */
  constructor(private readonly choose: (module: number) => void) {
    const title =
      "Each cube is one cell of a module's lattice: the bright dot is the phase, the " +
      "others fire the more the nearer their preferred phase. Press one to see where its active " +
      "cells fire.";
    this.element.append(
      h("h3", { title }, "Grid cells"),
      this.modules,
      h("div", { class: "octant-row" }, this.octant, this.movement),
    );
  }

  show(state: GridState | null): void {
    if (state?.agent !== this.state?.agent) {
      this.cells.forEach((cell) => (cell.tail = []));
    }
    this.state = state;
    this.element.hidden = state === null;
  }

  draw(colour: string, ink: string, chosen: number | null): void {
    const state = this.state;
    if (state === null) {
      return;
    }
    state.modules.forEach((module, i) => {
      const cell = this.cells[i] ?? this.make(i);
      say(cell.spacing, metres(module.spacing_m));
      cell.element.setAttribute("aria-pressed", String(i === chosen));
      drawCell(cell, module, colour, ink);
    });
    while (this.cells.length > state.modules.length) {
      this.cells.pop()!.element.remove();
    }
    drawOctant(this.octant, state.octant, colour, ink);
    const octant = state.octant === null ? "no movement yet" : `octant ${state.octant}`;
    say(
      this.movement,
      `${octant} · step ${(100 * state.displacement_m).toFixed(1)} cm · ` +
        `turn ${degrees(state.turning_rad)}`,
    );
  }

  private make(module: number): Cell {
    const canvas = h("canvas");
    const spacing = h("span");
    const title = `Module ${module + 1}: show where its active cells fire`;
    const attributes = { type: "button", "aria-label": title };
    const on = { click: () => this.choose(module) };
    const element = h("button", { class: "module", title, attributes, on }, canvas, spacing);
    this.modules.append(element);
    const cell = { element, canvas, spacing, tail: [] };
    this.cells.push(cell);
    return cell;
  }
}

interface Dot {
  x: number;
  y: number;
  depth: number;
}

/**
 * Looks along the long diagonal of a cell, from a little beside it: the cell of a face-centred
 * cubic lattice appears as a hexagon, as a cube does.
 */
const EYE = lookAlong([1, 1 / Math.sqrt(3), Math.sqrt(2 / 3) - 0.32]);

const ISOMETRIC = lookAlong([0.45, 1, -0.55]);

/** Right, up and ahead of an eye that looks along a direction. */
function lookAlong(direction: Vec3): [Vec3, Vec3, Vec3] {
  const unit = (v: Vec3): Vec3 => v.map((x) => x / Math.hypot(...v)) as Vec3;
  const ahead = unit(direction);
  const right = unit([ahead[1], -ahead[0], 0]);
  const up: Vec3 = [
    right[1] * ahead[2] - right[2] * ahead[1],
    right[2] * ahead[0] - right[0] * ahead[2],
    right[0] * ahead[1] - right[1] * ahead[0],
  ];
  return [right, up, ahead];
}

function onPaper(at: Vec3, eye: [Vec3, Vec3, Vec3] = EYE): Dot {
  const [x, y, depth] = eye.map((axis) => axis[0] * at[0] + axis[1] * at[1] + axis[2] * at[2]);
  return { x: x!, y: -y!, depth: depth! };
}

function drawCell(cell: Cell, module: GridModule, colour: string, ink: string): void {
  const context = sharpContext(cell.canvas);
  if (context === null) {
    return;
  }
  const { clientWidth: width, clientHeight: height } = cell.canvas;
  const corners = CORNERS.map((corner) => onPaper(combine(STANDARD, corner)));
  const [left, right] = [
    Math.min(...corners.map((c) => c.x)),
    Math.max(...corners.map((c) => c.x)),
  ];
  const [top, bottom] = [
    Math.min(...corners.map((c) => c.y)),
    Math.max(...corners.map((c) => c.y)),
  ];
  const scale = Math.min((width - 14) / (right - left), (height - 14) / (bottom - top));
  const put = (phase: ArrayLike<number>): Dot => {
    const { x, y, depth } = onPaper(combine(STANDARD, phase));
    return {
      x: width / 2 + scale * (x - (left + right) / 2),
      y: height / 2 + scale * (y - (top + bottom) / 2),
      depth,
    };
  };
  context.strokeStyle = ink;
  context.lineWidth = 1;
  for (const [a, b] of EDGES) {
    // The three edges of the farthest corner lie behind.
    context.globalAlpha = a === 7 || b === 7 ? 0.16 : 0.42;
    line(context, put(CORNERS[a]!), put(CORNERS[b]!));
  }
  const preferred = module.activation.map((activation, i) => ({
    activation,
    ...put([
      Math.floor(i / (CELLS * CELLS)) / CELLS,
      (Math.floor(i / CELLS) % CELLS) / CELLS,
      (i % CELLS) / CELLS,
    ]),
  }));
  for (const { x, y, activation } of preferred.sort((a, b) => b.depth - a.depth)) {
    context.globalAlpha = 0.16 + 0.84 * activation;
    context.fillStyle = activation > 0.12 ? colour : ink;
    disc(context, x, y, 1.1 + 3.6 * activation);
  }
  drawPhase(context, cell, module.phase, put, colour, ink);
  context.globalAlpha = 1;
}

function drawPhase(
  context: CanvasRenderingContext2D,
  cell: Cell,
  phase: Vec3,
  put: (phase: ArrayLike<number>) => { x: number; y: number },
  colour: string,
  ink: string,
): void {
  cell.tail.push(phase);
  cell.tail.splice(0, Math.max(0, cell.tail.length - TAIL));
  context.strokeStyle = colour;
  context.lineWidth = 1.6;
  cell.tail.forEach((at, i) => {
    const before = cell.tail[i - 1];
    // A phase that leaves the cell comes in on the other side.
    if (before !== undefined && at.every((x, axis) => Math.abs(x - before[axis]!) < 0.5)) {
      context.globalAlpha = (0.75 * i) / cell.tail.length;
      line(context, put(before), put(at));
    }
  });
  const at = put(phase);
  const foot = put([phase[0], phase[1], 0]);
  context.globalAlpha = 0.45;
  context.lineWidth = 1;
  context.strokeStyle = ink;
  context.setLineDash([2, 2]);
  line(context, at, foot);
  context.setLineDash([]);
  context.globalAlpha = 0.28;
  context.fillStyle = colour;
  disc(context, at.x, at.y, 7.5);
  context.globalAlpha = 1;
  context.fillStyle = ink;
  disc(context, at.x, at.y, 3);
}

/** A cube of the eight octants, with that of the latest movement filled. */
function drawOctant(
  canvas: HTMLCanvasElement,
  octant: number | null,
  colour: string,
  ink: string,
): void {
  const context = sharpContext(canvas);
  if (context === null) {
    return;
  }
  const { clientWidth: width, clientHeight: height } = canvas;
  const scale = Math.min(width, height) * 0.27;
  const put = (at: Vec3): { x: number; y: number } => {
    const { x, y } = onPaper(at, ISOMETRIC);
    return { x: width / 2 + scale * x, y: height / 2 + scale * y };
  };
  const sides = octantSides(octant);
  const cube = (low: Vec3, high: Vec3): void => {
    const corner = (i: number): { x: number; y: number } =>
      put(CORNERS[i]!.map((bit, axis) => (bit ? high[axis]! : low[axis]!)) as Vec3);
    EDGES.forEach(([a, b]) => line(context, corner(a), corner(b)));
  };
  context.strokeStyle = ink;
  context.lineWidth = 1;
  context.globalAlpha = 0.3;
  cube([-1, -1, -1], [1, 1, 1]);
  if (sides === null) {
    return;
  }
  const end = put(sides);
  context.strokeStyle = colour;
  context.globalAlpha = 0.9;
  cube(sides.map((s) => Math.min(s, 0)) as Vec3, sides.map((s) => Math.max(s, 0)) as Vec3);
  context.lineWidth = 2;
  line(context, put([0, 0, 0]), end);
  context.fillStyle = colour;
  disc(context, end.x, end.y, 3);
}

/**
 * Signs of the movement along x, y and z in an octant, as the seed paper numbers them: 1 to 4 go
 * up, 5 to 8 down; within each, the quadrants of the x-y plane counter-clockwise from (+, +).
 */
export function octantSides(octant: number | null): Vec3 | null {
  if (octant === null || octant < 1 || octant > 8) {
    return null;
  }
  const quadrants: [number, number][] = [
    [1, 1],
    [-1, 1],
    [-1, -1],
    [1, -1],
  ];
  const [x, y] = quadrants[(octant - 1) % 4]!;
  return [x, y, octant <= 4 ? 1 : -1];
}

function line(
  context: CanvasRenderingContext2D,
  a: { x: number; y: number },
  b: { x: number; y: number },
): void {
  context.beginPath();
  context.moveTo(a.x, a.y);
  context.lineTo(b.x, b.y);
  context.stroke();
}

function disc(context: CanvasRenderingContext2D, x: number, y: number, radius: number): void {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  context.fill();
}
