/** An episode with an object: hypotheses as bars that narrow, and what is felt on the model. */

import { conjugate, rotate } from "../grid/lattice";
import type { Agent } from "../memory/agent";
import type { Memory } from "../memory/memory";
import { agentColour, rgb, type Palette } from "../scene/palette";
import type { Identification, ObjectDetail, Vec3 } from "../wire";
import { h, say, sharpContext } from "./dom";
import { percent } from "./format";

/** Hypotheses that are shown. */
const BARS_MAX = 5;

export class TouchPanel {
  readonly element = h("section", { class: "touch" });
  private readonly title = h("h3");
  private readonly bars = h("ul", { class: "bars" });
  private readonly model = h("canvas", { class: "model" });
  private readonly note = h("p", { class: "soft" });
  private readonly models = new Map<string, ObjectDetail | "asked">();

  constructor() {
    this.element.append(this.title, this.bars, this.model, this.note);
  }

  update(agent: Agent, memory: Memory, palette: Palette): void {
    const touch = agent.touch;
    const isUnderWay = agent.live.contacts !== null;
    const said = touch?.identification ?? touch?.last?.identification ?? null;
    this.element.hidden = touch === null || (!isUnderWay && said === null);
    if (this.element.hidden) {
      return;
    }
    const contacts = isUnderWay ? agent.live.contacts! : (said?.contacts ?? 0);
    const doing = touch?.episode === "learn" ? "Learning by touch" : "Recognising by touch";
    say(this.title, `${isUnderWay ? doing : "Touched last"} · ${contacts} contacts`);
    this.showBars(said, palette);
    const name = said?.pose?.object ?? said?.objects[0]?.name;
    const model = name === undefined ? undefined : this.modelOf(name, memory);
    this.model.hidden = model === undefined;
    say(
      this.note,
      said === null ? "What is felt teaches an object; nothing is compared." : verdict(said),
    );
    if (model !== undefined) {
      this.draw(model, agent, said, palette);
    }
  }

  private showBars(said: Identification | null, palette: Palette): void {
    const rows =
      said === null
        ? []
        : [
            ...said.objects.slice(0, BARS_MAX),
            { name: "something unknown", probability: said.unknown },
          ];
    while (this.bars.childElementCount > rows.length) {
      this.bars.lastElementChild!.remove();
    }
    rows.forEach(({ name, probability }, i) => {
      let row = this.bars.children[i] as HTMLElement | undefined;
      if (row === undefined) {
        row = h(
          "li",
          {},
          h("span", { class: "what" }),
          h("span", { class: "bar" }, h("i")),
          h("span", { class: "number" }),
        );
        this.bars.append(row);
      }
      const [what, bar, number] = row.children as unknown as [Element, Element, Element];
      say(what, name);
      (bar.firstElementChild as HTMLElement).style.width = `${100 * probability}%`;
      say(number, percent(probability));
      row.classList.toggle("sure", probability >= 0.995);
      row.style.setProperty("--bar", palette.flash["object_recognised"] ?? palette.label);
    });
  }

  private modelOf(name: string, memory: Memory): ObjectDetail | undefined {
    const known = this.models.get(name);
    if (known === undefined) {
      this.models.set(name, "asked");
      memory.space.object(name).then(
        (detail) => this.models.set(name, detail),
        () => this.models.delete(name),
      );
    }
    return known === "asked" ? undefined : known;
  }

  /** Draws the model, turning slowly, and the way of the body on it. */
  private draw(
    model: ObjectDetail,
    agent: Agent,
    said: Identification | null,
    palette: Palette,
  ): void {
    const context = sharpContext(this.model);
    if (context === null) {
      return;
    }
    const { clientWidth: width, clientHeight: height } = this.model;
    const { min_m: low, max_m: high } = model.summary;
    const middle = low.map((x, i) => (x + high[i]!) / 2) as Vec3;
    const size = Math.max(Math.hypot(...low.map((x, i) => high[i]! - x)), 1e-3);
    const scale = (0.86 * Math.min(width, height)) / size;
    const turn = performance.now() / 4000;
    const put = (at: Vec3): { x: number; y: number; depth: number } => {
      const [dx, dy, dz] = at.map((x, i) => x - middle[i]!) as Vec3;
      const x = dx * Math.cos(turn) - dy * Math.sin(turn);
      const away = dx * Math.sin(turn) + dy * Math.cos(turn);
      return {
        x: width / 2 + scale * x,
        y: height / 2 - scale * (0.9 * dz + 0.42 * away),
        depth: away,
      };
    };
    const points = model.places.map((place) => ({ ...put(place.position_m), place }));
    const levels = model.places.map((place) => place.levels[0]?.mean ?? 0);
    const [least, most] = [Math.min(...levels), Math.max(...levels)];
    for (const { x, y, depth, place } of points.sort((a, b) => b.depth - a.depth)) {
      const level = ((place.levels[0]?.mean ?? least) - least) / Math.max(most - least, 1e-9);
      context.globalAlpha = 0.5 + 0.4 * Math.min(1, Math.max(0, 0.5 - depth / size));
      context.fillStyle = ramp(palette.age, level);
      context.beginPath();
      context.arc(x, y, 2.4, 0, 2 * Math.PI);
      context.fill();
    }
    const path = pathOnModel(agent, said);
    context.globalAlpha = 0.9;
    context.strokeStyle = context.fillStyle = agentColour(palette, agent.colour);
    context.lineWidth = 1.5;
    context.beginPath();
    path.forEach((at) => context.lineTo(put(at).x, put(at).y));
    context.stroke();
    const last = path.at(-1);
    if (last !== undefined) {
      context.beginPath();
      context.arc(put(last).x, put(last).y, 4, 0, 2 * Math.PI);
      context.fill();
    }
    context.globalAlpha = 1;
  }
}

/** The way of the body since the episode began, in the frame of the most probable object. */
function pathOnModel(agent: Agent, said: Identification | null): Vec3[] {
  const start = agent.touchPath[0];
  const pose = said?.pose;
  if (start === undefined || pose === null || pose === undefined) {
    return [];
  }
  const back = conjugate(start.rotation);
  return agent.touchPath.map(({ position }) => {
    const away = position.map((x, i) => x - start.position[i]!) as Vec3;
    const inEpisode = rotate(back, away);
    return rotate(pose.rotation_xyzw, inEpisode).map((x, i) => x + pose.translation_m[i]!) as Vec3;
  });
}

function verdict(said: Identification): string {
  if (said.verdict.object !== undefined) {
    return `It is ${said.verdict.object.name}.`;
  }
  if (said.verdict.unknown !== undefined) {
    return "It is none of the objects that were learned.";
  }
  const poses = said.live_hypotheses;
  return (
    `${poses} ${poses === 1 ? "pose comes" : "poses come"} into question, ` +
    `${said.entropy_nats.toFixed(2)} nats.`
  );
}

function ramp(stops: string[], part: number): string {
  const at = Math.min(0.999, Math.max(0, part)) * (stops.length - 1);
  const [low, high] = [rgb(stops[Math.floor(at)]!), rgb(stops[Math.floor(at) + 1]!)];
  const mixed = low.map((x, i) => Math.round(255 * (x + (at % 1) * (high[i]! - x))));
  return `rgb(${mixed.join(" ")})`;
}
