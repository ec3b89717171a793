//! Where samples were taken that belong to no agent.

use serde::{Deserialize, Serialize};

use crate::bounded;
use crate::estimate::Status;
use crate::sample::Sample;

/// Asks where a sequence of samples was taken. What the map has learned answers; nothing is learned
/// from the question.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct LocalizeQuery {
    /// The samples of one robot, in order, as in a batch; at least one, at most
    /// [`crate::limits::LOCALIZE_SAMPLES_MAX`]. Start poses and episodes with objects are none of
    /// them.
    #[serde(deserialize_with = "bounded::localize_samples")]
    pub samples: Vec<Sample>,
}

/// Where a sequence of samples was taken, by what the map knows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Localization {
    /// Space.
    pub space: String,
    /// Frame of the poses; always `map`.
    pub frame: String,
    /// Number of records that the map includes.
    pub map_revision: u64,
    /// How well it is known where the body was at the last sample.
    pub status: Status,
    /// Where it was then; absent while that is not known.
    pub pose: Option<LocalizedPose>,
    /// Index of the sample with which it became known.
    pub found_after: Option<u64>,
    /// Where it may have been, most probable first, while that is not known.
    pub hypotheses: Vec<LocalizationHypothesis>,
}

/// A pose of the body in the map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct LocalizedPose {
    /// Position in `map` \[m\].
    pub translation_m: [f64; 3],
    /// Orientation in `map`, unit quaternion `[x, y, z, w]`.
    pub rotation_xyzw: [f64; 4],
    /// Upper triangle, row by row, of the 6 × 6 covariance of (x, y, z, rotation about x, y, z)
    /// along the axes of `map` \[m², m·rad, rad²\].
    pub covariance: [f64; 21],
}

/// A place where the body may have been.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct LocalizationHypothesis {
    /// Where, at the latest sample that tells of places.
    pub pose: LocalizedPose,
    /// Its share of the evidence; all other places, and those that nobody has seen, have the rest.
    pub probability: f64,
    /// How many of the samples can be judged by what is remembered there.
    pub looks: u64,
}
