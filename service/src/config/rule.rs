//! The rules that values are checked against.

use std::fmt::Display;

use super::ConfigError;

/// Checks that `value` of `key` keeps `rule`, which `holds` says.
pub(super) fn check(
    holds: bool,
    key: &'static str,
    value: &dyn Display,
    rule: &'static str,
) -> Result<(), ConfigError> {
    if holds {
        Ok(())
    } else {
        Err(ConfigError::Invalid {
            key,
            value: value.to_string(),
            rule,
        })
    }
}

/// Whether a time is one that a timer can wait for: a day at most. NaN is not.
pub(super) fn is_interval_s(value: f64) -> bool {
    (0.001..=86_400.0).contains(&value)
}

/// What [`is_interval_s`] asks for, in words.
pub(super) const INTERVAL_S: &str = "0.001 to 86400 seconds";
