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
    /// Most keyframes of all agents, moments of their past that are kept so that it can be
    /// smoothed, at least 64: for one more, one from which next to nothing is lost is left out.
    /// Spaces of before are stored with it as `anchors_max`.
    #[serde(alias = "anchors_max")]
    pub keyframes_max: u32,
    /// After this many samples of the space, by whichever agent, a use counts half as much for the
    /// strength of a place, trip or way.
    pub strength_half_life_samples: u32,
    /// Closest two poses of a stored trajectory \[s\]: at most this often a row is kept. The newest
    /// pose is always its last row.
    pub trajectory_interval_s: f64,
    /// Deviation of a component of a sighting from what the estimate expects, in standard
    /// deviations, beyond which the whole sighting is refused. Smaller for a sensor that mixes
    /// things up, larger for one whose stated noise is too small.
    pub sighting_gate_sd: f64,
    /// The same beyond which a component of a sighting loses weight (Huber 1964); with the gate or
    /// more, none does. Smaller for a sensor whose errors have long tails.
    pub sighting_huber_sd: f64,
    /// Squared Mahalanobis distance up to which a loop closure agrees with the map or with another
    /// closure: of true ones in a plane 1 in 100 exceeds 11.3 (χ², 3 degrees of freedom), in space
    /// 1 in 13 (6 degrees). A closure that was accepted is rejected beyond 2.2 times as much.
    /// Smaller for a place recogniser that often takes one place for another, larger for one that
    /// states too small a noise.
    pub closure_gate_chi2: f64,
    /// An agent leaves a keyframe after this motion \[m\] at the latest, and where it sees
    /// something, after a fifth of it. Wider for a vehicle that covers kilometres: `keyframes_max`
    /// keyframes then reach as much farther.
    pub keyframe_spacing_m: f64,
    /// The same for rotation \[rad\].
    pub keyframe_spacing_rad: f64,
    /// Standard deviation of what a robot is moved along each axis between two of its sessions
    /// \[m\]. Small for one that restarts where it stopped, large for one that is carried.
    pub restart_sd_m: f64,
    /// Standard deviation of what it is turned about each axis between them \[rad\].
    pub restart_sd_rad: f64,
    /// Probability from which on touches are answered with an object, or with none that is known.
    /// Larger where a wrong answer costs more than further touches.
    pub object_answer_probability: f64,
    /// Most ways, each between two places that legs have joined, at least 1: for one more, the
    /// weakest is forgotten without which no places are separate.
    pub ways_max: u32,
    /// Whether an episode that is to recognise an object learns it where it turns out to be
    /// unknown.
    pub learns_unknown_objects: bool,
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
    /// Of the lasting relative error of angles, e.g. of a wheel base. 0.3 of it is that of the
    /// turn with each metre \[rad/m\], e.g. by wheels of different sizes.
    pub angle_error_sd: f64,
    /// Of the lasting bias about each axis, e.g. of a gyroscope \[rad/s\]. A robot that stands, and
    /// turns by its odometry more slowly than three of it, reads it.
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
            keyframes_max: 65_536,
            strength_half_life_samples: 1_000_000,
            trajectory_interval_s: 0.005,
            sighting_gate_sd: 4.0,
            sighting_huber_sd: 2.0,
            closure_gate_chi2: 11.3,
            keyframe_spacing_m: 0.1,
            keyframe_spacing_rad: 0.1,
            restart_sd_m: 1.0,
            restart_sd_rad: 0.5,
            object_answer_probability: 0.995,
            ways_max: 131_072,
            learns_unknown_objects: true,
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
