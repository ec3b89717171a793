//! Settings of the store.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::ConfigError;
use super::rule::check;

/// Settings of the store.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StoreConfig {
    /// Directory of the store, relative to the working directory; created when it is not there.
    pub directory: PathBuf,
}

impl Default for StoreConfig {
    fn default() -> Self {
        Self {
            directory: PathBuf::from("cogmap-data"),
        }
    }
}

impl StoreConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        let named = !self.directory.as_os_str().is_empty();
        check(
            named,
            "store.directory",
            &"empty",
            "the path of a directory",
        )
    }
}
