/** The ways of all agents, as lines that fade, in one draw call. */

import type { Agent } from "../memory/agent";
import type { Track } from "../memory/track";
import { Lines } from "./lines";
import { agentColour, rgb, type Palette } from "./palette";

/** Segments of all trails together, and the most of one. */
const SEGMENTS_MAX = 24_576;
const SEGMENTS_OF_ONE_MAX = 4096;
/** After this long a trail is as pale as it gets [s]. */
const FADE_S = 75;

interface Slot {
  track: Track;
  colour: string;
  width: number;
  first: number;
  /** Poses of the track that are drawn, and how often it was rewritten then. */
  drawn: number;
  rewrites: number;
}

export class Trails {
  readonly lines = new Lines({ fadeS: FADE_S, rest: 0.13 });
  private slots: Slot[] = [];
  private size = 0;
  private layout = "";

  /** Takes in the poses that came. */
  update(agents: Iterable<Agent>, palette: Palette, marked: string | null): void {
    const wanted: { track: Track; colour: string; width: number; key: string }[] = [];
    for (const agent of agents) {
      const colour = agentColour(palette, agent.colour);
      const width = agent.name === marked ? 2.8 : 1.9;
      wanted.push({ track: agent.track, colour, width, key: `${agent.name}${width}` });
      if (agent.refined !== null) {
        const refined = { track: agent.refined, colour: palette.label, width: 1.5 };
        wanted.push({ ...refined, key: `${agent.name}/refined${agent.refined.n}` });
      }
    }
    const layout = palette.shade + wanted.map(({ key }) => key).join();
    if (layout !== this.layout) {
      this.layout = layout;
      this.size = Math.min(
        SEGMENTS_OF_ONE_MAX,
        Math.floor(SEGMENTS_MAX / Math.max(1, wanted.length)),
      );
      const n = this.size * wanted.length;
      this.lines.reserve(n);
      for (let i = 0; i < n; i += 1) {
        this.lines.clear(i);
      }
      this.lines.count = n;
      this.slots = wanted.map(({ track, colour, width }, i) => ({
        track,
        colour,
        width,
        first: i * this.size,
        drawn: 0,
        rewrites: track.rewrites,
      }));
      this.lines.upload(0, n);
    }
    this.slots.forEach((slot) => this.extend(slot));
  }

  private extend(slot: Slot): void {
    const { track, first } = slot;
    const size = this.size;
    if (slot.rewrites !== track.rewrites) {
      slot.rewrites = track.rewrites;
      slot.drawn = 0;
    }
    if (slot.drawn === track.n) {
      return;
    }
    const begin = Math.max(slot.drawn, track.n - size);
    const colour = rgb(slot.colour);
    const from = [0, 0, 0];
    const to = [0, 0, 0];
    for (let i = begin; i < track.n; i += 1) {
      const at = first + (i % size);
      if (!track.isJoined(i)) {
        this.lines.clear(at);
        continue;
      }
      for (let axis = 0; axis < 3; axis += 1) {
        from[axis] = track.at(i - 1, axis);
        to[axis] = track.at(i, axis);
      }
      this.lines.set(at, from, to, colour, 0.95, slot.width, track.time(i - 1), track.time(i));
    }
    const low = begin % size;
    const n = track.n - begin;
    if (low + n <= size) {
      this.lines.upload(first + low, n);
    } else {
      this.lines.upload(first, size);
    }
    slot.drawn = track.n;
  }
}
