/** The scene: all layers of a memory, drawn when something changed. */

import { Scene, WebGLRenderer } from "three";
import type { Memory, ShownEvent } from "../memory/memory";
import type { LiveSighting, Vec3 } from "../wire";
import { Bounds } from "./bounds";
import { Eye, type Insets, type ViewName } from "./camera";
import { Floor } from "./floor";
import { noFocus, type Focus } from "./focus";
import { Frames } from "./frames";
import { Labels } from "./labels";
import { Movement } from "./movement";
import { agentLabel, landmarkLabels, markLabels, recallLabels } from "./naming";
import { agentColour, PALETTES, rgb, type Palette } from "./palette";
import { Projection, type Picked } from "./picker";
import { Places, type PlaceColour } from "./places";
import { Routes } from "./routes";
import { Things } from "./things";
import { Trails } from "./trails";
import { Trips } from "./trips";

/** The eye moves on when the map has grown or shrunk by these factors. */
const GROWN = 1.12;
const SHRUNK = 0.8;

export class Stage {
  readonly eye: Eye;
  readonly frames = new Frames();
  focus: Focus = noFocus();
  palette: Palette = PALETTES.dark;
  view: ViewName = "orbit";

  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly floor = new Floor();
  private readonly trips = new Trips();
  private readonly trails = new Trails();
  private readonly routes = new Routes();
  private readonly things = new Things();
  private readonly movement = new Movement();
  private readonly labels: Labels;
  private places: Places | null = null;
  private placeColour: PlaceColour = "strength";
  private memory: Memory | null = null;
  private width = 1;
  private height = 1;
  private insets: Insets = { left: 0, right: 0, top: 0, bottom: 0 };
  private isDirty = true;
  private lastMs = 0;
  /** Radius of the map that the eye was placed for [m]; 0 before it was. */
  private fitted = 0;
  /** Whether somebody has moved the eye. */
  private isTouched = false;

  constructor(
    private readonly element: HTMLElement,
    canvas: HTMLCanvasElement,
    labels: HTMLCanvasElement,
  ) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.setClearAlpha(0);
    this.labels = new Labels(labels);
    this.eye = new Eye(element, () => this.invalidate());
    this.eye.controls.addEventListener("start", () => (this.isTouched = true));
    const { ellipsoids, rays, solids, rings } = this.things;
    const lines = [this.floor, this.trips, this.trails, this.routes].map(
      (layer) => layer.lines.mesh,
    );
    [...lines, ellipsoids.mesh, rays.lines.mesh, solids.mesh, rings.mesh].forEach((mesh, order) => {
      mesh.renderOrder = 2 * order;
      this.scene.add(mesh);
    });
    new ResizeObserver(() => this.resize()).observe(element);
    this.resize();
    requestAnimationFrame((ms) => this.frame(ms));
  }

  show(memory: Memory): void {
    this.memory = memory;
    this.movement.poses.clear();
    this.focus = noFocus();
    this.fitted = 0;
    this.isTouched = false;
    if (this.places !== null) {
      this.scene.remove(this.places.points);
    }
    this.places = new Places(memory.cloud);
    // Between trips and trails.
    this.places.points.renderOrder = 3;
    this.scene.add(this.places.points);
    this.places.colour = this.placeColour;
    this.paint(this.palette);
  }

  paint(palette: Palette): void {
    this.palette = palette;
    this.places?.paint(palette);
    for (const { lines } of [this.trails, this.things.rays]) {
      lines.uniform("uGlow", 0.6 * palette.glow);
    }
    this.redrawTrips();
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
      this.trips.update(trips.trips.values(), cloud, clock, this.palette);
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
    const at = this.positionOf(event.event.agent) ?? undefined;
    this.things.flash(event, at, this.palette, this.lastMs);
    this.invalidate();
  }

  sight(sightings: LiveSighting[]): void {
    for (const sighting of sightings) {
      const agent = this.memory?.agents.get(sighting.agent);
      const colour = agentColour(this.palette, agent?.colour ?? 0);
      this.things.sight(sighting, rgb(colour), performance.now());
    }
    this.invalidate();
  }

  pick(x: number, y: number): Picked | null {
    if (this.memory === null) {
      return null;
    }
    const projection = this.projection();
    const agents = [...this.movement.poses].map(([name, { position }]) => ({ name, at: position }));
    const agent = projection.named(agents, "agent", x, y);
    if (agent !== null) {
      return { kind: "agent", name: agent };
    }
    const { landmarks, cloud } = this.memory;
    const points = landmarks.map(({ id, translation_m }) => ({ name: id, at: translation_m }));
    const landmark = projection.named(points, "landmark", x, y);
    if (landmark !== null) {
      return { kind: "landmark", name: landmark };
    }
    const row = projection.place(cloud, this.focus.time ?? Infinity, x, y);
    return row === null ? null : { kind: "place", id: cloud.id[row]! };
  }

  /** The position in `map` that a pixel stands for: at the height of what the eye looks at. */
  positionAt(x: number, y: number): Vec3 | null {
    const z = this.eye.controls.target.z;
    return this.projection().onHeight(this.eye.camera, x, y, z);
  }

  /** Where a position of `map` lies in the window [px]. */
  onScreen(at: Vec3): { x: number; y: number } | null {
    const seen = this.projection().at(at);
    const box = this.element.getBoundingClientRect();
    return seen && { x: seen.x + box.left, y: seen.y + box.top };
  }

  /** Where an agent is shown. */
  positionOf(name: string): Vec3 | null {
    return this.movement.poses.get(name)?.position ?? null;
  }

  get drawCalls(): number {
    return this.renderer.info.render.calls;
  }

  private projection(): Projection {
    return new Projection(this.eye.camera, this.width, this.height);
  }

  private bounds(): Bounds {
    const bounds = new Bounds();
    const memory = this.memory;
    if (memory !== null && !memory.cloud.bounds.isEmpty) {
      bounds.include(...memory.cloud.bounds.min);
      bounds.include(...memory.cloud.bounds.max);
    }
    for (const { live, isPlaced } of memory?.agents.values() ?? []) {
      if (isPlaced && live.status !== "lost") {
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
    for (const { lines } of [this.floor, this.trips, this.trails, this.routes, this.things.rays]) {
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
    const agents = this.memory?.agents ?? new Map();
    const moved = this.movement.advance(agents, this.focus.time, elapsed);
    const { followed } = this.focus;
    this.eye.follow(followed === null ? null : this.positionOf(followed));
    const flown = this.eye.update(ms, elapsed);
    const { rings, rays, isRestless } = this.things;
    const isAlive = moved || flown || isRestless || rings.hasFlashes || rays.isAlive(ms);
    if (this.isDirty || isAlive) {
      this.isDirty = false;
      this.draw(ms);
      this.frames.end(performance.now() - began);
    }
  }

  private draw(nowMs: number): void {
    const { memory, palette, focus } = this;
    if (memory === null || this.places === null) {
      return;
    }
    const bounds = this.bounds();
    this.fit(bounds);
    this.floor.update(bounds, palette);
    const pixel = this.eye.pixel(this.height);
    const now = focus.time ?? memory.end;
    const until = focus.time ?? Infinity;
    const distance = this.eye.camera.position.distanceTo(this.eye.controls.target);
    const ratio = this.renderer.getPixelRatio();
    const depth: [number, number] = [distance - bounds.radius, distance + 1.2 * bounds.radius];
    this.places.update(now, until, pixel / ratio, ratio, depth);
    const marked = focus.selected?.kind === "agent" ? focus.selected.name : null;
    this.trails.update(memory.agents.values(), palette, marked);
    this.trails.lines.uniform("uNow", now);
    this.trips.lines.uniform("uNow", until);
    const { poses } = this.movement;
    this.routes.update(memory, focus, poses, palette);
    const floorZ = this.floor.z;
    const radiusM = bounds.radius;
    this.things.draw({ memory, poses, focus, palette, nowMs, pixel, radiusM, floorZ });
    this.renderer.render(this.scene, this.eye.camera);
    this.drawLabels(memory);
  }

  private drawLabels(memory: Memory): void {
    const { palette, focus } = this;
    const projection = this.projection();
    const labels = markLabels(this.floor.marks(this.eye.camera.position), projection, palette);
    const isLive = focus.time === null;
    for (const [name, { position }] of this.movement.poses) {
      const agent = memory.agents.get(name)!;
      const isMarked = focus.selected?.kind === "agent" && focus.selected.name === name;
      labels.push(...agentLabel(agent, position, isLive, isMarked, projection, palette));
    }
    labels.push(...landmarkLabels(memory.landmarks, projection, palette));
    labels.push(...recallLabels(focus.recalled?.places ?? [], projection, palette));
    this.labels.draw(labels, palette);
  }

  /** Looks at all that there is, as long as nobody has moved the eye. */
  private fit(bounds: Bounds): void {
    if (this.isTouched || bounds.isEmpty || this.focus.followed !== null) {
      return;
    }
    const grown = bounds.radius / Math.max(this.fitted, 1e-9);
    if (grown > GROWN || grown < SHRUNK) {
      const isFirst = this.fitted === 0;
      this.fitted = bounds.radius;
      this.eye.show(this.view, bounds, this.lastMs, isFirst);
    }
  }
}
