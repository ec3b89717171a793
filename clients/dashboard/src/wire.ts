/** What the service answers, in the terms of its own description (`/openapi.json`). */

import type { Int64 } from "./json";

export type Vec3 = [number, number, number];
/** Unit quaternion `[x, y, z, w]`. */
export type Quat = [number, number, number, number];
export type Status = "localized" | "uncertain" | "lost";

/** An agent in a tick of the live stream. */
export interface LiveAgent {
  name: string;
  session: Int64;
  seq: Int64;
  stamp_ns: Int64;
  status: Status;
  /** `map`; or `unplaced` while it is lost and nothing ties it to the map. */
  frame: string;
  translation_m: Vec3;
  rotation_xyzw: Quat;
  /** Upper triangle, row by row, along the axes of the frame [m²]. */
  position_covariance_m2: [number, number, number, number, number, number];
  rotation_sd_rad: Vec3;
  place: number | null;
  confidence: number;
  lag_samples: number;
  /** Contacts of the episode with an object under way; null where there is none. */
  contacts: number | null;
  /** Whether the latest sample of its session ended it. */
  session_ended: boolean;
  /** How long before the tick a message of it came; null if none has since the service started [s]. */
  heard_ago_s: number | null;
}

export interface EventRecord {
  id: string;
  event: {
    agent: string;
    map_revision: Int64;
    stamp_ns: Int64;
    kind: { [kind: string]: { [field: string]: unknown } };
  };
}

export interface LiveSighting {
  agent: string;
  stamp_ns: Int64;
  from_m: Vec3;
  to_m: Vec3;
  target: { landmark?: string; agent?: string };
}

export interface Counts {
  agents: number;
  places: number;
  trips: number;
  landmarks: number;
  objects: number;
}

export interface Health {
  samples_per_s: number | null;
  waiting_samples: number;
  not_durable_samples: number;
  dropped_messages: number;
  skipped_samples: number;
  duplicate_samples: number;
  resident_bytes: number | null;
}

export interface Tick {
  map_revision: Int64;
  agents: LiveAgent[];
  removed: string[];
  events: EventRecord[];
  missed: { events: number | null } | null;
  sightings: LiveSighting[];
  counts: Counts;
  health: Health;
}

export interface SpaceInfo {
  name: string;
  map_revision: Int64;
  agents: number;
  places: number;
  trips: number;
  landmarks: number;
}

export interface Place {
  id: number;
  translation_m: Vec3;
  position_sd_m: Vec3;
  visits: number;
  founder: string;
  first_stamp_ns: Int64;
  last_stamp_ns: Int64;
  strength: number;
}

export interface RecalledPlace {
  place: Place;
  cosine: number | null;
  confidence: number | null;
  distance_m: number | null;
}

export interface Landmark {
  id: string;
  translation_m: Vec3;
  covariance: [number, number, number, number, number, number];
  sightings: number;
}

export interface Trip {
  id: number;
  agent: string;
  start_stamp_ns: Int64;
  end_stamp_ns: Int64;
  ended: string | null;
  leg_count: number;
  length_m: number;
  strength: number;
  pinned: boolean;
}

export interface Leg {
  from: number;
  to: number;
  duration_s: number;
}

export interface StampedPose {
  stamp_ns: Int64;
  translation_m: Vec3;
  rotation_xyzw: Quat;
}

export interface Trajectory {
  session: Int64;
  poses: StampedPose[];
  next_from_ns: Int64 | null;
}

export interface GridModule {
  spacing_m: number;
  /** Lattice index of the reference grid point. */
  reference: Vec3;
  reference_m: Vec3;
  phase: Vec3;
  activation: number[];
  octant_activation: number;
}

export interface GridState {
  agent: string;
  stamp_ns: Int64;
  modules: GridModule[];
  decoded_m: Vec3;
  octant: number | null;
  displacement_m: number;
  turning_rad: number;
  heading_rad: number;
}

export interface AgentDetail {
  name: string;
  travelled_m: number;
  lag_samples: number;
  evidence: { accepted: number; refused: number; nis_mean: number | null };
  watermark: { durable: Int64; applied: Int64 };
}

/** What a place remembers of a channel. */
export interface RememberedPercept {
  channel: string;
  expected: { level?: { mean: number; sd: number }; descriptor?: { vector: number[] } };
  percepts: number;
  strength: number;
}

export interface PredictedPercept extends RememberedPercept {
  place: number;
  confidence: number;
}

/** What comes next after a place, by the trips of the team. */
export interface Sequence {
  next: { place: number; probability: number }[];
  others: number;
  none: number;
}

export interface Prediction {
  place: number | null;
  confidence: number;
  percepts: PredictedPercept[];
}

export interface ObjectSummary {
  name: string;
  places: number;
  spacing_m: number;
  min_m: Vec3;
  max_m: Vec3;
  contacts: number;
  visits: number;
}

export interface ObjectPlace {
  position_m: Vec3;
  normal: Vec3 | null;
  contacts: number;
  levels: { channel: string; mean: number; sd: number }[];
}

export interface ObjectDetail {
  summary: ObjectSummary;
  places: ObjectPlace[];
}

/** A contact with an object. */
export interface Contact {
  position_m: Vec3;
  /** The surface's outward normal, where it was felt. */
  normal: Vec3 | null;
  levels: { channel: string; value: number }[];
}

/** Where the frame of contacts lies in an object's. */
export interface ObjectPose {
  object: string;
  translation_m: Vec3;
  rotation_xyzw: Quat;
}

export interface Identification {
  verdict: { undecided?: object; object?: { name: string }; unknown?: object };
  objects: { name: string; probability: number }[];
  unknown: number;
  live_hypotheses: number;
  entropy_nats: number;
  contacts: number;
  pose: ObjectPose | null;
  next_touch: { position_m: Vec3; gain_nats: number } | null;
}

export interface AgentObject {
  episode: "learn" | "identify" | null;
  identification: Identification | null;
  last: {
    episode: "learn" | "identify";
    stamp_ns: Int64;
    identification: Identification | null;
  } | null;
  /** Contacts of the episode under way, in the frame of the body when it began. */
  contacts: Contact[];
}

/** A step of a route: where it leads. */
export interface RouteStep {
  place: number | null;
  translation_m: Vec3;
}

export interface Route {
  length_m: number;
  duration_s: number;
  sd_m: number;
  steps: RouteStep[];
}

/** What is left of the route that an agent follows. */
export interface FollowedRoute {
  agent: string;
  length_m: number;
  duration_s: number;
  steps: RouteStep[];
}

/** What is left of it, without the steps. */
export interface FollowedSummary {
  agent: string;
  length_m: number;
  duration_s: number;
  steps_left: number;
}

/** A place, the way between two, or a ball, across which no route leads. */
export interface Blockage {
  id: number;
  place: number | null;
  from: number | null;
  to: number | null;
  at_m: Vec3 | null;
  radius_m: number | null;
}

export interface Channel {
  name: string;
  kind: "level" | "descriptor";
  views: number | null;
  learned: {
    range_m: number;
    information_nats: number;
    independence: number;
    turned: number[];
    coarse: boolean;
  } | null;
  compass: {
    rad_per_unit: number;
    offset_rad: number;
    lasting_sd_rad: number;
    noise_sd_rad: number;
    agent: string | null;
  } | null;
}
