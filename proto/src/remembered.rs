//! What a place remembers.

use serde::{Deserialize, Serialize};

use crate::predict::ExpectedPercept;

/// What a place remembers of what was felt and seen there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct PlacePercepts {
    /// Space.
    pub space: String,
    /// The place.
    pub place: u64,
    /// Number of records that the map includes.
    pub map_revision: u64,
    /// What it remembers, in the order of the channels; empty where nothing was felt.
    pub percepts: Vec<RememberedPercept>,
}

/// What a place remembers of a channel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct RememberedPercept {
    /// Name of the channel.
    pub channel: String,
    /// What is expected there.
    pub expected: ExpectedPercept,
    /// Number of percepts that it has learned from.
    pub percepts: u64,
    /// Strength of the association: the sum of the place's confidences when they were felt.
    pub strength: f64,
}
