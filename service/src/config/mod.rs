//! Settings of the service: from a TOML file, then the environment, then flags; the later wins.
//!
//! `cogmap.toml` beside the crate's manifest documents every key with its default, unit and reason.
//! In the environment `COGMAP_HTTP__LISTEN` stands for `http.listen`; see [`Assignment`] for the
//! rules. Nothing unknown is ignored: a misspelt key is an error.

mod assignment;
mod cluster;
mod engine;
mod error;
mod http;
mod log;
mod setting;
mod store;
mod zenoh;

use std::collections::BTreeMap;
use std::path::Path;

use cogmap_proto::{Name, SpaceSettings};
use serde::{Deserialize, Serialize};

use crate::decode::core_settings;
use crate::http::HttpSettings;
pub use crate::http::Token;

pub use assignment::Assignment;
pub use cluster::ClusterConfig;
pub use engine::EngineConfig;
pub use error::ConfigError;
pub use http::HttpConfig;
pub use log::{LogConfig, LogFormat};
pub use store::StoreConfig;
pub use zenoh::{ZenohConfig, ZenohEncoding, ZenohMode};

/// All settings of the service.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// The HTTP interface.
    pub http: HttpConfig,
    /// The Zenoh session.
    pub zenoh: ZenohConfig,
    /// Where the journal and what is derived from it are kept.
    pub store: StoreConfig,
    /// The part of the service in a cluster.
    pub cluster: ClusterConfig,
    /// Bounds and intervals of the engine.
    pub engine: EngineConfig,
    /// Spaces that exist from the start; those that the store does not hold yet are created.
    pub spaces: BTreeMap<Name, SpaceSettings>,
    /// What is logged, and how.
    pub log: LogConfig,
}

impl Default for Config {
    fn default() -> Self {
        let name: Name = "default".parse().expect("the word is a name");
        Self {
            http: HttpConfig::default(),
            zenoh: ZenohConfig::default(),
            store: StoreConfig::default(),
            cluster: ClusterConfig::default(),
            engine: EngineConfig::default(),
            spaces: BTreeMap::from([(name, SpaceSettings::default())]),
            log: LogConfig::default(),
        }
    }
}

impl Config {
    /// Settings from the file at `path`, if one is given, then the process's environment, then
    /// `overrides` (`key=value`, the key with dots between its levels), each checked.
    ///
    /// # Errors
    /// Names the source, the key and the rule that it breaks.
    pub fn load(path: Option<&Path>, overrides: &[String]) -> Result<Self, ConfigError> {
        Self::load_over(toml::Table::new(), path, overrides)
    }

    /// As [`Config::load`], with other defaults for some keys: what no source says comes from
    /// `defaults`, and from [`Config::default`] only where these say nothing either.
    ///
    /// # Errors
    /// As [`Config::load`].
    pub fn load_over(
        defaults: toml::Table,
        path: Option<&Path>,
        overrides: &[String],
    ) -> Result<Self, ConfigError> {
        let environment = std::env::vars_os()
            .filter_map(|(name, value)| Some((name.into_string().ok()?, value)))
            .map(|(name, value)| (name, value.to_string_lossy().into_owned()));
        Self::from_sources_over(defaults, path, environment, overrides)
    }

    /// As [`Config::load`], with the environment as an argument.
    ///
    /// # Errors
    /// As [`Config::load`].
    pub fn from_sources(
        path: Option<&Path>,
        environment: impl IntoIterator<Item = (String, String)>,
        overrides: &[String],
    ) -> Result<Self, ConfigError> {
        Self::from_sources_over(toml::Table::new(), path, environment, overrides)
    }

    fn from_sources_over(
        defaults: toml::Table,
        path: Option<&Path>,
        environment: impl IntoIterator<Item = (String, String)>,
        overrides: &[String],
    ) -> Result<Self, ConfigError> {
        let mut table = defaults;
        if let Some(path) = path {
            let source = path.display().to_string();
            let text = std::fs::read_to_string(path)
                .map_err(|error| ConfigError::source(&source, &error))?;
            // On its own, so that an error names the line of the file.
            let _: Self =
                toml::from_str(&text).map_err(|error| ConfigError::source(&source, &error))?;
            let of_file =
                toml::from_str(&text).map_err(|error| ConfigError::source(&source, &error))?;
            put_over(&mut table, of_file);
        }
        let mut config: Self = table
            .clone()
            .try_into()
            .map_err(|error| ConfigError::source("settings", &error))?;
        let mut assignments = Assignment::of_environment(environment)?;
        for text in overrides {
            assignments.push(Assignment::of_flag(text)?);
        }
        for assignment in &assignments {
            (table, config) = assignment.apply(&table)?;
        }
        config.http.read_token_file()?;
        config.check()?;
        Ok(config)
    }

    /// Checks what types alone cannot say.
    ///
    /// # Errors
    /// Names the first key that breaks its rule, its value and the rule.
    pub fn check(&self) -> Result<(), ConfigError> {
        self.http.check()?;
        self.zenoh.check()?;
        self.store.check()?;
        self.cluster.check(self)?;
        self.engine.check()?;
        self.log.check()?;
        for (name, settings) in &self.spaces {
            let source = format!("spaces.{name}");
            core_settings(settings).map_err(|error| ConfigError::source(&source, &error))?;
        }
        Ok(())
    }

    /// What the HTTP interface needs to know. Other nodes ask a node by its address.
    pub fn http_settings(&self) -> HttpSettings {
        let mut settings = self.http.settings();
        if self.cluster.enabled {
            settings.hosts = settings.hosts.and_host_of(&self.cluster.address);
        }
        settings
    }

    /// The effective settings as TOML; the token is not shown.
    ///
    /// # Panics
    /// Never: all keys are texts, and all values have a form in TOML.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("settings are tables of plain values")
    }
}

/// Puts the values of a table over those of another one, section by section.
fn put_over(under: &mut toml::Table, over: toml::Table) {
    for (key, value) in over {
        match (under.get_mut(&key), value) {
            (Some(toml::Value::Table(under)), toml::Value::Table(over)) => put_over(under, over),
            (_, value) => {
                under.insert(key, value);
            }
        }
    }
}

#[cfg(test)]
mod document;
#[cfg(test)]
mod tests;
