/** The health of the service in one line. */

import type { Memory } from "../memory/memory";
import { h, say, sharpContext } from "./dom";
import { bytes, count } from "./format";

/** Values of a curve: a minute of ticks. */
const CURVE = 300;

interface Figure {
  element: HTMLElement;
  value: HTMLElement;
}

export class HealthStrip {
  readonly element = h("dl", { class: "health", attributes: { "aria-label": "health" } });
  private readonly curve = h("canvas", { class: "curve" });
  private readonly rates: number[] = [];
  private readonly rate = this.figure("samples/s", "Samples applied in the last second");
  private readonly waiting = this.figure("waiting", "Samples that wait for earlier ones");
  private readonly notDurable = this.figure(
    "not durable",
    "Applied samples that are not on disk yet: the lag of the watermark",
  );
  private readonly dropped = this.figure("dropped", "Messages dropped whole since the start");
  private readonly skipped = this.figure("skipped", "Samples skipped for good since the start");
  private readonly memory = this.figure("memory", "Memory of the service");

  constructor() {
    this.rate.element.append(this.curve);
  }

  /** Takes a tick in. */
  note(memory: Memory): void {
    const health = memory.health;
    if (health === null) {
      return;
    }
    if (health.samples_per_s !== null) {
      this.rates.push(health.samples_per_s);
      this.rates.splice(0, Math.max(0, this.rates.length - CURVE));
    }
  }

  update(memory: Memory, colour: string): void {
    const health = memory.health;
    if (health === null) {
      return;
    }
    say(this.rate.value, health.samples_per_s === null ? "—" : count(health.samples_per_s));
    this.put(this.waiting, count(health.waiting_samples), health.waiting_samples > 0);
    this.put(
      this.notDurable,
      count(health.not_durable_samples),
      health.not_durable_samples > 10_000,
    );
    this.put(this.dropped, count(health.dropped_messages), health.dropped_messages > 0);
    this.put(this.skipped, count(health.skipped_samples), health.skipped_samples > 0);
    say(this.memory.value, health.resident_bytes === null ? "—" : bytes(health.resident_bytes));
    this.draw(colour);
  }

  private figure(name: string, title: string): Figure {
    const value = h("dd", {}, "—");
    const element = h("div", { class: "figure", title }, h("dt", {}, name), value);
    this.element.append(element);
    return { element, value };
  }

  private put(figure: Figure, text: string, isBad: boolean): void {
    say(figure.value, text);
    figure.element.classList.toggle("warn", isBad);
  }

  private draw(colour: string): void {
    const context = sharpContext(this.curve);
    if (context === null || this.rates.length < 2) {
      return;
    }
    const { clientWidth: width, clientHeight: height } = this.curve;
    const top = Math.max(...this.rates, 1);
    context.beginPath();
    this.rates.forEach((rate, i) => {
      const x = width * (1 - (this.rates.length - 1 - i) / (CURVE - 1));
      const y = height - 1.5 - (height - 3) * (rate / top);
      context.lineTo(x, y);
    });
    context.strokeStyle = colour;
    context.lineWidth = 1.4;
    context.lineJoin = "round";
    context.stroke();
  }
}
