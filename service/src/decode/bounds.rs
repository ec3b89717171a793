//! Bounds of a space's settings, for those who ask before they try: the map itself checks them.

/// What a number of a space's settings may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bound {
    /// A share: 0 to 1.
    Share,
    /// A number from a least one on, or only above it, up to a largest one.
    Real {
        /// The least number.
        min: f64,
        /// Whether the least number itself is refused.
        is_open: bool,
        /// The largest number.
        max: f64,
    },
    /// A whole number from a least one on, up to a largest one if there is one.
    Whole {
        /// The least number.
        min: u32,
        /// The largest number.
        max: Option<u32>,
    },
}

/// A positive length or time.
const POSITIVE: Bound = Bound::Real {
    min: 0.0,
    is_open: true,
    max: 1e6,
};
/// A length that a grid or a field may have \[m\].
const LENGTH_M: Bound = Bound::Real {
    min: 0.001,
    is_open: false,
    max: 1e6,
};

/// Each number of a space's settings with what it may be, but for those of the odometry's noise,
/// which are all shares, and for the seed, which is any.
pub const SPACE_BOUNDS: [(&str, Bound); 13] = [
    (
        "grid_modules",
        Bound::Whole {
            min: 1,
            max: Some(16),
        },
    ),
    ("grid_spacing_m", LENGTH_M),
    (
        "grid_ratio",
        Bound::Real {
            min: 1.0,
            is_open: true,
            max: 10.0,
        },
    ),
    ("field_radius_m", LENGTH_M),
    ("lasting_range_error", Bound::Share),
    ("localized_sd_m", POSITIVE),
    ("lost_sd_m", POSITIVE),
    ("trip_stillness_s", POSITIVE),
    ("trip_gap_s", POSITIVE),
    ("places_max", Bound::Whole { min: 2, max: None }),
    ("legs_max", Bound::Whole { min: 1, max: None }),
    (
        "anchors_max",
        Bound::Whole {
            min: 64,
            max: Some(1 << 24),
        },
    ),
    (
        "strength_half_life_samples",
        Bound::Whole { min: 1, max: None },
    ),
];

/// How close two rows of a stored trajectory may be \[s\].
pub const TRAJECTORY_INTERVAL_S: Bound = Bound::Real {
    min: 0.001,
    is_open: false,
    max: 3600.0,
};

#[cfg(test)]
mod tests {
    use cogmap_proto::SpaceSettings;
    use serde_json::{Value, json};

    use super::*;
    use crate::decode::core_settings;

    /// The field that is refused when a setting has a value.
    fn refused(setting: &str, value: &Value) -> Option<&'static str> {
        let mut settings = serde_json::to_value(SpaceSettings::default()).expect("plain data");
        settings[setting] = value.clone();
        let settings: SpaceSettings = serde_json::from_value(settings).expect("settings");
        core_settings(&settings).err().map(|error| error.field)
    }

    #[test]
    fn the_map_refuses_what_lies_outside() {
        let interval = ("trajectory_interval_s", TRAJECTORY_INTERVAL_S);
        for (setting, bound) in SPACE_BOUNDS.into_iter().chain([interval]) {
            let (inside, outside) = match bound {
                Bound::Share => (vec![json!(0.0), json!(1.0)], vec![json!(-0.1), json!(1.1)]),
                Bound::Real { min, is_open, max } => {
                    let below = if is_open { min } else { min * 0.99 };
                    (vec![json!(max)], vec![json!(below), json!(max * 1.01)])
                }
                Bound::Whole { min, max } => {
                    let above = max.map(|max| json!(max + 1));
                    (
                        vec![json!(min)],
                        std::iter::once(json!(min - 1)).chain(above).collect(),
                    )
                }
            };
            for value in outside {
                assert_eq!(refused(setting, &value), Some(setting), "{setting} {value}");
            }
            for value in inside {
                // One that is localised is not lost.
                let refused = refused(setting, &value).filter(|field| *field == setting);
                assert_eq!(refused, None, "{setting} {value}");
            }
        }
    }
}
