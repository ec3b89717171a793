/** An episode with an object: hypotheses as bars that narrow, and the contacts on the model. */

import { rotate } from "../grid/lattice";
import type { Agent } from "../memory/agent";
import type { Memory } from "../memory/memory";
import { agentColour, type Palette } from "../scene/palette";
import type { Contact, Identification, ObjectDetail, ObjectPose, Vec3 } from "../wire";
import { h, say } from "./dom";
import { percent } from "./format";
import { drawModel, type Felt } from "./object_model";

/** Hypotheses that are shown. */
const BARS_MAX = 5;

export class TouchPanel {
  readonly element = h("section", { class: "touch" });
  private readonly title = h("h3");
  private readonly bars = h("ul", { class: "bars" });
  private readonly model = h("canvas", { class: "model" });
  private readonly note = h("p", { class: "soft" });
  private drawing: { felt: Felt; palette: Palette } | null = null;
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
    const felt = this.feltOf(agent, said, memory, palette);
    this.drawing = felt && { felt, palette };
    this.model.hidden = felt === null;
    say(
      this.note,
      said === null ? "What is felt teaches an object; nothing is compared." : verdict(said),
    );
  }

  /** What is drawn of it. */
  get felt(): Felt | null {
    return this.element.hidden ? null : (this.drawing?.felt ?? null);
  }

  /** Turns the model on. */
  turn(): void {
    if (this.drawing !== null && !this.element.hidden) {
      drawModel(this.model, this.drawing.felt, this.drawing.palette);
    }
  }

  private showBars(said: Identification | null, palette: Palette): void {
    const rows =
      said === null
        ? []
        : [
            ...said.objects.slice(0, BARS_MAX),
            {
              name: said.objects.length === 0 ? "something unknown" : "none of these",
              probability: said.unknown,
            },
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

  /** The contacts on the model of the most probable object; by themselves where there is none. */
  private feltOf(
    { contacts, colour }: Agent,
    said: Identification | null,
    memory: Memory,
    palette: Palette,
  ): Felt | null {
    const pose = said?.pose ?? null;
    const best = said?.objects[0];
    // What is none of these is not drawn on one of them.
    const name = (best?.probability ?? 0) < (said?.unknown ?? 1) ? undefined : best!.name;
    const own = { nextTouch: null, colour: agentColour(palette, colour) };
    const model = name === undefined ? undefined : this.modelOf(name, memory);
    if (model === undefined) {
      return contacts.length === 0 ? null : { model: null, contacts, ...own };
    }
    if (pose?.object !== name || pose === null) {
      return { model, contacts: [], ...own };
    }
    const { next_touch } = said!;
    const next = next_touch && onObject({ ...next_touch, normal: null, levels: [] }, pose);
    return {
      model,
      contacts: contacts.map((contact) => onObject(contact, pose)),
      nextTouch: next?.position_m ?? null,
      colour: own.colour,
    };
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

/** A contact, in the frame of the object in which its episode's frame lies so. */
function onObject(contact: Contact, { translation_m, rotation_xyzw }: ObjectPose): Contact {
  const { position_m, normal } = contact;
  const turned = rotate(rotation_xyzw, position_m);
  return {
    ...contact,
    position_m: turned.map((x, i) => x + translation_m[i]!) as Vec3,
    normal: normal && rotate(rotation_xyzw, normal),
  };
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
