//! Prediction: what an agent would feel after a motion.

use serde::{Deserialize, Serialize};

use crate::narrow;
use crate::sample::{Increment, Velocity};

/// Asks what an agent would feel if it moved so.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct PredictQuery {
    /// The agent. Over HTTP it is in the path, and absent here or the same.
    #[serde(default)]
    pub agent: Option<String>,
    /// The motion, from where the agent is now.
    pub motion: MotionBody,
    /// Where the sensor of levels sits in the body frame \[m\]; descriptors are seen at the body.
    #[serde(default)]
    pub offset_m: [f64; 3],
    /// Only what is felt on this channel.
    #[serde(default)]
    pub channel: Option<String>,
}

/// A motion, as in a sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum MotionBody {
    /// A finished displacement.
    Increment(Increment),
    /// A velocity held for a time.
    Velocity(Velocity),
}

/// Answer to a [`PredictQuery`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct PredictAnswer {
    /// Space.
    pub space: String,
    /// Agent.
    pub agent: String,
    /// Frame of the pose; always `map`.
    pub frame: String,
    /// Number of records that the map includes.
    pub map_revision: u64,
    /// Where the motion leads \[m\].
    pub translation_m: [f64; 3],
    /// Orientation there as a unit quaternion `[x, y, z, w]`.
    pub rotation_xyzw: [f64; 4],
    /// The place that answers there, if one does.
    pub place: Option<u64>,
    /// Its confidence, in \[0, 1\]: the mean over the positions to which the motion may lead, by
    /// its noise. How well the agent is localised when it starts is not in it. 0 where no place
    /// answers.
    pub confidence: f64,
    /// What is expected there, in the order of the channels; empty where no place answers.
    pub percepts: Vec<PredictedPercept>,
}

/// A percept that is expected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct PredictedPercept {
    /// Name of the channel.
    pub channel: String,
    /// What is expected.
    pub expected: ExpectedPercept,
    /// The place that remembers it: the one that answers where the sensor will be.
    pub place: u64,
    /// That place's confidence, in \[0, 1\], as above.
    pub confidence: f64,
    /// Number of percepts that it has learned from.
    pub percepts: u64,
    /// Strength of the association: the sum of the place's confidences when they were felt.
    pub strength: f64,
}

/// What a percept is expected to be like.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum ExpectedPercept {
    /// A level.
    Level {
        /// Mean, in the channel's own unit.
        mean: f64,
        /// Standard deviation of single values; 0 after the first one.
        sd: f64,
    },
    /// A descriptor.
    Descriptor {
        /// Mean direction, a unit vector; all zeros if what was seen cancels out.
        #[serde(deserialize_with = "narrow::vector")]
        vector: Vec<f32>,
    },
}
