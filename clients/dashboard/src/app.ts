/** The page: it joins the memory of a space, the scene and the panels. */

import { Inspector } from "./inspector";
import { followKeys } from "./keys";
import { Memory, type ShownEvent } from "./memory/memory";
import { AgentList } from "./panel/agent_list";
import { ChannelList } from "./panel/channel_list";
import { EventFeed } from "./panel/event_feed";
import { HealthStrip } from "./panel/health_strip";
import { Help } from "./panel/help";
import { Layout } from "./panel/layout";
import { Legend } from "./panel/legend";
import { ObjectList } from "./panel/object_list";
import { Notice } from "./panel/notice";
import { SpaceChooser } from "./panel/space_chooser";
import { Timeline } from "./panel/timeline";
import { Problem } from "./problem";
import type { ViewName } from "./scene/camera";
import type { PlaceColour } from "./scene/places";
import { Stage } from "./scene/stage";
import { Space, spaces } from "./service";
import type { Connection } from "./stream";
import { Theme } from "./theme";
import { token } from "./token";
import type { Vec3 } from "./wire";

/** How often panels are filled, and the spaces are asked for [ms]. */
const PANELS_MS = 200;
const SPACES_MS = 5000;
/** A pointer that moves farther than this between down and up is no click [px]. */
const CLICK_PX = 5;

export class App {
  readonly stage: Stage;
  memory: Memory | null = null;
  private readonly layout: Layout;
  private readonly theme: Theme;
  private readonly inspector = new Inspector(() => this.fill());
  private readonly chooser = new SpaceChooser((space) => this.open(space));
  private readonly health = new HealthStrip();
  private readonly agentList = new AgentList((name) =>
    this.inspector.choose({ kind: "agent", name }),
  );
  private readonly objects = new ObjectList((name) =>
    this.inspector.choose({ kind: "object", name }),
  );
  private readonly channels = new ChannelList();
  private readonly legend = new Legend((colour) => this.colourPlaces(colour));
  private readonly feed = new EventFeed();
  private readonly timeline = new Timeline(() => this.showTime());
  private readonly help = new Help();
  private readonly notice = new Notice((text) => this.useToken(text));
  private placeColour: PlaceColour = "strength";
  private hasGreeted = false;
  private lastMs = performance.now();

  constructor() {
    this.layout = new Layout(
      {
        chooser: this.chooser.element,
        health: this.health.element,
        agents: this.agentList.element,
        legend: this.legend.element,
        objects: this.objects.element,
        channels: this.channels.element,
        feed: this.feed.element,
        timeline: this.timeline.element,
        notice: this.notice.element,
        help: this.help.element,
        inspected: this.inspector.panels,
      },
      {
        look: (view) => this.look(view),
        recall: () => this.inspector.aim(!this.inspector.isAiming),
        theme: () => this.theme.toggle(),
        help: () => this.help.toggle(),
      },
    );
    document.body.append(this.layout.element);
    this.stage = new Stage(this.layout.view, this.layout.canvas, this.layout.labels);
    this.inspector.start(this.stage, this.layout);
    this.theme = new Theme((palette) => {
      this.stage.paint(palette);
      this.recount();
      this.fill();
    });
    this.layout.resized = () => this.stage.cover(this.layout.insets());
    this.layout.resized();
    this.followPointer();
    this.followKeys();
    window.setInterval(() => this.fill(), PANELS_MS);
    window.setInterval(() => void this.askSpaces(), SPACES_MS);
    void this.askSpaces();
  }

  /** What is drawn of the episode of the agent that was chosen. */
  get felt(): { object: string | null; contacts: Vec3[] } | null {
    return this.inspector.felt;
  }

  /** Shows a space. */
  open(name: string): void {
    this.memory?.close();
    this.feed.clear();
    this.hasGreeted = false;
    this.timeline.time = null;
    const place = new URL(location.href);
    place.searchParams.set("space", name);
    history.replaceState(null, "", place);
    document.title = `${name} · cogmap`;
    this.memory = new Memory(new Space(name), {
      connectionChanged: (connection) => this.showConnection(connection),
      ticked: (_tick, events) => this.takeEvents(events),
      recounted: () => this.recount(),
      sighted: (sightings) => {
        if (this.stage.focus.time === null) {
          this.stage.sight(sightings);
        }
      },
      refreshed: () => this.stage.redrawTrips(),
      worked: (ms) => this.stage.frames.add(ms),
    });
    this.stage.show(this.memory);
    this.inspector.open(this.memory);
    this.fill();
  }

  /** Tells all events anew. */
  private recount(): void {
    this.feed.clear();
    if (this.memory !== null) {
      this.feed.add(this.memory.events, this.memory, this.stage.palette);
    }
  }

  private takeEvents(events: ShownEvent[]): void {
    const memory = this.memory!;
    this.health.note(memory);
    this.feed.add(events, memory, this.stage.palette);
    if (this.stage.focus.time === null) {
      events.forEach((event) => this.stage.flash(event));
    }
    this.stage.invalidate();
    if (!this.hasGreeted && memory.agents.size > 0) {
      this.hasGreeted = true;
      // Where there is room, the first agent is chosen: its grid cells are worth a look.
      if (!this.layout.isNarrow && this.stage.focus.selected === null) {
        this.inspector.choose({ kind: "agent", name: memory.agentNames()[0]! });
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
    const isEmpty = memory.counts.agents === 0 && memory.counts.places === 0;
    if (memory.health !== null && isEmpty) {
      const how = "The page fills as soon as a robot sends its first sample. Try: cogmap demo";
      this.notice.tell("calm", "Nothing is remembered here yet", how);
    } else {
      this.notice.hide();
    }
  }

  private async askSpaces(): Promise<void> {
    try {
      const known = await spaces();
      if (this.memory === null) {
        const asked = new URL(location.href).searchParams.get("space");
        const busiest = [...known].sort((a, b) => b.agents - a.agents || b.places - a.places)[0];
        this.openFirst(asked ?? busiest?.name);
      }
      this.chooser.update(known, this.memory?.space.name ?? null);
    } catch (error) {
      const problem = Problem.from(error);
      if (this.memory === null) {
        const isRefused = problem.status === 401 || problem.status === 403;
        const state = isRefused ? "refused" : "reconnecting";
        this.layout.connection(state);
        this.notice.tellConnection({ state, problem });
      }
    }
  }

  private openFirst(name: string | undefined): void {
    if (name !== undefined) {
      this.open(name);
      return;
    }
    this.layout.connection("live");
    const how = "A space is made when a robot sends its first sample. Try: cogmap demo";
    this.notice.tell("calm", "There is no space yet", how);
  }

  private useToken(text: string): void {
    token.set(text);
    const name = this.memory?.space.name;
    this.memory?.close();
    this.memory = null;
    this.notice.hide();
    if (name !== undefined) {
      this.open(name);
    }
    void this.askSpaces();
  }

  private colourPlaces(colour: PlaceColour): void {
    this.placeColour = colour;
    this.stage.colourPlaces(colour);
    this.fill();
  }

  private look(view: ViewName): void {
    this.stage.focus.followed = null;
    this.stage.look(view);
    this.layout.showView(view);
  }

  private showTime(): void {
    this.stage.focus.time = this.timeline.time;
    this.inspector.showFields();
    this.fill();
  }

  /** Fills the panels with what is known now. */
  private fill(): void {
    const began = performance.now();
    const memory = this.memory;
    const elapsed = (began - this.lastMs) / 1000;
    this.lastMs = began;
    if (memory === null) {
      return;
    }
    this.timeline.advance(elapsed);
    const { palette, focus } = this.stage;
    const picked = focus.selected?.kind === "agent" ? focus.selected.name : null;
    this.sayNotice();
    this.health.update(memory, palette.strength[2]!);
    this.agentList.update(memory, palette, picked, focus.followed);
    this.legend.update(memory, palette, this.placeColour);
    this.objects.update(memory, focus.selected?.kind === "object" ? focus.selected.name : null);
    this.channels.update(memory);
    this.timeline.update(memory, palette);
    this.inspector.fill();
    this.stage.frames.add(performance.now() - began);
  }

  private followPointer(): void {
    let down: { x: number; y: number } | null = null;
    const { view } = this.layout;
    view.addEventListener("pointerdown", ({ clientX, clientY }) => {
      down = { x: clientX, y: clientY };
    });
    view.addEventListener("pointerup", ({ clientX, clientY, button }) => {
      const way = down === null ? Infinity : Math.hypot(clientX - down.x, clientY - down.y);
      down = null;
      if (way < CLICK_PX && button === 0) {
        const box = view.getBoundingClientRect();
        this.inspector.click(clientX - box.left, clientY - box.top);
      }
    });
  }

  private followKeys(): void {
    const { inspector, timeline } = this;
    followKeys({
      agent: (number) => {
        const name = this.memory?.agentNames()[number - 1];
        if (name !== undefined) {
          inspector.choose({ kind: "agent", name });
        }
      },
      follow: () => inspector.toggleFollow(),
      orbit: () => this.look("orbit"),
      top: () => this.look("top"),
      side: () => this.look("side"),
      recall: () => inspector.aim(!inspector.isAiming),
      colour: () => this.colourPlaces(this.placeColour === "strength" ? "age" : "strength"),
      module: () => inspector.nextModule(),
      play: () => timeline.toggle(),
      step: (seconds) => timeline.step(seconds),
      live: () => timeline.goLive(),
      theme: () => this.theme.toggle(),
      release: () => (inspector.isAiming ? inspector.aim(false) : inspector.choose(null)),
      help: () => this.help.toggle(),
    });
  }
}
