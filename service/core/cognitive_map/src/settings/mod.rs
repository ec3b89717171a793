//! Settings of a space: fixed when it is created, because the fold depends on them.

mod bound;
mod number;

use grid::GridSettings;

pub use bound::Bound;
pub use number::SettingNumber;

/// Valid settings. Build with [`Settings::new`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings(SettingsValues);

/// The values of [`Settings`]; all physical, all with a default.
#[derive(Clone, Debug, PartialEq)]
pub struct SettingsValues {
    /// Seed of everything random in the space.
    pub seed: u64,
    /// Number of grid modules, 1 to 16.
    pub grid_modules: usize,
    /// Spacing of the finest grid module \[m\].
    pub grid_spacing_m: f64,
    /// Ratio of the spacings of neighbouring modules, above 1 (1.4 to 1.7 in rats: Stensola et al.
    /// 2012).
    pub grid_ratio: f64,
    /// Distance at which a place's confidence has fallen to one half \[m\].
    pub field_radius_m: f64,
    /// When a place cell is recruited.
    pub recruitment: Recruitment,
    /// Odometry noise of motion that carries none: translation \[m/√m\].
    pub translation_sd_per_sqrt_m: f64,
    /// Rotation per path \[rad/√m\].
    pub rotation_sd_per_sqrt_m: f64,
    /// Rotation per rotation \[rad/√rad\].
    pub rotation_sd_per_sqrt_rad: f64,
    /// Deviation of odometry's lasting relative error of lengths, e.g. of a wheel's radius.
    pub length_error_sd: f64,
    /// Deviation of odometry's lasting relative error of angles, e.g. of a wheel base; 0.3 of it is
    /// that of the veer \[rad/m\].
    pub angle_error_sd: f64,
    /// Deviation of odometry's lasting bias about each axis \[rad/s\], e.g. of a gyroscope.
    pub bias_sd_rad_s: f64,
    /// Part of a distance by which a seen distance may be off again and again.
    pub lasting_range_error: f64,
    /// An agent is localised up to this standard deviation of position \[m\].
    pub localized_sd_m: f64,
    /// An agent is lost beyond this standard deviation of position \[m\].
    pub lost_sd_m: f64,
    /// Standing still for this long ends a trip \[s\].
    pub trip_stillness_s: f64,
    /// No sample for this long, on the sensor's clock, ends a trip \[s\].
    pub trip_gap_s: f64,
    /// Most places: for one more, the weakest is forgotten.
    pub places_max: u32,
    /// Most legs of all trips together: for one more, the weakest trip is forgotten.
    pub legs_max: u32,
    /// Most ways, each between two places that legs have joined: for one more, the weakest is
    /// forgotten that is no bridge.
    pub ways_max: u32,
    /// Most keyframes of all agents, moments of their past that are kept so that it can be
    /// smoothed: for one more, one from which next to nothing is lost is left out.
    pub keyframes_max: u32,
    /// After this many records of the space, a use counts half as much for the strength of a
    /// memory.
    pub strength_half_life_samples: u32,
    /// Deviation of a component of a sighting from what the estimate expects, in standard
    /// deviations, beyond which the whole sighting is refused.
    pub sighting_gate_sd: f64,
    /// The same beyond which a component of a sighting loses weight (Huber 1964).
    pub sighting_huber_sd: f64,
    /// Squared Mahalanobis distance up to which a loop closure agrees with the map or with another
    /// closure.
    pub closure_gate_chi2: f64,
    /// Motion between keyframes \[m\].
    pub keyframe_spacing_m: f64,
    /// Rotation between keyframes \[rad\].
    pub keyframe_spacing_rad: f64,
    /// Deviation of what a robot is moved along each axis between two sessions \[m\].
    pub restart_sd_m: f64,
    /// Deviation of what it is turned about each axis between two sessions \[rad\].
    pub restart_sd_rad: f64,
    /// Probability from which on an episode of touches is answered with an object, or with none.
    pub object_answer_probability: f64,
    /// Whether an episode that is to recognise learns an object that turns out to be unknown.
    pub learns_unknown_objects: bool,
}

/// When a place cell is recruited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Recruitment {
    /// Where no place answers with a confidence of at least one half.
    Novelty,
    /// At every motion sample with this probability (seed `P_new`), unless a place is closer than
    /// an eighth of a field radius: those two could not be told apart.
    Bernoulli {
        /// Probability, in \[0, 1\].
        probability: f64,
    },
}

/// A value of the settings that makes no sense.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{field} must be {rule}")]
pub struct InvalidSettings {
    /// Name of the field.
    pub field: &'static str,
    /// What it must be.
    pub rule: String,
}

impl Default for SettingsValues {
    fn default() -> Self {
        Self {
            seed: 0,
            grid_modules: 6,
            grid_spacing_m: 1.2,
            grid_ratio: 1.618,
            field_radius_m: 0.25,
            recruitment: Recruitment::Novelty,
            translation_sd_per_sqrt_m: 0.04,
            rotation_sd_per_sqrt_m: 0.1,
            rotation_sd_per_sqrt_rad: 0.15,
            length_error_sd: 0.05,
            angle_error_sd: 0.1,
            bias_sd_rad_s: 0.004,
            lasting_range_error: 0.1,
            localized_sd_m: 0.5,
            lost_sd_m: 5.0,
            trip_stillness_s: 5.0,
            trip_gap_s: 2.0,
            places_max: 65_536,
            legs_max: 65_536,
            ways_max: 131_072,
            keyframes_max: 65_536,
            strength_half_life_samples: 1_000_000,
            sighting_gate_sd: 4.0,
            sighting_huber_sd: 2.0,
            closure_gate_chi2: 11.3,
            keyframe_spacing_m: 0.1,
            keyframe_spacing_rad: 0.1,
            restart_sd_m: 1.0,
            restart_sd_rad: 0.5,
            object_answer_probability: object_recognition::ANSWER_PROBABILITY,
            learns_unknown_objects: true,
        }
    }
}

impl Settings {
    /// Checks the values.
    ///
    /// # Errors
    /// Names the first field that makes no sense, and the rule that it breaks.
    pub fn new(values: SettingsValues) -> Result<Self, InvalidSettings> {
        for number in SettingNumber::ALL {
            number.check(&values)?;
        }
        if let Recruitment::Bernoulli { probability } = values.recruitment {
            Bound::Share.check("recruitment.probability", probability)?;
        }
        if values.lost_sd_m <= values.localized_sd_m {
            return Err(InvalidSettings {
                field: "lost_sd_m",
                rule: "above localized_sd_m".to_owned(),
            });
        }
        Ok(Self(values))
    }

    /// Number and spacings of the grid modules.
    pub fn grid(&self) -> GridSettings {
        GridSettings {
            modules: self.grid_modules,
            spacing_m: self.grid_spacing_m,
            ratio: self.grid_ratio,
        }
    }
}

impl std::ops::Deref for Settings {
    type Target = SettingsValues;

    fn deref(&self) -> &SettingsValues {
        &self.0
    }
}
