/** What was chosen, in detail: an agent, a place, or what a position recalls. */

import { firingFields } from "./grid/lattice";
import type { Agent } from "./memory/agent";
import type { Memory } from "./memory/memory";
import { AgentPanel } from "./panel/agent_panel";
import type { Layout } from "./panel/layout";
import { ObjectPanel } from "./panel/object_panel";
import { nearest, PlacePanel, routeInWords } from "./panel/place_panel";
import { RecallPanel } from "./panel/recall_panel";
import { Problem } from "./problem";
import { agentColour } from "./scene/palette";
import type { Picked } from "./scene/picker";
import type { Stage } from "./scene/stage";
import type { AgentDetail, GridState, Vec3 } from "./wire";

/** How often the grid state and the detail of an agent are asked for [ms]. */
const GRID_MS = 160;
const DETAIL_MS = 1000;
/** How often a model turns on [ms]. */
const TURN_MS = 50;
/** Places that recall asks for. */
const RECALLED = 8;
/** Firing fields are shown within this many spacings; this part of a spacing is their radius. */
const FIELDS_SPACINGS = 2.1;
const FIELD_RADIUS = 0.24;
/** How near the eye goes to an agent that it follows [m]. */
const FOLLOW_M = 7;

export class Inspector {
  readonly panels: HTMLElement[];
  isAiming = false;
  private readonly agentPanel: AgentPanel;
  private readonly placePanel = new PlacePanel({
    recall: (at) => void this.recall(at),
    route: (place, agent) => void this.route(place, agent),
    choose: (id) => this.choose({ kind: "place", id }),
    close: () => this.choose(null),
  });
  private readonly objectPanel = new ObjectPanel(() => this.choose(null));
  private readonly recallPanel: RecallPanel;
  private memory: Memory | null = null;
  private module: number | null = null;
  private grid: GridState | null = null;
  private detail: AgentDetail | null = null;
  /** The agent that was chosen last: what is known of it holds for no other. */
  private lastAgent: string | null = null;
  private isRefining = false;
  private stage!: Stage;
  private layout!: Layout;

  /** @param changed - Called when something else is chosen. */
  constructor(private readonly changed: () => void) {
    this.agentPanel = new AgentPanel({
      follow: () => this.toggleFollow(),
      refine: () => void this.toggleRefined(),
      close: () => this.choose(null),
      chooseModule: (module) => this.chooseModule(this.module === module ? null : module),
    });
    this.recallPanel = new RecallPanel({
      ask: (at) => void this.recall(at),
      aim: () => this.aim(!this.isAiming),
      close: () => this.closeRecall(),
      choose: (id) => this.choose({ kind: "place", id }),
    });
    this.panels = Object.values(this.shown).map(({ element }) => element);
  }

  /** Begins, once there are a scene and a page. */
  start(stage: Stage, layout: Layout): void {
    [this.stage, this.layout] = [stage, layout];
    this.inspect("none");
    window.setInterval(() => void this.askGrid(), GRID_MS);
    window.setInterval(() => void this.askDetail(), DETAIL_MS);
    window.setInterval(() => this.turn(), TURN_MS);
  }

  open(memory: Memory): void {
    this.memory = memory;
    this.grid = this.detail = this.lastAgent = this.module = null;
    this.inspect("none");
  }

  choose(picked: Picked | null): void {
    const focus = this.stage.focus;
    focus.selected = picked;
    focus.route = null;
    if (picked?.kind === "agent") {
      if (this.lastAgent !== picked.name) {
        this.grid = this.detail = focus.fields = null;
      }
      this.lastAgent = picked.name;
      if (this.memory !== null) {
        this.memory.wayfinding.chosen = picked.name;
      }
      this.inspect("agent");
      const agent = this.agent;
      if (agent !== null && agent.touch === null) {
        void this.memory?.askTouch(agent);
      }
      void this.askGrid();
      void this.askDetail();
    } else if (picked?.kind === "place" && this.memory !== null) {
      const isWanted = (): boolean => this.stage.focus.selected === picked;
      this.inspect("place");
      this.placePanel.propose(this.memory.agentNames(), this.starter(picked.id)?.name ?? null);
      void this.placePanel.show(picked.id, this.memory, this.stage.palette, isWanted);
    } else if (picked?.kind === "object" && this.memory !== null) {
      this.inspect("object");
      void this.objectPanel.show(picked.name, this.memory);
    } else if (picked === null) {
      focus.followed = null;
      this.chooseModule(null);
      this.inspect(focus.recalled === null ? "none" : "recall");
    }
    this.stage.invalidate();
    this.changed();
  }

  /** Takes a click on the picture: on something, or as a position to recall by. */
  click(x: number, y: number): void {
    const picked = this.stage.pick(x, y);
    if (!this.isAiming) {
      this.choose(picked);
      return;
    }
    const place = picked?.kind === "place" ? this.memory?.cloud.positionOf(picked.id) : null;
    const at = place ?? this.stage.positionAt(x, y);
    if (at !== null) {
      void this.recall(at);
    }
  }

  /** Asks which places answer at a position, and draws them. */
  async recall(at: Vec3): Promise<void> {
    const memory = this.memory;
    if (memory === null) {
      return;
    }
    this.aim(false);
    this.inspect("recall");
    const focus = this.stage.focus;
    focus.recalled = { cue: at, places: [] };
    this.recallPanel.show(at, [], "Asking…");
    try {
      const places = await memory.space.recall(at, RECALLED);
      if (focus.recalled?.cue === at) {
        focus.recalled = { cue: at, places };
        const said =
          places.length === 0
            ? "No place answers: nothing is remembered yet."
            : "Best first: confidence, distance, cosine of the grid codes.";
        this.recallPanel.show(at, places, said);
      }
    } catch (error) {
      this.recallPanel.show(at, [], Problem.from(error).message);
    }
    this.stage.invalidate();
  }

  /** The agent that a route to a place begins at, if nobody says otherwise: the one that was chosen
   * last if it knows where it is, or else the nearest one that does. */
  private starter(place: number): Agent | null {
    const memory = this.memory;
    const at = memory?.cloud.positionOf(place) ?? null;
    const last = memory?.agents.get(this.lastAgent ?? "");
    if (last !== undefined && last.live.status !== "lost") {
      return last;
    }
    return memory === null || at === null ? null : nearest(memory, at);
  }

  /** Asks for a route to a place, from an agent. */
  private async route(place: number, agent: string | null): Promise<void> {
    const memory = this.memory;
    const name = agent ?? this.starter(place)?.name;
    if (memory === null || name === undefined) {
      this.placePanel.route = "No agent knows where it is.";
      return;
    }
    const selected = this.stage.focus.selected;
    try {
      const route = await memory.space.route(name, place);
      if (this.stage.focus.selected === selected) {
        const steps = route.steps.map(({ translation_m }) => translation_m);
        this.stage.focus.route = { agent: name, steps };
        this.placePanel.route = routeInWords(name, route);
      }
    } catch (error) {
      if (this.stage.focus.selected === selected) {
        this.stage.focus.route = null;
        this.placePanel.route = Problem.from(error).message;
      }
    }
    this.stage.invalidate();
  }

  aim(isAiming: boolean): void {
    this.isAiming = isAiming;
    this.recallPanel.isAiming = isAiming;
    this.layout.aim(isAiming);
    if (isAiming) {
      this.inspect("recall");
      if (this.stage.focus.recalled === null) {
        const how =
          "Click a position in the map, or type one. A click on a place is taken at the place, " +
          "any other at the height of what the eye looks at.";
        this.recallPanel.show(null, [], how);
      }
    }
  }

  /** The object that a model is drawn of, and the contacts on it. */
  get felt(): { object: string | null; contacts: Vec3[] } | null {
    const felt = this.agent === null ? null : this.agentPanel.touch.felt;
    const contacts = felt?.contacts.map(({ position_m }) => position_m);
    return contacts === undefined ? null : { object: felt?.model?.summary.name ?? null, contacts };
  }

  toggleFollow(): void {
    const focus = this.stage.focus;
    const name = this.agent?.name ?? null;
    focus.followed = focus.followed === name ? null : name;
    const at = focus.followed === null ? null : this.stage.positionOf(focus.followed);
    if (at !== null) {
      this.stage.eye.approach(at, FOLLOW_M, performance.now());
    }
    this.stage.invalidate();
    this.changed();
  }

  /** Shows the firing fields of the next module, and of none after the last. */
  nextModule(): void {
    const n = this.grid?.modules.length ?? 0;
    const next = this.module === null ? 0 : this.module + 1;
    this.chooseModule(next < n ? next : null);
  }

  /** Shows the firing fields of now; the grid states of the past are not known. */
  showFields(): void {
    const focus = this.stage.focus;
    const agent = this.agent;
    const module = this.module === null ? undefined : this.grid?.modules[this.module];
    focus.fields = null;
    if (agent !== null && module !== undefined && focus.time === null) {
      const spacing = module.spacing_m;
      const around = this.grid!.decoded_m;
      focus.fields = {
        at: firingFields(this.module!, module, around, FIELDS_SPACINGS * spacing),
        radiusM: FIELD_RADIUS * spacing,
        colour: agentColour(this.stage.palette, agent.colour),
      };
    }
    this.stage.invalidate();
  }

  /** Fills the panel of the chosen agent with what is known now. */
  fill(): void {
    const { focus, palette } = this.stage;
    const agent = this.agent;
    if (agent !== null && this.memory !== null) {
      const isFollowed = focus.followed === agent.name;
      const shown = { isFollowed, module: this.module, isRefining: this.isRefining };
      this.agentPanel.update(agent, this.detail, this.memory, palette, shown);
    } else if (focus.selected?.kind === "agent") {
      this.choose(null);
    }
  }

  private turn(): void {
    const kind = this.stage.focus.selected?.kind;
    if (kind === "object") {
      this.objectPanel.draw(this.stage.palette);
    } else if (kind === "agent") {
      this.agentPanel.touch.turn();
    } else if (kind === "place") {
      this.placePanel.draw(this.stage.palette);
    }
  }

  private get agent(): Agent | null {
    const selected = this.stage.focus.selected;
    const name = selected?.kind === "agent" ? selected.name : "";
    return this.memory?.agents.get(name) ?? null;
  }

  private get shown() {
    return {
      agent: this.agentPanel,
      place: this.placePanel,
      object: this.objectPanel,
      recall: this.recallPanel,
    };
  }

  private inspect(what: "agent" | "place" | "object" | "recall" | "none"): void {
    for (const [name, { element }] of Object.entries(this.shown)) {
      element.hidden = name !== what;
    }
    this.layout.inspect(what !== "none");
  }

  private closeRecall(): void {
    this.aim(false);
    this.stage.focus.recalled = null;
    this.choose(this.stage.focus.selected);
  }

  private chooseModule(module: number | null): void {
    this.module = module;
    this.showFields();
    this.fill();
  }

  private async toggleRefined(): Promise<void> {
    const agent = this.agent;
    if (agent === null || this.memory === null) {
      return;
    }
    if (agent.refined !== null) {
      agent.refined = null;
    } else {
      this.isRefining = true;
      await this.memory.refine(agent.name).catch(() => undefined);
      this.isRefining = false;
    }
    this.stage.invalidate();
    this.fill();
  }

  private async askGrid(): Promise<void> {
    const agent = this.agent;
    if (this.memory?.connection.state !== "live" || agent === null) {
      return;
    }
    if (this.stage.focus.time !== null) {
      return;
    }
    const grid = await this.memory.space.grid(agent.name).catch(() => null);
    if (this.agent === agent) {
      const began = performance.now();
      this.grid = grid;
      this.agentPanel.grid.show(grid);
      this.fill();
      this.showFields();
      this.stage.frames.add(performance.now() - began);
    }
  }

  private async askDetail(): Promise<void> {
    const agent = this.agent;
    if (this.memory?.connection.state === "live" && agent !== null) {
      this.detail = await this.memory.space.agent(agent.name).catch(() => null);
    }
  }
}
