//! Answers of the HTTP interface.

use serde::{Deserialize, Serialize};

use crate::estimate::Estimate;
use crate::event::TripEnd;
use crate::settings::SpaceSettings;
use crate::watermark::Watermark;

/// Error answer after RFC 9457 (`application/problem+json`).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Problem {
    /// Kind of the problem, `/problems/{kind}`; stable, for programs.
    #[serde(rename = "type")]
    pub kind: String,
    /// The same for people.
    pub title: String,
    /// HTTP status.
    pub status: u16,
    /// What was wrong this time.
    pub detail: String,
}

/// The spaces of the service.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct SpaceList {
    /// The spaces, by name.
    pub spaces: Vec<SpaceInfo>,
}

/// A space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct SpaceInfo {
    /// Name.
    pub name: String,
    /// Settings, as fixed on creation.
    pub settings: SpaceSettings,
    /// Number of records that the map includes.
    pub map_revision: u64,
    /// Digest of the map's state: equal digests, equal maps.
    pub digest: String,
    /// Number of agents.
    pub agents: u64,
    /// Number of places.
    pub places: u64,
    /// Number of trips.
    pub trips: u64,
    /// Number of landmarks.
    pub landmarks: u64,
}

/// One page of agents.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct AgentPage {
    /// The agents, by name.
    pub agents: Vec<AgentSummary>,
    /// Pass as `after` for the next page; absent on the last one.
    pub next: Option<String>,
}

/// An agent in a list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct AgentSummary {
    /// Name.
    pub name: String,
    /// Its latest estimate; absent before its first motion, sighting or start pose.
    pub estimate: Option<Estimate>,
    /// Whether the latest sample of its session ended it.
    #[serde(default)]
    pub session_ended: bool,
    /// How long ago the service received a message of it \[s\]; null before the first one since the
    /// service started, and from a node that follows the space.
    #[serde(default)]
    pub heard_ago_s: Option<f64>,
}

/// An agent: where it is, how sure that is, and how far its samples have come.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct AgentDetail {
    /// Name.
    pub name: String,
    /// Its latest estimate; absent before its first sample.
    pub estimate: Option<Estimate>,
    /// Its pose in `odom`, i.e. by motion alone since the session began.
    pub odometry: Option<StampedPose>,
    /// What became of its sightings.
    pub evidence: Evidence,
    /// How far its samples have come.
    pub watermark: Watermark,
    /// Samples received but not yet durable.
    pub lag_samples: u64,
    /// Path travelled in this session \[m\].
    pub travelled_m: f64,
    /// Sightings of its own earlier samples that were dropped, because those were not remembered,
    /// or no longer; over all sessions.
    pub forgotten_matches: u64,
    /// Whether the latest sample of its session ended it.
    #[serde(default)]
    pub session_ended: bool,
    /// How long ago the service received a message of it \[s\]; null before the first one since the
    /// service started, and from a node that follows the space.
    #[serde(default)]
    pub heard_ago_s: Option<f64>,
}

/// What became of an agent's sightings of landmarks and of other agents, over all sessions.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Evidence {
    /// Sightings that corrected the map and its agents.
    pub accepted: u64,
    /// Sightings refused, as too far from what the map says.
    pub refused: u64,
    /// Of those, how many one after the other up to now, without those of landmarks that no second
    /// sighting has confirmed, or 4 when they have put the agent elsewhere; from 4 on it is not
    /// `localized`.
    pub refused_in_a_row: u64,
    /// Mean of the squared error of the accepted ones' components, each over what was expected of
    /// it: 1 where the stated noise is honest, more where it is too small. Absent before the first
    /// one.
    pub nis_mean: Option<f64>,
}

/// A pose at a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct StampedPose {
    /// Stamp \[ns\].
    pub stamp_ns: i64,
    /// Position \[m\].
    pub translation_m: [f64; 3],
    /// Orientation, unit quaternion `[x, y, z, w]`.
    pub rotation_xyzw: [f64; 4],
}

/// Where an agent was at a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct AgentAt {
    /// Agent.
    pub agent: String,
    /// Session of the agent.
    pub session: u64,
    /// Frame; always `map`.
    pub frame: String,
    /// `causal`: as it was known then. `refined`: by all that has been seen since.
    pub trajectory: String,
    /// The stamp that was asked about \[ns\].
    pub stamp_ns: i64,
    /// Position \[m\].
    pub translation_m: [f64; 3],
    /// Orientation, unit quaternion `[x, y, z, w]`.
    pub rotation_xyzw: [f64; 4],
    /// Stamp of the latest known pose that is not after it \[ns\].
    pub before_ns: i64,
    /// Stamp of the earliest known pose that is not before it \[ns\]. Between the two the agent is
    /// taken to have moved evenly.
    pub after_ns: i64,
    /// Number of records that a refined pose takes into account; absent of a causal one.
    pub map_revision: Option<u64>,
}

/// Grid-cell state of an agent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct GridState {
    /// Agent.
    pub agent: String,
    /// Stamp \[ns\].
    pub stamp_ns: i64,
    /// The modules, finest first.
    pub modules: Vec<GridModuleState>,
    /// Position decoded from the modules' phases around the reference grid point \[m\].
    pub decoded_m: [f64; 3],
    /// Interference pattern of the cells, `Σ aᵢcᵢ / Σ aᵢ` \[m\] (seed Eq. 4, normalised).
    pub interference_m: [f64; 3],
    /// Octant of the latest movement, 1 to 8; absent before the first one.
    pub octant: Option<u8>,
    /// Length of the latest movement \[m\] (seed Eq. 2).
    pub displacement_m: f64,
    /// Angle between the latest two movements \[rad\] (seed Eq. 3).
    pub turning_rad: f64,
    /// Heading in the x-y plane of `map` \[rad\].
    pub heading_rad: f64,
}

/// State of a grid module.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct GridModuleState {
    /// Spacing \[m\].
    pub spacing_m: f64,
    /// Lattice index of the reference grid point.
    pub reference: [i64; 3],
    /// Position of the reference grid point in `map` \[m\].
    pub reference_m: [f64; 3],
    /// Phase, `[0, 1)³` along the lattice axes.
    pub phase: [f64; 3],
    /// Activation of the module's cells, in \[0, 1\].
    pub activation: Vec<f64>,
    /// Activation by the octant model at the agent's position (seed Algorithm 1), in \[0, 1\]:
    /// cells as wide, high and deep as the spacing, σ a sixth of it, cut-off radius the spacing.
    pub octant_activation: f64,
}

/// A trajectory.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Trajectory {
    /// Agent.
    pub agent: String,
    /// Session of the agent.
    pub session: u64,
    /// Frame; always `map`.
    pub frame: String,
    /// `causal`: each pose as it was known when its sample was applied. `refined`: by all that has
    /// been seen since.
    pub kind: String,
    /// Poses, oldest first.
    pub poses: Vec<StampedPose>,
    /// Pass as `from_ns` for the next page; absent on the last one.
    pub next_from_ns: Option<i64>,
    /// Number of records that a refined trajectory takes into account; absent of a causal one.
    pub map_revision: Option<u64>,
}

/// Answer to samples sent over HTTP: they are on disk, but for those that are refused.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct IngestAnswer {
    /// How far the agent's samples have come.
    pub watermark: Watermark,
    /// Samples of the request that had been there before.
    pub duplicates: u64,
    /// Why samples of the request make no sense by themselves, the first 16 of them: field, value
    /// and rule, as in `samples[3].body.level.channel "my light": …`. Stamps that run backwards
    /// are in the watermark alone.
    #[serde(default)]
    pub refused: Vec<String>,
}

/// A place cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Place {
    /// Identifier, counted from 0.
    pub id: u64,
    /// Position in `map` \[m\]: where its founder stood, by what is known of the founder's way by
    /// now.
    pub translation_m: [f64; 3],
    /// Orientation of the founder at the founding, likewise, unit quaternion `[x, y, z, w]`.
    pub rotation_xyzw: [f64; 4],
    /// Standard deviation of the position at the founding, along the axes of `map` \[m\].
    pub position_sd_m: [f64; 3],
    /// Grid code: phase of each module.
    pub code: Vec<[f64; 3]>,
    /// Times an agent came here, the founding included.
    pub visits: u64,
    /// Agent that founded it.
    pub founder: String,
    /// Stamp of the founding \[ns\].
    pub first_stamp_ns: i64,
    /// Stamp of the latest visit \[ns\].
    pub last_stamp_ns: i64,
    /// Strength: the founding and each visit count one when they happen, and half as much after
    /// every half-life. The weakest place goes when there would be more than `places_max`.
    pub strength: f64,
}

/// One page of places.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct PlacePage {
    /// Frame of the positions; always `map`.
    pub frame: String,
    /// Number of records that the map includes.
    pub map_revision: u64,
    /// The places, by id.
    pub places: Vec<Place>,
    /// Pass as `after` for the next page; absent on the last one.
    pub next: Option<u64>,
}

/// Answer to a [`crate::RecallQuery`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct RecallAnswer {
    /// Space.
    pub space: String,
    /// Frame of the positions; always `map`.
    pub frame: String,
    /// Number of records that the map includes.
    pub map_revision: u64,
    /// The places, best first.
    pub places: Vec<RecalledPlace>,
    /// Other places that answer the code nearly as well as the first one; absent when there are
    /// none, without a code, or with a position beside it.
    #[serde(default)]
    pub rivals: Option<Rivals>,
}

/// The places that answer a code nearly as well as the best one: more than a field radius from it,
/// with a cosine at most 0.05 lower.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Rivals {
    /// How many there are.
    pub count: u64,
    /// Identifier of the best of them.
    pub place: u64,
    /// Its cosine.
    pub cosine: f64,
    /// Its distance from the first place \[m\].
    pub distance_m: f64,
}

/// A place and how well it answers the cue.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct RecalledPlace {
    /// The place.
    pub place: Place,
    /// Cosine of the cue's and the place's activation (seed Eq. 5); absent without a position or
    /// code.
    pub cosine: Option<f64>,
    /// Confidence (seed Eq. 8), in \[0, 1\]; absent without a cue.
    pub confidence: Option<f64>,
    /// Distance from `position_m` \[m\]; absent without it.
    pub distance_m: Option<f64>,
    /// How well the percept fits what the place remembers; absent without one. For a descriptor the
    /// cosine; for a level its likelihood, as a part of the highest that there could be.
    pub percept_match: Option<f64>,
}

/// A trip in a list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Trip {
    /// Identifier, counted from 0.
    pub id: u64,
    /// Agent.
    pub agent: String,
    /// Session of the agent.
    pub session: u64,
    /// Stamp of the start \[ns\].
    pub start_stamp_ns: i64,
    /// Stamp of the latest leg's end \[ns\].
    pub end_stamp_ns: i64,
    /// Why it ended; absent while it goes on.
    pub ended: Option<TripEnd>,
    /// Number of legs.
    pub leg_count: u64,
    /// Length of its path \[m\].
    pub length_m: f64,
    /// Strength: its recording counts one when it begins, so does travelling all of it again, and
    /// each half as much after every half-life. The weakest trip goes when there would be more legs
    /// than `legs_max`.
    pub strength: f64,
    /// Whether it is pinned: never forgotten.
    pub pinned: bool,
}

/// A trip with its legs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct TripDetail {
    /// The trip.
    pub trip: Trip,
    /// Its legs, in order.
    pub legs: Vec<Leg>,
}

/// One page of trips.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct TripPage {
    /// The trips, by id.
    pub trips: Vec<Trip>,
    /// Pass as `after` for the next page; absent on the last one.
    pub next: Option<u64>,
}

/// A leg: the way from one place to the next, as motion measured it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Leg {
    /// Place at its start; it may have been forgotten since.
    pub from: u64,
    /// Place at its end; it may have been forgotten since.
    pub to: u64,
    /// Displacement, in the body frame at the start \[m\].
    pub translation_m: [f64; 3],
    /// Rotation, unit quaternion `[x, y, z, w]`.
    pub rotation_xyzw: [f64; 4],
    /// Upper triangle, row by row, of the 6 × 6 covariance of (translation, rotation) in the body
    /// frame at the end.
    pub covariance: [f64; 21],
    /// Phase displacement of each grid module, turns along the lattice axes.
    pub phase_displacement: Vec<[f64; 3]>,
    /// Octant of the displacement in `map`, 1 to 8.
    pub octant: u8,
    /// Duration \[s\].
    pub duration_s: f64,
    /// Length of the path \[m\].
    pub length_m: f64,
}

/// A landmark.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Landmark {
    /// Label.
    pub id: String,
    /// Position in `map` \[m\].
    pub translation_m: [f64; 3],
    /// Upper triangle, row by row, of the 3 × 3 covariance of the position \[m²\].
    pub covariance: [f64; 6],
    /// Times it was seen.
    pub sightings: u64,
    /// Stamp of the first sighting \[ns\].
    pub first_stamp_ns: i64,
    /// Stamp of the latest sighting \[ns\].
    pub last_stamp_ns: i64,
}

/// One page of landmarks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct LandmarkPage {
    /// Frame of the positions; always `map`.
    pub frame: String,
    /// The landmarks, by label.
    pub landmarks: Vec<Landmark>,
    /// Pass as `after` for the next page; absent on the last one.
    pub next: Option<String>,
}
