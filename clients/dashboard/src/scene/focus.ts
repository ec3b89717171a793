/** What the scene is about: what was chosen, asked for, and when. */

import type { RecalledPlace, Vec3 } from "../wire";
import type { Picked } from "./picker";

export interface Recalled {
  cue: Vec3;
  places: RecalledPlace[];
}

/** Where the active cells of a grid module fire. */
export interface Fields {
  at: Vec3[];
  radiusM: number;
  colour: string;
}

/** A route that was asked for: an agent, and the positions after it. */
export interface AskedRoute {
  agent: string;
  steps: Vec3[];
}

export interface Focus {
  /** The agent, landmark or place that was chosen. */
  selected: Picked | null;
  /** The agent that stays in the middle. */
  followed: string | null;
  recalled: Recalled | null;
  route: AskedRoute | null;
  fields: Fields | null;
  /** Time that is shown [s]; null for now. */
  time: number | null;
}

export function noFocus(): Focus {
  return { selected: null, followed: null, recalled: null, route: null, fields: null, time: null };
}
