/** The slider over the stamps that answers carry: the past by hand, or the present. */

import type { Memory } from "../memory/memory";
import type { Palette } from "../scene/palette";
import { button, h, say, sharpContext } from "./dom";
import { exact, span, time } from "./format";

/** Steps of the slider. */
const STEPS = 1000;
/** Times as fast as it was. */
const SPEED = 4;
const PLAY = "M6 4 L16 10 L6 16 Z";
const PAUSE = "M6 4 V16 M14 4 V16";

export class Timeline {
  readonly element = h("div", { class: "timeline" });
  /** Time that is shown [s]; null for now. */
  time: number | null = null;
  private isPlaying = false;
  private readonly slider = h("input", {
    attributes: {
      type: "range",
      min: "0",
      max: String(STEPS),
      step: "1",
      "aria-label": "time shown",
    },
  });
  private readonly marks = h("canvas", { class: "marks" });
  private readonly label = h("output", { class: "when" });
  private readonly live: HTMLButtonElement;
  private readonly play: HTMLButtonElement;

  constructor(private readonly changed: () => void) {
    this.live = button("Live", "Show what is now (L)", () => this.goLive());
    this.live.classList.add("live");
    this.play = button(
      "",
      `Play the past, ${SPEED} times as fast (space)`,
      () => this.toggle(),
      PLAY,
    );
    this.slider.value = String(STEPS);
    this.slider.addEventListener("input", () => {
      this.isPlaying = false;
      this.take(Number(this.slider.value) / STEPS);
    });
    this.element.append(
      this.play,
      h("div", { class: "track" }, this.marks, this.slider),
      this.label,
      this.live,
    );
  }

  goLive(): void {
    this.time = null;
    this.isPlaying = false;
    this.slider.value = String(STEPS);
    this.changed();
  }

  /** Plays the past from where it is, from the beginning where it is now; or stops. */
  toggle(): void {
    if (this.time === null) {
      this.time = this.begin;
      this.isPlaying = true;
    } else {
      this.isPlaying = !this.isPlaying;
    }
    this.changed();
  }

  /** Moves on while it plays. */
  advance(elapsedS: number): void {
    if (!this.isPlaying || this.time === null) {
      return;
    }
    this.time += SPEED * elapsedS;
    if (this.time >= this.end) {
      this.goLive();
    } else {
      this.changed();
    }
  }

  step(seconds: number): void {
    const to = (this.time ?? this.end) + seconds;
    this.isPlaying = false;
    this.take((to - this.begin) / Math.max(this.end - this.begin, 1e-9));
  }

  private begin = 0;
  private end = 0;

  update(memory: Memory, palette: Palette): void {
    const hasPast = Number.isFinite(memory.begin) && memory.end > memory.begin;
    this.slider.disabled = this.play.disabled = !hasPast;
    if (!hasPast) {
      say(this.label, "");
      return;
    }
    this.begin = memory.begin;
    this.end = memory.end;
    const length = Math.max(this.end - this.begin, 1e-9);
    const part = this.time === null ? 1 : (this.time - this.begin) / length;
    this.slider.value = String(Math.round(STEPS * Math.min(1, Math.max(0, part))));
    this.slider.style.setProperty("--part", `${100 * Math.min(1, Math.max(0, part))}%`);
    const stamp = memory.clock.stamp(this.time ?? this.end);
    const ago = this.time === null ? "" : ` · ${span(this.end - this.time)} ago`;
    say(this.label, `${time(stamp)}${ago}`);
    this.label.title = exact(stamp);
    this.live.setAttribute("aria-pressed", String(this.time === null));
    this.element.classList.toggle("past", this.time !== null);
    const drawing = this.isPlaying ? PAUSE : PLAY;
    this.play.querySelector("path")!.setAttribute("d", drawing);
    this.draw(memory, palette, length);
  }

  private take(part: number): void {
    this.time = part >= 0.999 ? null : this.begin + Math.max(0, part) * (this.end - this.begin);
    this.changed();
  }

  /** Events that are worth a look, as marks along the track. */
  private draw(memory: Memory, palette: Palette, length: number): void {
    const context = sharpContext(this.marks);
    if (context === null) {
      return;
    }
    const { clientWidth: width, clientHeight: height } = this.marks;
    const heights: Record<string, number> = {
      agent_placed: 1,
      loops_closed: 0.6,
      object_recognised: 1,
      objects_merged: 1,
      object_learned: 0.8,
      object_split: 0.8,
      agent_enrolled: 0.4,
      landmark_learned: 0.45,
      percept_surprising: 0.4,
    };
    for (const event of memory.events) {
      const tall = heights[event.kind];
      if (tall === undefined || event.s < this.begin) {
        continue;
      }
      context.globalAlpha = 0.85;
      context.fillStyle = palette.flash[event.kind] ?? palette.label;
      const x = ((event.s - this.begin) / length) * width;
      context.fillRect(x - 0.5, (height - tall * height) / 2, 1.6, tall * height);
    }
    context.globalAlpha = 1;
  }
}
