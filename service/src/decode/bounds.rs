//! Bounds of a space's settings, for those who ask before they try: the map itself checks them.

pub use cognitive_map::Bound;
use cognitive_map::SettingNumber;

/// How close two rows of a stored trajectory may be \[s\]. The map knows of none.
pub(super) const TRAJECTORY_INTERVAL_S: Bound = Bound::from(0.001, 3600.0);

/// Each number of a space's settings with what it may be, those of the odometry's noise among them.
pub fn setting_bounds() -> impl Iterator<Item = (&'static str, Bound)> {
    let of_map = SettingNumber::ALL.into_iter();
    of_map
        .map(|number| (number.name, number.bound))
        .chain([("trajectory_interval_s", TRAJECTORY_INTERVAL_S)])
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use cogmap_proto::SpaceSettings;
    use serde_json::{Map, Value, json};

    use super::*;
    use crate::decode::core_settings;

    /// The settings of a message, with those of the odometry's noise beside the others.
    fn flat(settings: &SpaceSettings) -> Map<String, Value> {
        let mut all = serde_json::to_value(settings).expect("plain data");
        let all = all.as_object_mut().expect("settings have names");
        let noise = all.remove("odometry_noise").expect("there");
        all.extend(noise.as_object().expect("it has names").clone());
        all.clone()
    }

    /// The field that is refused when a setting has a value.
    fn refused(setting: &str, value: &Value) -> Option<&'static str> {
        let mut settings = serde_json::to_value(SpaceSettings::default()).expect("plain data");
        let noise = &mut settings["odometry_noise"];
        if noise.get(setting).is_some() {
            noise[setting] = value.clone();
        } else {
            settings[setting] = value.clone();
        }
        let settings: SpaceSettings = serde_json::from_value(settings).expect("settings");
        core_settings(&settings).err().map(|error| error.field)
    }

    #[test]
    fn the_message_and_the_map_have_the_same_settings() {
        let bounds: BTreeMap<_, _> = setting_bounds().collect();
        let told = flat(&SpaceSettings::default());
        // The seed may be any number, and recruitment and a choice are none.
        let numbers = told.iter().filter(|(name, value)| {
            let name = name.as_str();
            name != "seed" && name != "recruitment" && !value.is_boolean()
        });
        let names: Vec<_> = numbers.map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, bounds.into_keys().collect::<Vec<_>>());
        let core = core_settings(&SpaceSettings::default()).expect("the defaults are valid");
        assert_eq!(core, cognitive_map::Settings::default());
    }

    #[test]
    fn the_map_refuses_what_lies_outside() {
        for (setting, bound) in setting_bounds() {
            let (inside, outside) = match bound {
                Bound::Share => (vec![json!(0.0), json!(1.0)], vec![json!(-0.1), json!(1.1)]),
                Bound::Real { min, is_open, max } => {
                    let below = if is_open {
                        min
                    } else {
                        min - 0.01 * min.abs().max(0.1)
                    };
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
