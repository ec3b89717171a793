//! Settings of the space, as the command line states them.

use cogmap::decode::core_settings;
use cogmap_proto::SpaceSettings;
use serde_json::Value;

/// The settings of odometry are a table within those of a space; their names are no others', so
/// they may go without that of the table.
const ODOMETRY: &str = "odometry_noise";

/// One setting of a space, and its value.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Setting {
    pub(super) name: String,
    pub(super) value: Value,
}

impl Setting {
    /// Reads `NAME=VALUE` and checks it.
    pub(super) fn read(text: &str) -> Result<Self, String> {
        let (name, value) = text.split_once('=').ok_or("not NAME=VALUE")?;
        let value = serde_json::from_str(value).map_err(|error| format!("{value:?}: {error}"))?;
        let setting = Self {
            name: name.to_owned(),
            value,
        };
        settings(std::slice::from_ref(&setting)).map(|_| setting)
    }

    fn set(&self, all: &mut Value) -> Option<()> {
        let name = self.name.as_str();
        let of_odometry = name
            .strip_prefix(ODOMETRY)
            .and_then(|rest| rest.strip_prefix('.'));
        let slot = match (of_odometry, all.get(name)) {
            (None, Some(_)) => all.get_mut(name),
            (of_odometry, _) => { all.get_mut(ODOMETRY) }
                .and_then(|table| table.get_mut(of_odometry.unwrap_or(name))),
        };
        *slot? = self.value.clone();
        Some(())
    }
}

/// The settings of a space that are these, and otherwise the default.
pub(super) fn settings(changed: &[Setting]) -> Result<SpaceSettings, String> {
    let text = |error: serde_json::Error| error.to_string();
    let mut all = serde_json::to_value(SpaceSettings::default()).map_err(text)?;
    for setting in changed {
        let name = &setting.name;
        let set = setting.set(&mut all);
        set.ok_or_else(|| format!("a space has no setting {name:?}"))?;
    }
    let settings: SpaceSettings = serde_json::from_value(all).map_err(text)?;
    core_settings(&settings).map_err(|error| error.to_string())?;
    Ok(settings)
}

#[cfg(test)]
mod tests {
    use cogmap_proto::SpaceSettings;

    use super::{Setting, settings};

    #[test]
    fn a_setting_is_found_also_among_those_of_odometry() {
        let mut expected = SpaceSettings::default();
        expected.odometry_noise.bias_sd_rad_s = 0.0;
        expected.keyframe_spacing_m = 0.5;
        for bias in ["bias_sd_rad_s=0", "odometry_noise.bias_sd_rad_s=0"] {
            let changed = [bias, "keyframe_spacing_m=0.5"];
            let changed: Vec<Setting> = changed.map(|text| Setting::read(text).unwrap()).into();
            assert_eq!(settings(&changed).as_ref(), Ok(&expected));
        }
        assert_eq!(settings(&[]), Ok(SpaceSettings::default()));
    }

    #[test]
    fn what_a_space_does_not_take_is_refused() {
        for (text, why) in [
            ("bias", "NAME=VALUE"),
            ("bias=0", "no setting"),
            ("odometry_noise.bias=0", "no setting"),
            ("odometry_noise.keyframe_spacing_m=1", "no setting"),
            ("odometry_noise=0", "invalid type"),
            ("keyframe_spacing_m=wide", "expected"),
            ("keyframe_spacing_m=-1", "keyframe_spacing_m"),
            ("keyframe_spacing_m=true", "invalid type"),
        ] {
            let refused = Setting::read(text).unwrap_err();
            assert!(refused.contains(why), "{text}: {refused}");
        }
    }
}
