//! Settings of the store.

use std::path::PathBuf;

use super::ConfigError;
use super::setting::{Rule, section};
use crate::store::Shards;

const DIRECTORY: Rule<PathBuf> = Rule {
    words: "the path of a directory",
    holds: |path| !path.as_os_str().is_empty(),
    shown: |_| "empty".to_owned(),
};

const URL: Rule<String> = Rule {
    words: "a URL such as s3://bucket/prefix, or empty",
    holds: |url| {
        url.is_empty()
            || url
                .split_once("://")
                .is_some_and(|(scheme, _)| !scheme.is_empty())
    },
    shown: String::clone,
};

const SHARDS: Rule<u32> = Rule {
    words: "1 to 1024",
    holds: |count| (1..=1024).contains(count),
    shown: u32::to_string,
};

section! {
    /// Settings of the store.
    pub struct StoreConfig of "store" {
        /// Directory of the store, relative to the working directory; created when it is not there.
        directory: PathBuf = PathBuf::from("cogmap-data"), DIRECTORY;
        /// Object storage in place of the directory: `s3://bucket/prefix`, `gs://…`, `az://…` or
        /// `file:///directory`. Region, endpoint and credentials come from the provider's own
        /// environment variables. Only in builds with the feature `object-storage`.
        url: String = String::new(), URL;
        /// Databases that a new store on object storage is divided into: each space is in one of
        /// them, and each has one owner among the nodes of a cluster. Fixed when it is created.
        shards: u32 = 1, SHARDS;
    }
}

impl StoreConfig {
    /// Where the store is: its URL or the whole path of its directory.
    pub fn place(&self) -> String {
        if self.url.is_empty() {
            let whole = std::path::absolute(&self.directory);
            whole
                .as_ref()
                .unwrap_or(&self.directory)
                .display()
                .to_string()
        } else {
            self.url.clone()
        }
    }

    /// The shards of a new store. They must have been checked.
    pub fn shards(&self) -> Shards {
        Shards::new(self.shards).unwrap_or(Shards::ONE)
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        self.check_values()
    }
}
