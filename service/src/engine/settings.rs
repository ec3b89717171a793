//! Bounds and intervals of the engine.

use std::time::Duration;

use cogmap_proto::SpaceSettings;

/// How much the engine holds and how long it waits. None of these changes the maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EngineSettings {
    /// Most messages that wait for a space's writer; further ones are dropped and counted.
    pub queue_messages: usize,
    /// Most bytes of such messages.
    pub queue_bytes: usize,
    /// Most agents of a space; samples of further names are dropped and counted.
    pub agents_max: usize,
    /// How far ahead of the service's clock the number of a session may be that begins.
    pub session_ahead_max: Duration,
    /// Most spaces of the service.
    pub spaces_max: usize,
    /// How far ahead of the next sample of an agent one may be that waits for it; further ones are
    /// dropped and counted, and the client sends them again.
    pub reorder_window: usize,
    /// How long missing samples are waited for before they count as lost.
    pub gap_timeout: Duration,
    /// Longest time between the syncs of the store while samples come in.
    pub commit_interval: Duration,
    /// Time between checkpoints while samples come in.
    pub checkpoint_interval: Duration,
    /// Threads that relax the past and index objects of all spaces; 0 leaves it to the spaces'
    /// writers.
    pub relaxation_threads: usize,
}

impl Default for EngineSettings {
    fn default() -> Self {
        Self {
            queue_messages: 131_072,
            queue_bytes: 64 << 20,
            agents_max: 1024,
            session_ahead_max: Duration::from_secs(86_400),
            spaces_max: 256,
            reorder_window: 8192,
            gap_timeout: Duration::from_secs(10),
            commit_interval: Duration::from_millis(10),
            checkpoint_interval: Duration::from_secs(30),
            relaxation_threads: 2,
        }
    }
}

/// The settings of a space that are not as they are given, each with both values.
pub(crate) fn differences(there: &SpaceSettings, given: &SpaceSettings) -> String {
    let fields = |settings| match serde_json::to_value(settings) {
        Ok(serde_json::Value::Object(fields)) => fields,
        _ => unreachable!("settings are an object"),
    };
    let (there, given) = (fields(there), fields(given));
    let other = there.iter().filter_map(|(name, value)| {
        let wanted = given.get(name).unwrap_or(&serde_json::Value::Null);
        (wanted != value).then(|| format!("{name} is {value}, not {wanted}"))
    });
    other.collect::<Vec<_>>().join("; ")
}
