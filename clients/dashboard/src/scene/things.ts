/** Agents and landmarks with their uncertainty, marks, sightings and flashes. */

import type { Memory, ShownEvent } from "../memory/memory";
import { blockedAt } from "../memory/wayfinding";
import type { TrackPose } from "../memory/track";
import type { LiveSighting, Status, Vec3 } from "../wire";
import { Ellipsoids } from "./ellipsoids";
import { flashOf } from "./flashes";
import type { Focus } from "./focus";
import { agentColour, rgb, type Palette, type Rgb } from "./palette";
import { Rays } from "./rays";
import { Rings, type Ring } from "./rings";
import { Solids, type Shape } from "./solids";

/** Size of an agent: at least so much [m], and so many pixels. */
const AGENT_M = 0.16;
const AGENT_PX = 10;
const PAST_SIZE = 0.75;
const LANDMARK_M = 0.04;
const LANDMARK_PX = 5;
/** Blockages that are shown. */
const BLOCKAGES_MAX = 64;
/** The shape says how an agent is localised. */
const SHAPES: Record<Status, Shape> = { localized: "dart", uncertain: "octahedron", lost: "cube" };

/** What a drawing is made of. */
export interface Drawing {
  memory: Memory;
  poses: ReadonlyMap<string, TrackPose>;
  focus: Focus;
  palette: Palette;
  nowMs: number;
  /** Size of a pixel at distance one. */
  pixel: number;
  /** Half of the diagonal of the map [m]. */
  radiusM: number;
  floorZ: number;
}

export class Things {
  readonly solids = new Solids();
  readonly ellipsoids = new Ellipsoids();
  readonly rings = new Rings();
  readonly rays = new Rays();
  /** Whether something of it moves by itself. */
  isRestless = false;

  flash(event: ShownEvent, agentAt: Vec3 | undefined, palette: Palette, nowMs: number): void {
    const where = (event.fields["translation_m"] as Vec3 | undefined) ?? agentAt;
    const flash = where && flashOf(event.kind, where, palette, nowMs);
    if (flash) {
      this.rings.flash(flash);
    }
  }

  sight({ from_m, to_m, target }: LiveSighting, colour: Rgb, nowMs: number): void {
    this.rays.add(from_m, to_m, colour, target.agent !== undefined, nowMs);
  }

  draw(drawing: Drawing): void {
    const { memory, poses, focus, palette, nowMs, pixel } = drawing;
    const n = poses.size + memory.landmarks.length;
    const nPoints = (focus.recalled?.places.length ?? 0) + (focus.fields?.at.length ?? 0);
    this.isRestless = false;
    this.solids.begin(n);
    this.ellipsoids.begin(n);
    this.rings.begin(nowMs, 3 * n + nPoints + BLOCKAGES_MAX + 4);
    this.rays.begin(nowMs);
    this.drawLandmarks(drawing);
    for (const [name, pose] of poses) {
      this.drawAgent(name, pose, drawing);
    }
    this.drawMarks(drawing);
    this.solids.finish(pixel, palette.shade === "dark");
    this.ellipsoids.finish(0.5 * palette.glow);
    this.rings.finish(pixel, palette.glow);
    this.rays.finish();
  }

  private drawLandmarks({ memory, focus, palette, radiusM }: Drawing): void {
    const colour = rgb(palette.landmark);
    for (const { id, translation_m, covariance } of memory.landmarks) {
      this.solids.add("pin", translation_m, [0, 0, 0, 1], colour, LANDMARK_M, LANDMARK_PX);
      this.ellipsoids.add(translation_m, covariance, radiusM / 3, colour, 0.3);
      if (focus.selected?.kind === "landmark" && focus.selected.name === id) {
        this.rings.add(mark(translation_m, rgb(palette.label), 11));
      }
    }
  }

  private drawAgent(name: string, { position, rotation }: TrackPose, drawing: Drawing): void {
    const { memory, focus, palette, nowMs, radiusM, floorZ } = drawing;
    const agent = memory.agents.get(name)!;
    const colour = rgb(agentColour(palette, agent.colour));
    // Trajectories do not say how an agent was localised: it is a smaller, paler dart.
    const isLive = focus.time === null;
    const status = isLive ? agent.live.status : "localized";
    const paint = isLive ? colour : mixed(colour, rgb(palette.grid));
    const size = isLive ? 1 : PAST_SIZE;
    this.solids.add(SHAPES[status], position, rotation, paint, size * AGENT_M, size * AGENT_PX);
    this.rays.stem(position, floorZ, colour, nowMs);
    const alpha = palette.shade === "dark" ? 0.34 : 0.2;
    this.rings.add({ ...mark(position, colour, 26), thickness: 1, alpha });
    if (isLive) {
      const covariance = agent.live.position_covariance_m2;
      this.ellipsoids.add(position, covariance, radiusM / 3, colour, 0.8);
    }
    if (status !== "localized") {
      const beat = 0.75 + 0.25 * Math.sin(nowMs / 260);
      this.rings.add({ ...mark(position, rgb(palette.status[status]), 15), alpha: beat });
      this.isRestless = true;
    }
    if (focus.selected?.kind === "agent" && focus.selected.name === name) {
      this.rings.add({ ...mark(position, rgb(palette.label), 19), alpha: 0.7 });
    }
  }

  private drawMarks({ memory, focus, palette, nowMs, floorZ }: Drawing): void {
    const { selected, recalled, fields } = focus;
    const at = selected?.kind === "place" ? memory.cloud.positionOf(selected.id) : null;
    if (at !== null) {
      this.rings.add(mark(at, rgb(palette.label), 11));
    }
    const red = rgb(palette.status.lost);
    for (const blockage of memory.wayfinding.blockages.slice(0, BLOCKAGES_MAX)) {
      const centre = focus.time === null ? blockedAt(blockage, memory.cloud) : null;
      if (centre !== null) {
        const radiusM = blockage.radius_m ?? 0;
        this.rings.add({ ...mark(centre, red, 9), radiusM, thickness: 0.05 });
      }
    }
    for (const centre of fields?.at ?? []) {
      const { radiusM, colour } = fields!;
      this.rings.add({ ...mark(centre, rgb(colour), 3), radiusM, thickness: 1, alpha: 0.5 });
    }
    if (recalled === null) {
      return;
    }
    const colour = rgb(palette.recall);
    this.rings.add(mark(recalled.cue, colour, 6));
    this.rays.stem(recalled.cue, floorZ, colour, nowMs);
    recalled.places.forEach(({ place, confidence }, rank) => {
      const sure = confidence ?? 0.5;
      const ring = mark(place.translation_m, colour, rank === 0 ? 10 : 6.5);
      this.rings.add({ ...ring, alpha: 0.35 + 0.65 * sure });
      this.rays.link(recalled.cue, place.translation_m, colour, 0.25 + 0.5 * sure, nowMs);
    });
  }
}

/** The colour halfway between two. */
function mixed(a: Rgb, b: Rgb): Rgb {
  return a.map((x, i) => (x + b[i]!) / 2) as Rgb;
}

function mark(centre: Vec3, colour: Rgb, radiusPx: number): Ring {
  return { centre, colour, radiusM: 0, radiusPx, alpha: 0.95, thickness: 0.02 };
}
