/** Which events flash, and how. */

import type { Vec3 } from "../wire";
import { rgb, type Palette } from "./palette";
import type { Flash } from "./rings";

/** Radius [px], alpha and duration [ms] of a flash. */
const FLASHES: Record<string, [number, number, number]> = {
  agent_placed: [90, 1, 2600],
  loops_closed: [64, 0.9, 1800],
  object_recognised: [70, 1, 2200],
  objects_merged: [70, 1, 2200],
  object_split: [70, 1, 2200],
  object_learned: [60, 0.9, 1800],
  landmark_learned: [34, 0.9, 1500],
  percept_surprising: [30, 0.8, 1200],
  place_entered: [17, 0.55, 800],
  place_recruited: [12, 0.7, 700],
  place_forgotten: [16, 0.7, 900],
  agent_enrolled: [50, 0.7, 1400],
};

export function flashOf(kind: string, centre: Vec3, palette: Palette, nowMs: number): Flash | null {
  const look = FLASHES[kind];
  const colour = palette.flash[kind];
  if (look === undefined || colour === undefined) {
    return null;
  }
  const [radiusPx, alpha, lastsMs] = look;
  return {
    centre,
    radiusM: 0,
    radiusPx,
    colour: rgb(colour),
    alpha,
    thickness: 0.06,
    beganMs: nowMs,
    lastsMs,
  };
}
