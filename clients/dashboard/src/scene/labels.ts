/** Texts over the scene, drawn as one layer: names, marks, scales. */

import type { Palette } from "./palette";

export interface Label {
  text: string;
  x: number;
  y: number;
  colour: string;
  /** Larger ones are placed first; of two that would overlap the later one is left out. */
  weight: number;
  size?: number;
  bold?: boolean;
  align?: CanvasTextAlign;
  alpha?: number;
  /** Text behind in a pale colour. */
  note?: string;
}

interface Box {
  left: number;
  top: number;
  right: number;
  bottom: number;
}

/** More labels than these nobody reads. */
const LABELS_MAX = 90;
export const FONT =
  'Inter, "SF Pro Text", "Segoe UI", system-ui, Roboto, "DejaVu Sans", sans-serif';

export class Labels {
  private readonly context: CanvasRenderingContext2D;
  private ratio = 1;

  constructor(readonly canvas: HTMLCanvasElement) {
    this.context = canvas.getContext("2d")!;
  }

  resize(width: number, height: number, ratio: number): void {
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    this.ratio = ratio;
  }

  draw(labels: Label[], palette: Palette): void {
    const context = this.context;
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    const width = this.canvas.width / this.ratio;
    const height = this.canvas.height / this.ratio;
    context.clearRect(0, 0, width, height);
    context.lineJoin = "round";
    context.textBaseline = "middle";
    const taken: Box[] = [];
    const ordered = labels.sort((a, b) => b.weight - a.weight).slice(0, LABELS_MAX);
    for (const label of ordered) {
      const size = label.size ?? 11;
      context.font = `${label.bold ? 600 : 500} ${size}px ${FONT}`;
      const text = context.measureText(label.text).width;
      const note = label.note === undefined ? 0 : context.measureText(` ${label.note}`).width;
      const align = label.align ?? "left";
      const left = align === "center" ? label.x - (text + note) / 2 : label.x;
      const box = {
        left: left - 2,
        right: left + text + note + 2,
        top: label.y - size * 0.6,
        bottom: label.y + size * 0.6,
      };
      const isOutside = box.right < 0 || box.left > width || box.bottom < 0 || box.top > height;
      if (isOutside || taken.some((other) => overlaps(box, other))) {
        continue;
      }
      taken.push(box);
      context.globalAlpha = label.alpha ?? 1;
      context.strokeStyle = palette.labelHalo;
      context.lineWidth = 3;
      context.fillStyle = label.colour;
      context.strokeText(label.text, left, label.y);
      context.fillText(label.text, left, label.y);
      if (label.note !== undefined) {
        context.globalAlpha = 0.72 * (label.alpha ?? 1);
        context.strokeText(` ${label.note}`, left + text, label.y);
        context.fillStyle = palette.label;
        context.fillText(` ${label.note}`, left + text, label.y);
      }
    }
    context.globalAlpha = 1;
  }
}

function overlaps(a: Box, b: Box): boolean {
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}
