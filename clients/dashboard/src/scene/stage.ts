/** The scene: all layers of a memory, drawn when something changed. */

import { Scene, WebGLRenderer } from "three";
import type { Agent } from "../memory/agent";
import type { Memory, ShownEvent } from "../memory/memory";
import type { LiveSighting, Quat, RecalledPlace, Vec3 } from "../wire";
import { Bounds } from "./bounds";
import { Eye, type Insets, type ViewName } from "./camera";
import { Ellipsoids } from "./ellipsoids";
import { flashOf } from "./flashes";
import { Floor } from "./floor";
import { Frames } from "./frames";
import { Labels } from "./labels";
import { agentLabel, landmarkLabels, markLabels, recallLabels } from "./naming";
import { agentColour, PALETTES, rgb, type Palette } from "./palette";
import { Projection, type Picked } from "./picker";
import { Places, type PlaceColour } from "./places";
import { Rays } from "./rays";
import { Rings } from "./rings";
import { Solids } from "./solids";
import { Trails } from "./trails";
import { Trips } from "./trips";

/** An agent goes to its newest pose within about this time [s]. */
const SMOOTHING_S = 0.09;
/** A step longer than this is a leap, and shown as one [m]. */
const LEAP_M = 2;
/** Size of an agent: at least so much [m], and so many pixels. */
const AGENT_M = 0.16;
const AGENT_PX = 10;
const LANDMARK_PX = 5;

interface Shown {
  position: Vec3;
  rotation: Quat;
}

export interface Recalled {
  cue: Vec3;
  places: RecalledPlace[];
}

export class Stage {
  readonly eye: Eye;
  readonly frames = new Frames();
  palette: Palette = PALETTES.dark;
  /** The agent or place that was chosen. */
  selected: Picked | null = null;
  followed: string | null = null;
  recalled: Recalled | null = null;
  /** Positions of firing fields that are shown, and whose they are. */
  fields: { at: Vec3[]; radiusM: number; colour: string } | null = null;
  /** Time that is shown [s]; null for now. */
  time: number | null = null;

  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly floor = new Floor();
  private readonly trips = new Trips();
  private readonly trails = new Trails();
  private readonly rays = new Rays();
  private readonly solids = new Solids();
  private readonly ellipsoids = new Ellipsoids();
  private readonly rings = new Rings();
  private readonly labels: Labels;
  private places: Places | null = null;
  private placeColour: PlaceColour = "strength";
  private memory: Memory | null = null;
  private shown = new Map<string, Shown>();
  private width = 1;
  private height = 1;
  private insets: Insets = { left: 0, right: 0, top: 0, bottom: 0 };
  private isDirty = true;
  private lastMs = 0;
  private fitted = 0;
  private isTouched = false;
  private view: ViewName = "orbit";

  constructor(
    private readonly element: HTMLElement,
    canvas: HTMLCanvasElement,
    labels: HTMLCanvasElement,
  ) {
    this.renderer = new WebGLRenderer({
      canvas, antialias: true, alpha: true, premultipliedAlpha: true,
    });
    this.renderer.setClearAlpha(0);
    this.labels = new Labels(labels);
    this.eye = new Eye(element, () => this.invalidate());
    this.eye.controls.addEventListener("start", () => (this.isTouched = true));
    const layers = [
      this.floor.lines.mesh, this.trips.lines.mesh, this.trails.lines.mesh, this.ellipsoids.mesh,
      this.rays.lines.mesh, this.solids.mesh, this.rings.mesh,
    ];
    layers.forEach((layer, order) => {
      layer.renderOrder = 2 * order;
      this.scene.add(layer);
    });
    new ResizeObserver(() => this.resize()).observe(element);
    this.resize();
    requestAnimationFrame((ms) => this.frame(ms));
  }

  show(memory: Memory): void {
    this.memory = memory;
    this.shown.clear();
    this.selected = null;
    this.followed = null;
    this.recalled = null;
    this.fields = null;
    this.time = null;
    this.fitted = 0;
    this.isTouched = false;
    if (this.places !== null) {
      this.scene.remove(this.places.points);
    }
    this.places = new Places(memory.cloud);
    this.places.points.renderOrder = 3;
    this.scene.add(this.places.points);
    this.places.colour = this.placeColour;
    this.paint(this.palette);
  }

  paint(palette: Palette): void {
    this.palette = palette;
    this.places?.paint(palette);
    for (const { lines } of [this.trails, this.rays]) {
      lines.uniform("uGlow", 0.6 * palette.glow);
    }
    this.redrawTrips();
    this.invalidate();
  }

  colourPlaces(colour: PlaceColour): void {
    this.placeColour = colour;
    if (this.places !== null) {
      this.places.colour = colour;
    }
    this.invalidate();
  }

  /** Draws the next frame. */
  invalidate(): void {
    this.isDirty = true;
  }

  redrawTrips(): void {
    if (this.memory !== null) {
      const { trips, cloud, clock } = this.memory;
      this.trips.update(trips.values(), cloud, clock, this.palette);
    }
    this.invalidate();
  }

  look(view: ViewName): void {
    this.view = view;
    this.eye.show(view, this.bounds(), performance.now(), false);
    this.invalidate();
  }

  cover(insets: Insets): void {
    this.insets = insets;
    this.resize();
  }

  flash(event: ShownEvent): void {
    const where = (event.fields["translation_m"] as Vec3 | undefined)
      ?? this.shown.get(event.event.agent)?.position;
    const flash = where && flashOf(event.kind, where, this.palette, this.lastMs);
    if (flash) {
      this.rings.flash(flash);
    }
  }

  sight(sightings: LiveSighting[]): void {
    for (const sighting of sightings) {
      const agent = this.memory?.agents.get(sighting.agent);
      const colour = agentColour(this.palette, agent?.colour ?? 0);
      const other = sighting.target.agent !== undefined;
      this.rays.add(sighting.from_m, sighting.to_m, rgb(colour), other, performance.now());
    }
    this.invalidate();
  }

  pick(x: number, y: number): Picked | null {
    if (this.memory === null) {
      return null;
    }
    const projection = this.projection();
    const agents = [...this.shown].map(([name, { position }]) => ({ name, at: position }));
    const agent = projection.named(agents, "agent", x, y);
    if (agent !== null) {
      return { kind: "agent", name: agent };
    }
    const landmarks = this.memory.landmarks.map(({ id, translation_m }) => ({
      name: id, at: translation_m,
    }));
    const landmark = projection.named(landmarks, "landmark", x, y);
    if (landmark !== null) {
      return { kind: "landmark", name: landmark };
    }
    const row = projection.place(this.memory.cloud, this.until(), x, y);
    return row === null ? null : { kind: "place", id: this.memory.cloud.id[row]! };
  }

  /** The position in `map` that a pixel stands for: at the height of what the eye looks at. */
  positionAt(x: number, y: number): Vec3 | null {
    const z = this.eye.controls.target.z;
    return this.projection().onHeight(this.eye.camera, x, y, z);
  }

  projection(): Projection {
    return new Projection(this.eye.camera, this.width, this.height);
  }

  /** Where a position of `map` lies in the window [px]. */
  onScreen(at: Vec3): { x: number; y: number } | null {
    const seen = this.projection().at(at);
    const box = this.element.getBoundingClientRect();
    return seen && { x: seen.x + box.left, y: seen.y + box.top };
  }

  /** Where an agent is shown. */
  positionOf(name: string): Vec3 | null {
    return this.shown.get(name)?.position ?? null;
  }

  get drawCalls(): number {
    return this.renderer.info.render.calls;
  }

  get viewName(): ViewName {
    return this.view;
  }

  private until(): number {
    return this.time ?? Infinity;
  }

  private bounds(): Bounds {
    const bounds = new Bounds();
    const memory = this.memory;
    if (memory !== null && !memory.cloud.bounds.isEmpty) {
      bounds.include(...memory.cloud.bounds.min);
      bounds.include(...memory.cloud.bounds.max);
    }
    for (const { live } of memory?.agents.values() ?? []) {
      if (live.status !== "lost") {
        bounds.include(...live.translation_m);
      }
    }
    memory?.landmarks.forEach(({ translation_m }) => bounds.include(...translation_m));
    return bounds;
  }

  private resize(): void {
    this.width = Math.max(1, this.element.clientWidth);
    this.height = Math.max(1, this.element.clientHeight);
    const ratio = Math.min(window.devicePixelRatio, 2);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(this.width, this.height, false);
    this.labels.resize(this.width, this.height, ratio);
    this.eye.resize(this.width, this.height, this.insets);
    for (const { lines } of [this.floor, this.trips, this.trails, this.rays]) {
      lines.resize(this.width, this.height);
    }
    if (!this.isTouched && this.fitted > 0) {
      this.eye.show(this.view, this.bounds(), this.lastMs, true);
    }
    this.invalidate();
  }

  private frame(ms: number): void {
    requestAnimationFrame((next) => this.frame(next));
    const began = performance.now();
    const elapsed = Math.min(0.25, (ms - this.lastMs) / 1000);
    this.lastMs = ms;
    const moved = this.move(elapsed);
    this.eye.follow(this.followed === null ? null : this.positionOf(this.followed));
    const flown = this.eye.update(ms, elapsed);
    const isAlive = moved || flown || this.rings.hasFlashes || this.rays.isAlive(ms);
    if (this.isDirty || isAlive) {
      this.isDirty = false;
      this.draw(ms);
      this.frames.end(performance.now() - began);
    }
  }

  /** Brings agents to where they are, or were at the time that is shown. */
  private move(elapsedS: number): boolean {
    let moved = false;
    const agents = this.memory?.agents ?? new Map<string, Agent>();
    for (const name of this.shown.keys()) {
      if (!agents.has(name)) {
        this.shown.delete(name);
        moved = true;
      }
    }
    for (const [name, agent] of agents) {
      const past = this.time === null ? null : agent.track.before(this.time);
      if (this.time !== null && past === null) {
        moved = this.shown.delete(name) || moved;
        continue;
      }
      const goal: Shown = past ?? {
        position: agent.live.translation_m, rotation: agent.live.rotation_xyzw,
      };
      const now = this.shown.get(name);
      const step = now?.position.map((x, i) => goal.position[i]! - x) ?? [Infinity];
      const length = Math.hypot(...step);
      const isStill = length < 1e-4 && now !== undefined && alike(now.rotation, goal.rotation);
      if (isStill) {
        continue;
      }
      moved = true;
      if (now === undefined || length > LEAP_M) {
        this.shown.set(name, { position: [...goal.position], rotation: [...goal.rotation] });
        continue;
      }
      const part = 1 - Math.exp(-elapsedS / SMOOTHING_S);
      now.position = now.position.map((x, i) => x + part * step[i]!) as Vec3;
      now.rotation = between(now.rotation, goal.rotation, part);
    }
    return moved;
  }

  private draw(ms: number): void {
    const memory = this.memory;
    const palette = this.palette;
    if (memory === null || this.places === null) {
      return;
    }
    const bounds = this.bounds();
    this.fit(bounds);
    this.floor.update(bounds, palette);
    const pixel = this.eye.pixel(this.height);
    const now = this.time ?? memory.end;
    const distance = this.eye.camera.position.distanceTo(this.eye.controls.target);
    const ratio = this.renderer.getPixelRatio();
    const depth: [number, number] = [distance - bounds.radius, distance + 1.2 * bounds.radius];
    this.places.update(now, this.until(), pixel / ratio, ratio, depth);
    const marked = this.selected?.kind === "agent" ? this.selected.name : null;
    this.trails.update(memory.agents.values(), palette, marked);
    this.trails.lines.uniform("uNow", now);
    this.trips.lines.uniform("uNow", this.time ?? Infinity);
    this.drawThings(memory, ms, pixel, bounds.radius);
    this.renderer.render(this.scene, this.eye.camera);
    this.drawLabels(memory);
  }

  private drawThings(memory: Memory, ms: number, pixel: number, radiusM: number): void {
    const { palette, solids, ellipsoids, rings, rays } = this;
    const isLive = this.time === null;
    solids.begin(this.shown.size + memory.landmarks.length);
    ellipsoids.begin(this.shown.size + memory.landmarks.length);
    const nSteady = (this.recalled?.places.length ?? 0) + (this.fields?.at.length ?? 0)
      + 3 * this.shown.size + 8;
    rings.begin(ms, nSteady);
    rays.begin(ms);
    for (const { id, translation_m, covariance } of memory.landmarks) {
      const colour = rgb(palette.landmark);
      solids.add("pin", translation_m, [0, 0, 0, 1], colour, 0.04, LANDMARK_PX);
      ellipsoids.add(translation_m, covariance, radiusM / 3, colour, 0.3);
      if (this.selected?.kind === "landmark" && this.selected.name === id) {
        rings.add(mark(translation_m, rgb(palette.label), 11));
      }
    }
    for (const [name, { position, rotation }] of this.shown) {
      const agent = memory.agents.get(name)!;
      const colour = rgb(agentColour(palette, agent.colour));
      const status = isLive ? agent.live.status : "localized";
      const shape = { localized: "dart", uncertain: "octahedron", lost: "cube" } as const;
      solids.add(shape[status], position, rotation, colour, AGENT_M, AGENT_PX);
      rays.stem(position, this.floor.z, colour, ms);
      rings.add({
        centre: position, radiusM: 0, radiusPx: 26, colour, thickness: 1,
        alpha: palette.shade === "dark" ? 0.34 : 0.2,
      });
      if (isLive) {
        const limit = radiusM / 3;
        ellipsoids.add(position, agent.live.position_covariance_m2, limit, colour, 0.8);
        if (status !== "localized") {
          const beat = 0.75 + 0.25 * Math.sin(ms / 260);
          rings.add({ ...mark(position, rgb(palette.status[status]), 15), alpha: beat });
          this.invalidate();
        }
      }
      if (this.selected?.kind === "agent" && this.selected.name === name) {
        rings.add({ ...mark(position, rgb(palette.label), 19), alpha: 0.7 });
      }
    }
    if (this.selected?.kind === "place") {
      const at = memory.cloud.positionOf(this.selected.id);
      if (at !== null) {
        rings.add(mark(at, rgb(palette.label), 11));
      }
    }
    this.drawRecalled(ms);
    for (const at of this.fields?.at ?? []) {
      rings.add({
        centre: at, radiusM: this.fields!.radiusM, radiusPx: 3, thickness: 1, alpha: 0.5,
        colour: rgb(this.fields!.colour),
      });
    }
    solids.finish(pixel, palette.shade === "dark");
    ellipsoids.finish(0.5 * palette.glow);
    rings.finish(pixel, palette.glow);
    rays.finish();
  }

  private drawRecalled(ms: number): void {
    if (this.recalled === null) {
      return;
    }
    const { cue, places } = this.recalled;
    const colour = rgb(this.palette.recall);
    this.rings.add(mark(cue, colour, 6));
    this.rays.stem(cue, this.floor.z, colour, ms);
    places.forEach(({ place, confidence }, rank) => {
      const sure = confidence ?? 0.5;
      const alpha = 0.35 + 0.65 * sure;
      const at = place.translation_m;
      this.rings.add({ ...mark(at, colour, rank === 0 ? 10 : 6.5), alpha });
      this.rays.link(cue, at, colour, 0.25 + 0.5 * sure, ms);
    });
  }

  private drawLabels(memory: Memory): void {
    const projection = this.projection();
    const labels = markLabels(this.floor.marks(this.eye.camera.position), projection, this.palette);
    for (const [name, { position }] of this.shown) {
      const agent = memory.agents.get(name)!;
      const isMarked = this.selected?.kind === "agent" && this.selected.name === name;
      labels.push(...agentLabel(agent, position, this.time === null, isMarked, projection, this.palette));
    }
    labels.push(...landmarkLabels(memory.landmarks, projection, this.palette));
    if (this.recalled !== null) {
      labels.push(...recallLabels(this.recalled.places, projection, this.palette));
    }
    this.labels.draw(labels, this.palette);
  }

  /** Looks at all that there is, as long as nobody has chosen a view. */
  private fit(bounds: Bounds): void {
    if (this.isTouched || bounds.isEmpty || this.followed !== null) {
      return;
    }
    const grown = bounds.radius / Math.max(this.fitted, 1e-9);
    if (grown > 1.12 || grown < 0.8) {
      const isFirst = this.fitted === 0;
      this.fitted = bounds.radius;
      this.eye.show(this.view, bounds, this.lastMs, isFirst);
    }
  }
}

function mark(centre: Vec3, colour: [number, number, number], radiusPx: number) {
  return { centre, colour, radiusM: 0, radiusPx, alpha: 0.95, thickness: 0.02 };
}

function alike(a: Quat, b: Quat): boolean {
  return Math.abs(a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]) > 1 - 1e-7;
}

/** A rotation on the way from one to another. */
function between(a: Quat, b: Quat, part: number): Quat {
  const sign = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] < 0 ? -1 : 1;
  const mixed = a.map((x, i) => x + part * (sign * b[i]! - x));
  const norm = Math.hypot(...mixed);
  return mixed.map((x) => x / norm) as Quat;
}
