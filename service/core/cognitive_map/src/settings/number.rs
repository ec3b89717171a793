//! The numbers of the settings, each with its name and what it may be.

use super::{Bound, InvalidSettings, SettingsValues};

/// A positive length or time.
const POSITIVE: Bound = Bound::above(0.0, 1e6);
/// A length that a grid or a field may have \[m\].
const LENGTH_M: Bound = Bound::from(1e-3, 1e6);

/// A number of the settings: the one place that says what it may be.
///
/// The seed, which may be any number, is none of them.
#[derive(Clone, Copy, Debug)]
pub struct SettingNumber {
    /// Name of the field.
    pub name: &'static str,
    /// What it may be.
    pub bound: Bound,
    value: fn(&SettingsValues) -> f64,
}

/// The row of a field.
macro_rules! number {
    ($field:ident, $bound:expr) => {
        Self {
            name: stringify!($field),
            bound: $bound,
            value: |values| f64::from(values.$field),
        }
    };
}

impl SettingNumber {
    /// All of them, in the order of the fields.
    pub const ALL: [Self; 28] = [
        Self {
            name: "grid_modules",
            bound: Bound::Whole {
                min: 1,
                max: Some(16),
            },
            value: |values| values.grid_modules as f64,
        },
        number!(grid_spacing_m, LENGTH_M),
        number!(grid_ratio, Bound::above(1.0, 10.0)),
        number!(field_radius_m, LENGTH_M),
        number!(translation_sd_per_sqrt_m, Bound::Share),
        number!(rotation_sd_per_sqrt_m, Bound::Share),
        number!(rotation_sd_per_sqrt_rad, Bound::Share),
        number!(length_error_sd, Bound::Share),
        number!(angle_error_sd, Bound::Share),
        number!(bias_sd_rad_s, Bound::Share),
        number!(lasting_range_error, Bound::Share),
        number!(localized_sd_m, POSITIVE),
        number!(lost_sd_m, POSITIVE),
        number!(trip_stillness_s, POSITIVE),
        number!(trip_gap_s, POSITIVE),
        // The place that a leg starts from is held while the next one is recruited.
        number!(places_max, Bound::Whole { min: 2, max: None }),
        number!(legs_max, Bound::Whole { min: 1, max: None }),
        number!(ways_max, Bound::Whole { min: 1, max: None }),
        number!(
            keyframes_max,
            Bound::Whole {
                min: 64,
                max: Some(1 << 24),
            }
        ),
        number!(
            strength_half_life_samples,
            Bound::Whole { min: 1, max: None }
        ),
        // Within one deviation two in three right sightings along an axis would be taken, and of
        // three axes fewer: less than that is a mistake.
        number!(sighting_gate_sd, Bound::from(1.0, 100.0)),
        number!(sighting_huber_sd, Bound::from(0.5, 100.0)),
        // Below 1 four in five right closures would be refused.
        number!(closure_gate_chi2, Bound::from(1.0, 1000.0)),
        number!(keyframe_spacing_m, Bound::from(0.01, 100.0)),
        number!(keyframe_spacing_rad, Bound::from(0.01, 3.0)),
        number!(restart_sd_m, Bound::from(0.0, 1e6)),
        // No rotation is off by more than half a turn.
        number!(restart_sd_rad, Bound::from(0.0, 3.0)),
        // Up to one half two answers could be as probable.
        number!(object_answer_probability, Bound::above(0.5, 0.999_999)),
    ];

    /// Checks the number in settings.
    pub(super) fn check(self, values: &SettingsValues) -> Result<(), InvalidSettings> {
        self.bound.check(self.name, (self.value)(values))
    }
}
