//! Settings of a space: fixed when it is created, because the fold depends on them.

use grid::GridSettings;

/// Most grid modules.
const GRID_MODULES_MAX: usize = 16;

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
    /// Deviation of odometry's lasting relative error of angles, e.g. of a wheel base.
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
    /// Most moments of all agents that are remembered, so that the past can be smoothed: for one
    /// more, one from which next to nothing is lost is left out.
    pub anchors_max: u32,
    /// After this many records of the space, a use counts half as much for the strength of a
    /// memory.
    pub strength_half_life_samples: u32,
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
    pub rule: &'static str,
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
            anchors_max: 65_536,
            strength_half_life_samples: 1_000_000,
        }
    }
}

impl Settings {
    /// Checks the values.
    ///
    /// # Errors
    /// Names the first field that makes no sense, and the rule that it breaks.
    pub fn new(values: SettingsValues) -> Result<Self, InvalidSettings> {
        let check = |holds: bool, field, rule| {
            if holds {
                Ok(())
            } else {
                Err(InvalidSettings { field, rule })
            }
        };
        // A comparison with NaN is false, so each of these refuses NaN too.
        let positive = |x: f64| x > 0.0 && x <= 1e6;
        let share = |x: f64| (0.0..=1.0).contains(&x);
        let v = &values;
        let modules = (1..=GRID_MODULES_MAX).contains(&v.grid_modules);
        check(modules, "grid_modules", "1 to 16")?;
        let spacing = (1e-3..=1e6).contains(&v.grid_spacing_m);
        check(spacing, "grid_spacing_m", "0.001 to 1000000")?;
        let ratio = v.grid_ratio > 1.0 && v.grid_ratio <= 10.0;
        check(ratio, "grid_ratio", "above 1, at most 10")?;
        let radius = (1e-3..=1e6).contains(&v.field_radius_m);
        check(radius, "field_radius_m", "0.001 to 1000000")?;
        if let Recruitment::Bernoulli { probability } = v.recruitment {
            check(share(probability), "recruitment.probability", "0 to 1")?;
        }
        check(
            share(v.translation_sd_per_sqrt_m),
            "translation_sd_per_sqrt_m",
            "0 to 1",
        )?;
        check(
            share(v.rotation_sd_per_sqrt_m),
            "rotation_sd_per_sqrt_m",
            "0 to 1",
        )?;
        check(
            share(v.rotation_sd_per_sqrt_rad),
            "rotation_sd_per_sqrt_rad",
            "0 to 1",
        )?;
        check(share(v.length_error_sd), "length_error_sd", "0 to 1")?;
        check(share(v.angle_error_sd), "angle_error_sd", "0 to 1")?;
        check(share(v.bias_sd_rad_s), "bias_sd_rad_s", "0 to 1")?;
        let lasting = share(v.lasting_range_error);
        check(lasting, "lasting_range_error", "0 to 1")?;
        check(positive(v.localized_sd_m), "localized_sd_m", "positive")?;
        let lost = v.lost_sd_m > v.localized_sd_m && v.lost_sd_m <= 1e6;
        check(lost, "lost_sd_m", "above localized_sd_m")?;
        check(positive(v.trip_stillness_s), "trip_stillness_s", "positive")?;
        check(positive(v.trip_gap_s), "trip_gap_s", "positive")?;
        // The place that a leg starts from is held while the next one is recruited.
        check(v.places_max >= 2, "places_max", "at least 2")?;
        check(v.legs_max >= 1, "legs_max", "at least 1")?;
        let anchors = (64..=1 << 24).contains(&v.anchors_max);
        check(anchors, "anchors_max", "64 to 16777216")?;
        let half_life = v.strength_half_life_samples >= 1;
        check(half_life, "strength_half_life_samples", "at least 1")?;
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
