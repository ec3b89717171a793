//! What was felt near a point, and whether anybody was there to feel it.

use serde::{Deserialize, Serialize};

/// Asks what was felt near a point, and who was there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct FeltQuery {
    /// The point in `map` \[m\].
    pub position_m: [f64; 3],
    /// Places within this distance of it are near \[m\]; the radius of a place's field when
    /// absent.
    #[serde(default)]
    pub radius_m: Option<f64>,
    /// Only what was felt, and who was there, at or after this stamp \[ns\].
    #[serde(default)]
    pub since_ns: Option<i64>,
    /// Only percepts of these channels, at most 64; of all when absent.
    #[serde(default)]
    pub channels: Option<Vec<String>>,
    /// Most places in the answer, 1 to 1000; 10 when absent.
    #[serde(default)]
    pub limit: Option<u32>,
}

/// Whether somebody looked, and what came of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum Looked {
    /// Nobody is known to have been there since the stamp.
    Never,
    /// Somebody was there, and no percept that is asked for is known from then.
    NothingFelt,
    /// A percept that is asked for is known.
    Felt,
}

/// Answer to a [`FeltQuery`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct FeltAnswer {
    /// Space.
    pub space: String,
    /// Frame of the point; always `map`.
    pub frame: String,
    /// Number of records that the map includes.
    pub map_revision: u64,
    /// Of all places near together.
    pub looked: Looked,
    /// Latest stamp at which somebody is known to have been near, also before `since_ns` \[ns\];
    /// absent where nobody is.
    pub last_seen_ns: Option<i64>,
    /// Latest stamp of the percepts that are asked for \[ns\]; absent where there are none.
    pub last_felt_ns: Option<i64>,
    /// Number of places near, also beyond the limit.
    pub near: u64,
    /// The nearest places, the nearest first, equally near ones by number.
    pub places: Vec<FeltPlace>,
}

/// What was felt at a place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct FeltPlace {
    /// The place.
    pub place: u64,
    /// Its distance from the point \[m\].
    pub distance_m: f64,
    /// Whether somebody looked.
    pub looked: Looked,
    /// Latest stamp at which somebody is known to have been there, also before `since_ns` \[ns\].
    pub last_seen_ns: i64,
    /// The percepts that are asked for, in the order of the channels.
    pub percepts: Vec<FeltPercept>,
}

/// What a place learned of a channel since it was founded.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct FeltPercept {
    /// Name of the channel.
    pub channel: String,
    /// Latest stamp of a percept \[ns\].
    pub last_stamp_ns: i64,
    /// Number of percepts, also of those before `since_ns`.
    pub percepts: u64,
    /// Strength of the association: the sum of the place's confidences when they were felt.
    pub strength: f64,
    /// Mean of all levels, in the channel's own unit; absent for descriptors, as is `sd`.
    pub mean: Option<f64>,
    /// Standard deviation of single levels; 0 after the first one.
    pub sd: Option<f64>,
    /// How many numbers the descriptors have; absent for levels.
    pub dimension: Option<u32>,
}
