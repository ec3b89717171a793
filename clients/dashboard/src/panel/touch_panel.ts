/** An episode with an object: hypotheses as bars that narrow, and what is felt on the model. */

import { conjugate, rotate } from "../grid/lattice";
import type { Agent } from "../memory/agent";
import type { Memory } from "../memory/memory";
import { agentColour, type Palette } from "../scene/palette";
import type { Identification, ObjectDetail, Vec3 } from "../wire";
import { h, say } from "./dom";
import { percent } from "./format";
import { drawModel } from "./object_model";

/** Hypotheses that are shown. */
const BARS_MAX = 5;

export class TouchPanel {
  readonly element = h("section", { class: "touch" });
  private readonly title = h("h3");
  private readonly bars = h("ul", { class: "bars" });
  private readonly model = h("canvas", { class: "model" });
  private readonly note = h("p", { class: "soft" });
  private drawing: { model: ObjectDetail; way: Vec3[]; colour: string; palette: Palette } | null =
    null;
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
    this.drawing =
      model === undefined
        ? null
        : {
            model,
            way: pathOnModel(agent, said),
            colour: agentColour(palette, agent.colour),
            palette,
          };
  }

  /** Turns the model on. */
  turn(): void {
    if (this.drawing !== null && !this.element.hidden) {
      const { model, way, colour, palette } = this.drawing;
      drawModel(this.model, model, way, colour, palette);
    }
  }

  private showBars(said: Identification | null, palette: Palette): void {
    const rows =
      said === null
        ? []
        : [
            ...said.objects.slice(0, BARS_MAX),
            { name: "none of these", probability: said.unknown },
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
