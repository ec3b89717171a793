//! Settings of the store.

use std::path::PathBuf;

use super::ConfigError;
use super::setting::{Rule, section};

const DIRECTORY: Rule<PathBuf> = Rule {
    words: "the path of a directory",
    holds: |path| !path.as_os_str().is_empty(),
    shown: |_| "empty".to_owned(),
};

section! {
    /// Settings of the store.
    pub struct StoreConfig of "store" {
        /// Directory of the store, relative to the working directory; created when it is not there.
        directory: PathBuf = PathBuf::from("cogmap-data"), DIRECTORY;
    }
}

impl StoreConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        self.check_values()
    }
}
