//! Estimates: where an agent is, and how sure the service is of it.

use serde::{Deserialize, Serialize};

/// How an agent is localised.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Its position in the map is known to within the space's `localized_sd_m`, and what it sees is
    /// where it should be.
    Localized,
    /// It is known less well than that, or its latest sightings contradict it.
    Uncertain,
    /// It is known less well than the space's `lost_sd_m`, or not at all.
    Lost,
}

/// The pose of an agent as known when its sample was applied (the causal estimate).
///
/// Published on `cogmap/{space}/{agent}/estimate`, the latest one of each group of samples that
/// were applied together.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Estimate {
    /// Space.
    pub space: String,
    /// Agent.
    pub agent: String,
    /// Session of the agent.
    pub session: u64,
    /// Sequence number of the latest sample that the estimate includes.
    pub seq: u64,
    /// Stamp of that sample \[ns\].
    pub stamp_ns: i64,
    /// Frame of the pose: `map`; or `unplaced` while the agent is lost and nothing ties it to the
    /// map, another frame, which agents that have found one another share.
    pub frame: String,
    /// Number of records that the map includes.
    pub map_revision: u64,
    /// How the agent is localised.
    pub status: Status,
    /// Position in that frame \[m\].
    pub translation_m: [f64; 3],
    /// Orientation in that frame, unit quaternion `[x, y, z, w]`.
    pub rotation_xyzw: [f64; 4],
    /// Upper triangle, row by row, of the 6 × 6 covariance of (x, y, z, rotation about x, y, z)
    /// along the axes of that frame \[m², m·rad, rad²\].
    pub covariance: [f64; 21],
    /// The place cell that answers strongest, if any does.
    pub place: Option<u64>,
    /// Its confidence, in \[0, 1\]; 0 without a place.
    pub confidence: f64,
    /// Number of the owner of the space's journal that made it: each later owner has a larger one;
    /// 0 on one machine. An estimate with a smaller term than the largest that was heard of the
    /// agent is outdated.
    #[serde(default)]
    pub term: u64,
}
