//! Settings of the engine, as the file has them.

use std::time::Duration;

use super::ConfigError;
use super::setting::{COUNT, INTERVAL_S, Rule, section};
use crate::engine::EngineSettings;

/// Two of the longest messages fit.
const BYTES: Rule<usize> = Rule {
    words: "at least 2097152, two of the longest messages",
    holds: |bytes| *bytes >= 2 << 20,
    shown: usize::to_string,
};

const AHEAD_S: Rule<f64> = Rule {
    words: "1 to 1e9 seconds",
    holds: |time_s| (1.0..=1e9).contains(time_s),
    shown: f64::to_string,
};

const THREADS: Rule<usize> = Rule {
    words: "0 to 64",
    holds: |count| *count <= 64,
    shown: usize::to_string,
};

section! {
    /// Bounds and intervals of the engine. None of these changes the maps.
    pub struct EngineConfig of "engine" {
        /// Most messages that wait for a space's writer.
        queue_messages: usize = EngineSettings::default().queue_messages, COUNT;
        /// Most bytes of such messages.
        queue_bytes: usize = EngineSettings::default().queue_bytes, BYTES;
        /// Most agents of a space.
        agents_max: usize = EngineSettings::default().agents_max, COUNT;
        /// How far ahead of the service's clock the number of a session may be that begins \[s\].
        session_ahead_max_s: f64 =
            EngineSettings::default().session_ahead_max.as_secs_f64(), AHEAD_S;
        /// Most spaces.
        spaces_max: usize = EngineSettings::default().spaces_max, COUNT;
        /// How far ahead of the next sample of an agent one may be that waits for it.
        reorder_window_samples: usize = EngineSettings::default().reorder_window, COUNT;
        /// How long missing samples are waited for before they count as lost \[s\].
        gap_timeout_s: f64 = EngineSettings::default().gap_timeout.as_secs_f64(), INTERVAL_S;
        /// Longest time between syncs of the store while samples come in \[s\].
        commit_interval_s: f64 =
            EngineSettings::default().commit_interval.as_secs_f64(), INTERVAL_S;
        /// Time between checkpoints while samples come in \[s\].
        checkpoint_interval_s: f64 =
            EngineSettings::default().checkpoint_interval.as_secs_f64(), INTERVAL_S;
        /// Threads that relax the past and index objects beside the writers of all spaces; 0
        /// leaves it to the writers.
        relaxation_threads: usize = EngineSettings::default().relaxation_threads, THREADS;
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
            relaxation_threads: self.relaxation_threads,
        }
    }

    pub(super) fn check(&self) -> Result<(), ConfigError> {
        self.check_values()
    }
}
