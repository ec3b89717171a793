//! Settings of a space, fixed when it is created: the fold over its journal depends on them.

use serde::{Deserialize, Serialize};

/// Settings of a space. Every field has a default, and all are physical.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields, default)]
pub struct SpaceSettings {
    /// Seed of everything random in the space.
    pub seed: u64,
    /// Number of grid modules, 1 to 16.
    pub grid_modules: u32,
    /// Spacing of the finest grid module \[m\].
    pub grid_spacing_m: f64,
    /// Ratio of the spacings of neighbouring modules.
    pub grid_ratio: f64,
    /// Distance at which a place's confidence has fallen to one half \[m\].
    pub field_radius_m: f64,
    /// When a place cell is recruited.
    pub recruitment: Recruitment,
    /// Noise of motion samples that carry none, and what odometry gets wrong all the time.
    pub odometry_noise: NoiseSettings,
    /// Part of a distance by which a seen distance may be off again and again, e.g. of a marker
    /// seen at a slant. It fades where an agent's sightings show that their errors change from one
    /// to the next.
    pub lasting_range_error: f64,
    /// An agent is `localized` up to this standard deviation of position \[m\].
    pub localized_sd_m: f64,
    /// An agent is `lost` beyond this standard deviation of position \[m\].
    pub lost_sd_m: f64,
    /// Standing still for this long ends a trip \[s\].
    pub trip_stillness_s: f64,
    /// No sample for this long, on the sensor's clock, ends a trip \[s\].
    pub trip_gap_s: f64,
    /// Most places, at least 2: for one more, the weakest is forgotten.
    pub places_max: u32,
    /// Most legs of all trips together, at least 1: for one more, the weakest trip is forgotten.
    pub legs_max: u32,
    /// Most moments of all agents that are remembered, so that the past can be smoothed, at least
    /// 64: for one more, one from which next to nothing is lost is left out.
    pub anchors_max: u32,
    /// After this many samples of the space, by whichever agent, a use counts half as much for the
    /// strength of a place or trip.
    pub strength_half_life_samples: u32,
    /// Closest two poses of a stored trajectory \[s\]: at most this often a row is kept.
    pub trajectory_interval_s: f64,
}

/// When a place cell is recruited.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum Recruitment {
    /// Where no place answers with a confidence of at least one half.
    Novelty {},
    /// At every motion sample with this probability (the seed paper's `P_new`).
    Bernoulli {
        /// Probability, in \[0, 1\].
        probability: f64,
    },
}

/// What odometry gets wrong, as standard deviations. Noise of motion that carries none grows with
/// the square root of the path, as independent errors do, so that it does not depend on the
/// sampling rate. Errors that last are learned for each agent from what it sees.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields, default)]
pub struct NoiseSettings {
    /// Of the translation, per square root of metre travelled \[m/√m\].
    pub translation_sd_per_sqrt_m: f64,
    /// Of the rotation, per square root of metre travelled \[rad/√m\].
    pub rotation_sd_per_sqrt_m: f64,
    /// Of the rotation, per square root of radian turned \[rad/√rad\].
    pub rotation_sd_per_sqrt_rad: f64,
    /// Of the lasting relative error of lengths, e.g. of a wheel's radius.
    pub length_error_sd: f64,
    /// Of the lasting relative error of angles, e.g. of a wheel base.
    pub angle_error_sd: f64,
    /// Of the lasting bias about each axis, e.g. of a gyroscope \[rad/s\].
    pub bias_sd_rad_s: f64,
}

impl Default for SpaceSettings {
    fn default() -> Self {
        Self {
            seed: 0,
            grid_modules: 6,
            grid_spacing_m: 1.2,
            grid_ratio: 1.618,
            field_radius_m: 0.25,
            recruitment: Recruitment::Novelty {},
            odometry_noise: NoiseSettings::default(),
            lasting_range_error: 0.1,
            localized_sd_m: 0.5,
            lost_sd_m: 5.0,
            trip_stillness_s: 5.0,
            trip_gap_s: 2.0,
            places_max: 65_536,
            legs_max: 65_536,
            anchors_max: 65_536,
            strength_half_life_samples: 1_000_000,
            trajectory_interval_s: 0.005,
        }
    }
}

impl Default for NoiseSettings {
    fn default() -> Self {
        Self {
            translation_sd_per_sqrt_m: 0.04,
            rotation_sd_per_sqrt_m: 0.1,
            rotation_sd_per_sqrt_rad: 0.15,
            length_error_sd: 0.05,
            angle_error_sd: 0.1,
            bias_sd_rad_s: 0.004,
        }
    }
}
