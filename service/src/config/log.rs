//! Settings of the log.

use serde::{Deserialize, Serialize};
use tracing_subscriber::EnvFilter;

use super::ConfigError;
use super::setting::{Rule, any, section};

const FILTER: Rule<String> = Rule {
    words: "a level or a list of target=level",
    holds: |filter| EnvFilter::try_new(filter).is_ok(),
    shown: |filter| format!("{filter:?}"),
};

section! {
    /// What is logged, and how.
    pub struct LogConfig of "log" {
        /// Level, or directives by module, like `info,cogmap=debug`.
        filter: String = "info,fjall=warn,lsm_tree=warn,slatedb=warn,zenoh=warn".to_owned(), FILTER;
        /// Form of a line: for people, or one JSON object a line for machines.
        format: LogFormat = LogFormat::Text, any("text or json");
    }
}

/// Form of a line of the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LogFormat {
    /// For people.
    Text,
    /// One JSON object a line, for machines.
    Json,
}

impl LogConfig {
    pub(super) fn check(&self) -> Result<(), ConfigError> {
        self.check_values()
    }
}
