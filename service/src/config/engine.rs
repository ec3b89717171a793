//! Settings of the engine, as the file has them.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::ConfigError;
use super::rule::{INTERVAL_S, check, is_interval_s};
use crate::engine::EngineSettings;

/// Bounds and intervals of the engine. None of these changes the maps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EngineConfig {
    /// Most messages that wait for a space's writer.
    pub queue_messages: usize,
    /// Most bytes of such messages.
    pub queue_bytes: usize,
    /// Most agents of a space.
    pub agents_max: usize,
    /// How far ahead of the service's clock the number of a session may be that begins \[s\].
    pub session_ahead_max_s: f64,
    /// Most spaces.
    pub spaces_max: usize,
    /// How far ahead of the next sample of an agent one may be that waits for it.
    pub reorder_window_samples: usize,
    /// How long missing samples are waited for before they count as lost \[s\].
    pub gap_timeout_s: f64,
    /// Longest time between syncs of the store while samples come in \[s\].
    pub commit_interval_s: f64,
    /// Time between checkpoints while samples come in \[s\].
    pub checkpoint_interval_s: f64,
}

impl Default for EngineConfig {
    fn default() -> Self {
        let settings = EngineSettings::default();
        Self {
            queue_messages: settings.queue_messages,
            queue_bytes: settings.queue_bytes,
            agents_max: settings.agents_max,
            session_ahead_max_s: settings.session_ahead_max.as_secs_f64(),
            spaces_max: settings.spaces_max,
            reorder_window_samples: settings.reorder_window,
            gap_timeout_s: settings.gap_timeout.as_secs_f64(),
            commit_interval_s: settings.commit_interval.as_secs_f64(),
            checkpoint_interval_s: settings.checkpoint_interval.as_secs_f64(),
        }
    }
}

impl EngineConfig {
    /// What the engine itself takes. The times must have been checked.
    pub fn settings(&self) -> EngineSettings {
        EngineSettings {
            queue_messages: self.queue_messages,
            queue_bytes: self.queue_bytes,
            agents_max: self.agents_max,
            session_ahead_max: Duration::from_secs_f64(self.session_ahead_max_s),
            spaces_max: self.spaces_max,
            reorder_window: self.reorder_window_samples,
            gap_timeout: Duration::from_secs_f64(self.gap_timeout_s),
            commit_interval: Duration::from_secs_f64(self.commit_interval_s),
            checkpoint_interval: Duration::from_secs_f64(self.checkpoint_interval_s),
        }
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        let counts = [
            ("engine.queue_messages", self.queue_messages),
            ("engine.agents_max", self.agents_max),
            ("engine.spaces_max", self.spaces_max),
            ("engine.reorder_window_samples", self.reorder_window_samples),
        ];
        for (key, value) in counts {
            check(
                (1..=1_000_000).contains(&value),
                key,
                &value,
                "1 to 1000000",
            )?;
        }
        let bytes = self.queue_bytes;
        let rule = "at least 2097152, two of the longest messages";
        check(bytes >= 2 << 20, "engine.queue_bytes", &bytes, rule)?;
        let ahead = self.session_ahead_max_s;
        check(
            (1.0..=1e9).contains(&ahead),
            "engine.session_ahead_max_s",
            &ahead,
            "1 to 1e9 seconds",
        )?;
        let times = [
            ("engine.gap_timeout_s", self.gap_timeout_s),
            ("engine.commit_interval_s", self.commit_interval_s),
            ("engine.checkpoint_interval_s", self.checkpoint_interval_s),
        ];
        for (key, value) in times {
            check(is_interval_s(value), key, &value, INTERVAL_S)?;
        }
        Ok(())
    }
}
