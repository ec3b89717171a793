//! Percepts: what a robot felt or saw.

use serde::{Deserialize, Serialize};

use crate::narrow;

/// A scalar on a channel: touch, texture, light, signal strength.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Level {
    /// Name of the channel.
    pub channel: String,
    /// The value, in the channel's own unit.
    pub value: f64,
    /// Where the sensor sits in the body frame \[m\].
    #[serde(default)]
    pub offset_m: [f64; 3],
    /// Surface normal in the body frame (unit vector), where a surface was touched.
    #[serde(default)]
    pub normal: Option<[f64; 3]>,
}

/// A unit vector on a channel, for example an image descriptor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Descriptor {
    /// Name of the channel.
    pub channel: String,
    /// The vector, of 8 to 4096 numbers; normalised on receipt, so it must not be zero.
    #[serde(deserialize_with = "narrow::vector")]
    pub vector: Vec<f32>,
}
