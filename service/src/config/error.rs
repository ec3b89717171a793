//! Errors of the settings.

use std::fmt::Display;

/// Why the settings cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ConfigError {
    /// A file, variable or flag cannot be read as settings.
    #[error("{source_name}: {detail}")]
    Source {
        /// The file, variable or flag.
        source_name: String,
        /// What is wrong with it.
        detail: String,
    },
    /// A value breaks its rule.
    #[error("{key} is {value}, but must be {rule}")]
    Invalid {
        /// The key, with dots between its levels.
        key: &'static str,
        /// Its value.
        value: String,
        /// The rule.
        rule: &'static str,
    },
}

impl ConfigError {
    pub(super) fn source(source_name: &str, detail: &dyn Display) -> Self {
        Self::Source {
            source_name: source_name.to_owned(),
            detail: detail.to_string().trim_end().to_owned(),
        }
    }
}
