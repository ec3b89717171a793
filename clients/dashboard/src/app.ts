/** The page: it joins the memory of a space, the scene and the panels. */

import { Memory, type ShownEvent } from "./memory/memory";
import { AgentList } from "./panel/agent_list";
import { AgentPanel } from "./panel/agent_panel";
import { EventFeed } from "./panel/event_feed";
import { HealthStrip } from "./panel/health_strip";
import { Help } from "./panel/help";
import { Layout } from "./panel/layout";
import { Legend } from "./panel/legend";
import { Notice } from "./panel/notice";
import { PlacePanel } from "./panel/place_panel";
import { RecallPanel } from "./panel/recall_panel";
import { SpaceChooser } from "./panel/space_chooser";
import { Timeline } from "./panel/timeline";
import { Problem } from "./problem";
import type { ViewName } from "./scene/camera";
import { agentColour } from "./scene/palette";
import type { Picked } from "./scene/picker";
import type { PlaceColour } from "./scene/places";
import { Stage } from "./scene/stage";
import { Space, spaces } from "./service";
import { Theme } from "./theme";
import { token } from "./token";
import { firingFields } from "./grid/lattice";
import type { Connection } from "./stream";
import type { AgentDetail, GridState, SpaceInfo, Vec3 } from "./wire";

/** How often panels are filled, the grid state and the list of spaces are asked for [ms]. */
const PANELS_MS = 200;
const GRID_MS = 160;
const DETAIL_MS = 1000;
const SPACES_MS = 5000;
/** Places that recall asks for. */
const RECALLED = 8;
/** Firing fields are shown within this many spacings, and are this wide (σ of their cells). */
const FIELDS_SPACINGS = 2.1;
const FIELD_WIDTH = 0.24;

export class App {
  readonly stage: Stage;
  memory: Memory | null = null;
  private readonly layout: Layout;
  private readonly theme: Theme;
  private readonly chooser = new SpaceChooser((space) => this.open(space));
  private readonly health = new HealthStrip();
  private readonly agentList = new AgentList((name) => this.choose({ kind: "agent", name }));
  private readonly legend = new Legend((colour) => this.colourPlaces(colour));
  private readonly feed = new EventFeed();
  private readonly timeline = new Timeline(() => this.showTime());
  private readonly help = new Help();
  private readonly notice = new Notice((text) => this.useToken(text));
  private readonly agentPanel: AgentPanel;
  private readonly placePanel = new PlacePanel((at) => void this.recall(at));
  private readonly recallPanel: RecallPanel;
  private known: SpaceInfo[] = [];
  private placeColour: PlaceColour = "strength";
  private module: number | null = null;
  private grid: GridState | null = null;
  private detail: AgentDetail | null = null;
  /** The agent that was chosen last: it is asked what it would feel elsewhere. */
  private asked: string | null = null;
  private isAiming = false;
  private isRefining = false;
  private hasGreeted = false;
  private lastMs = performance.now();

  constructor() {
    this.agentPanel = new AgentPanel({
      follow: () => this.toggleFollow(),
      refine: () => void this.toggleRefined(),
      chooseModule: (module) => this.chooseModule(this.module === module ? null : module),
    });
    this.recallPanel = new RecallPanel({
      ask: (at) => void this.recall(at),
      aim: () => this.aim(!this.isAiming),
      close: () => this.closeRecall(),
      choose: (id) => this.choose({ kind: "place", id }),
    });
    this.layout = new Layout({
      chooser: this.chooser.element, health: this.health.element, agents: this.agentList.element,
      legend: this.legend.element, feed: this.feed.element, timeline: this.timeline.element,
      notice: this.notice.element, help: this.help.element,
      inspected: [this.agentPanel.element, this.placePanel.element, this.recallPanel.element],
    }, {
      look: (view) => this.look(view),
      recall: () => this.aim(!this.isAiming),
      theme: () => this.theme.toggle(),
      help: () => this.help.toggle(),
    });
    document.body.append(this.layout.element);
    this.stage = new Stage(this.layout.view, this.layout.canvas, this.layout.labels);
    this.theme = new Theme((palette) => {
      this.stage.paint(palette);
      this.fill();
    });
    this.layout.resized = () => this.stage.cover(this.layout.insets());
    this.stage.cover(this.layout.insets());
    this.inspect("none");
    this.listen();
    window.setInterval(() => this.fill(), PANELS_MS);
    window.setInterval(() => void this.askGrid(), GRID_MS);
    window.setInterval(() => void this.askDetail(), DETAIL_MS);
    window.setInterval(() => void this.askSpaces(), SPACES_MS);
    void this.askSpaces();
  }

  /** Shows a space. */
  open(name: string): void {
    this.memory?.close();
    this.feed.clear();
    this.grid = this.detail = this.asked = null;
    this.module = null;
    this.hasGreeted = false;
    this.timeline.time = null;
    const place = new URL(location.href);
    place.searchParams.set("space", name);
    history.replaceState(null, "", place);
    document.title = `${name} · cogmap`;
    this.memory = new Memory(new Space(name), {
      connectionChanged: (connection) => this.showConnection(connection),
      ticked: (_tick, events) => this.takeEvents(events),
      recounted: (events) => this.feed.add(events, this.memory!, this.stage.palette),
      sighted: (sightings) => {
        if (this.stage.time === null) {
          this.stage.sight(sightings);
        }
      },
      refreshed: () => this.stage.redrawTrips(),
      worked: (ms) => this.stage.frames.add(ms),
    });
    this.stage.show(this.memory);
    this.inspect("none");
    this.fill();
  }

  choose(picked: Picked | null): void {
    this.stage.selected = picked;
    this.stage.invalidate();
    if (picked?.kind === "agent") {
      if (this.asked !== picked.name) {
        this.grid = this.detail = null;
        this.stage.fields = null;
      }
      this.asked = picked.name;
      this.inspect("agent");
      void this.askGrid();
      void this.askDetail();
    } else if (picked?.kind === "place" && this.memory !== null) {
      const agent = this.memory.agents.get(this.asked ?? "") ?? this.memory.agents.values().next().value;
      const isWanted = (): boolean => this.stage.selected === picked;
      this.inspect("place");
      void this.placePanel.show(picked.id, this.memory, agent ?? null, isWanted);
    } else if (picked === null) {
      this.stage.followed = null;
      this.chooseModule(null);
      this.inspect(this.stage.recalled === null ? "none" : "recall");
    }
    this.fill();
  }

  /** Asks which places answer at a position, and draws them. */
  async recall(at: Vec3): Promise<void> {
    const memory = this.memory;
    if (memory === null) {
      return;
    }
    this.aim(false);
    this.inspect("recall");
    this.stage.recalled = { cue: at, places: [] };
    this.recallPanel.show(at, [], "Asking…");
    try {
      const places = await memory.space.recall(at, RECALLED);
      if (this.stage.recalled?.cue === at) {
        this.stage.recalled = { cue: at, places };
        const said = places.length === 0 ? "No place answers: nothing is remembered yet."
          : "Best first: confidence, distance, cosine of the grid codes.";
        this.recallPanel.show(at, places, said);
      }
    } catch (error) {
      this.recallPanel.show(at, [], Problem.from(error).message);
    }
    this.stage.invalidate();
  }

  private takeEvents(events: ShownEvent[]): void {
    const memory = this.memory;
    if (memory === null) {
      return;
    }
    this.health.note(memory);
    this.feed.add(events, memory, this.stage.palette);
    if (this.stage.time === null) {
      events.forEach((event) => this.stage.flash(event));
    }
    this.stage.invalidate();
    if (!this.hasGreeted && memory.agents.size > 0) {
      this.hasGreeted = true;
      // Where there is room, the first agent is chosen: its grid cells are worth a look.
      if (!this.layout.isNarrow && this.stage.selected === null) {
        const names = [...memory.agents.keys()].sort();
        this.choose({ kind: "agent", name: names[0]! });
      }
    }
  }

  private showConnection(connection: Connection): void {
    this.layout.connection(connection.state);
    this.sayNotice();
    this.stage.invalidate();
  }

  private sayNotice(): void {
    const memory = this.memory;
    if (memory === null || this.notice.tellConnection(memory.connection)) {
      return;
    }
    const isEmpty = memory.health !== null && memory.counts.agents === 0 && memory.counts.places === 0;
    if (isEmpty) {
      this.notice.tell("calm", "Nothing is remembered here yet",
        "The page fills as soon as a robot sends its first sample to this space. Try: cogmap demo");
    } else {
      this.notice.hide();
    }
  }

  private async askSpaces(): Promise<void> {
    try {
      this.known = await spaces();
    } catch (error) {
      const problem = Problem.from(error);
      if (this.memory === null) {
        const isRefused = problem.status === 401 || problem.status === 403;
        const state = isRefused ? "refused" : "reconnecting";
        this.layout.connection(state);
        this.notice.tellConnection({ state, problem });
      }
      return;
    }
    if (this.memory === null) {
      const asked = new URL(location.href).searchParams.get("space");
      const busiest = [...this.known].sort((a, b) => b.agents - a.agents || b.places - a.places)[0];
      const name = asked ?? busiest?.name;
      if (name === undefined) {
        this.layout.connection("live");
        this.notice.tell("calm", "There is no space yet",
          "A space is made when a robot sends its first sample. Try: cogmap demo");
      } else {
        this.open(name);
      }
    }
    this.chooser.update(this.known, this.memory?.space.name ?? null);
  }

  private useToken(text: string): void {
    token.set(text);
    const name = this.memory?.space.name;
    this.memory?.close();
    this.memory = null;
    this.notice.hide();
    if (name === undefined) {
      void this.askSpaces();
    } else {
      this.open(name);
      void this.askSpaces();
    }
  }

  private async askGrid(): Promise<void> {
    const memory = this.memory;
    const name = this.stage.selected?.kind === "agent" ? this.stage.selected.name : null;
    if (memory?.connection.state !== "live" || name === null || this.stage.time !== null) {
      return;
    }
    const grid = await memory.space.grid(name).catch(() => null);
    if (this.stage.selected?.kind === "agent" && this.stage.selected.name === name) {
      const began = performance.now();
      this.grid = grid;
      this.agentPanel.grid.show(grid);
      this.fillAgent();
      this.showFields();
      this.stage.frames.add(performance.now() - began);
    }
  }

  private async askDetail(): Promise<void> {
    const name = this.stage.selected?.kind === "agent" ? this.stage.selected.name : null;
    if (this.memory?.connection.state === "live" && name !== null) {
      this.detail = await this.memory.space.agent(name).catch(() => null);
    }
  }

  private chooseModule(module: number | null): void {
    this.module = module;
    this.showFields();
    this.fillAgent();
  }

  private showFields(): void {
    const picked = this.stage.selected;
    const agent = picked?.kind === "agent" ? this.memory?.agents.get(picked.name) : undefined;
    const module = this.module === null ? undefined : this.grid?.modules[this.module];
    if (agent === undefined || module === undefined || this.stage.time !== null) {
      this.stage.fields = null;
    } else {
      const spacing = module.spacing_m;
      const around = this.grid!.decoded_m;
      this.stage.fields = {
        at: firingFields(this.module!, module, around, FIELDS_SPACINGS * spacing),
        radiusM: FIELD_WIDTH * spacing,
        colour: agentColour(this.stage.palette, agent.colour),
      };
    }
    this.stage.invalidate();
  }

  private toggleFollow(): void {
    const picked = this.stage.selected;
    const name = picked?.kind === "agent" ? picked.name : null;
    this.stage.followed = this.stage.followed === name ? null : name;
    if (this.stage.followed !== null) {
      const at = this.stage.positionOf(this.stage.followed);
      if (at !== null) {
        this.stage.eye.approach(at, 7, performance.now());
      }
    }
    this.stage.invalidate();
    this.fill();
  }

  private async toggleRefined(): Promise<void> {
    const picked = this.stage.selected;
    const agent = picked?.kind === "agent" ? this.memory?.agents.get(picked.name) : undefined;
    if (agent === undefined) {
      return;
    }
    if (agent.refined !== null) {
      agent.refined = null;
    } else {
      this.isRefining = true;
      await this.memory!.refine(agent.name).catch(() => undefined);
      this.isRefining = false;
    }
    this.stage.invalidate();
    this.fill();
  }

  private colourPlaces(colour: PlaceColour): void {
    this.placeColour = colour;
    this.stage.colourPlaces(colour);
    this.fill();
  }

  private look(view: ViewName): void {
    this.stage.followed = null;
    this.stage.look(view);
    this.layout.showView(view);
  }

  private aim(isAiming: boolean): void {
    this.isAiming = isAiming;
    this.recallPanel.isAiming = isAiming;
    this.layout.aim(isAiming);
    if (isAiming) {
      this.inspect("recall");
      if (this.stage.recalled === null) {
        this.recallPanel.show(null, [], "Click a position in the map, or type one. A click is taken "
          + "at the height of what the eye looks at; on a place, at the place.");
      }
    }
  }

  private closeRecall(): void {
    this.aim(false);
    this.stage.recalled = null;
    this.choose(this.stage.selected);
    if (this.stage.selected === null) {
      this.inspect("none");
    }
  }

  private inspect(what: "agent" | "place" | "recall" | "none"): void {
    this.agentPanel.element.hidden = what !== "agent";
    this.placePanel.element.hidden = what !== "place";
    this.recallPanel.element.hidden = what !== "recall";
    this.layout.inspect(what !== "none");
  }

  private showTime(): void {
    this.stage.time = this.timeline.time;
    this.showFields();
    this.fill();
  }

  /** Fills the panels with what is known now. */
  private fill(): void {
    const began = performance.now();
    const memory = this.memory;
    this.timeline.advance((began - this.lastMs) / 1000);
    this.lastMs = began;
    if (memory === null) {
      return;
    }
    const { palette, selected, followed } = this.stage;
    const picked = selected?.kind === "agent" ? selected.name : null;
    this.sayNotice();
    this.health.update(memory, palette.strength[2]!);
    this.agentList.update(memory, palette, picked, followed);
    this.legend.update(memory, palette, this.placeColour);
    this.timeline.update(memory, palette);
    if (picked !== null && !memory.agents.has(picked)) {
      this.choose(null);
    }
    this.fillAgent();
    this.stage.frames.add(performance.now() - began);
  }

  private fillAgent(): void {
    const picked = this.stage.selected;
    const agent = picked?.kind === "agent" ? this.memory?.agents.get(picked.name) : undefined;
    if (agent !== undefined && this.memory !== null) {
      const isFollowed = this.stage.followed === agent.name;
      this.agentPanel.update(
        agent, this.detail, this.memory, this.stage.palette, isFollowed, this.module, this.isRefining);
    }
  }

  private listen(): void {
    let down: { x: number; y: number } | null = null;
    const { view } = this.layout;
    view.addEventListener("pointerdown", (event) => (down = { x: event.clientX, y: event.clientY }));
    view.addEventListener("pointerup", (event) => {
      const isClick = down !== null && Math.hypot(event.clientX - down.x, event.clientY - down.y) < 5;
      down = null;
      if (isClick && event.button === 0) {
        this.click(event.clientX, event.clientY);
      }
    });
    window.addEventListener("keydown", (event) => this.press(event));
  }

  private click(clientX: number, clientY: number): void {
    const box = this.layout.view.getBoundingClientRect();
    const [x, y] = [clientX - box.left, clientY - box.top];
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

  private press(event: KeyboardEvent): void {
    const target = event.target as HTMLElement;
    const isTyping = target.matches("input:not([type=range]), select");
    if (isTyping || event.ctrlKey || event.metaKey || event.altKey) {
      return;
    }
    const number = Number(event.key);
    const names = [...(this.memory?.agents.keys() ?? [])]
      .sort(new Intl.Collator("en", { numeric: true }).compare);
    const seconds = (event.shiftKey ? 10 : 1) * (event.key === "ArrowLeft" ? -1 : 1);
    const keys: Record<string, () => void> = {
      f: () => this.toggleFollow(),
      o: () => this.look("orbit"),
      t: () => this.look("top"),
      s: () => this.look("side"),
      r: () => this.aim(!this.isAiming),
      c: () => this.colourPlaces(this.placeColour === "strength" ? "age" : "strength"),
      g: () => this.nextModule(),
      l: () => this.timeline.goLive(),
      d: () => this.theme.toggle(),
      " ": () => this.timeline.toggle(),
      ArrowLeft: () => this.timeline.step(seconds),
      ArrowRight: () => this.timeline.step(seconds),
      Escape: () => (this.isAiming ? this.aim(false) : this.choose(null)),
      "?": () => this.help.toggle(),
    };
    const act = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (number >= 1 && names[number - 1] !== undefined) {
      this.choose({ kind: "agent", name: names[number - 1]! });
    } else if (act !== undefined && !(event.key === " " && target.matches("button"))) {
      event.preventDefault();
      act();
    }
  }

  private nextModule(): void {
    const n = this.grid?.modules.length ?? 0;
    const next = this.module === null ? 0 : this.module + 1;
    this.chooseModule(next < n ? next : null);
  }
}
