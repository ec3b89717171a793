//! What the engine counts. Handles are taken once, so that counting costs one atomic addition.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use cogmap_proto::{Codec, DecodeError, SkipReason, Status};
use cognitive_map::{ChannelKind, CognitiveMap, Event, EventKind};
use metrics::{Counter, Gauge, Histogram, counter, gauge, histogram};

use super::live::Live;
use super::sequencer::Offered;
use crate::encode;
use crate::metrics as names;

/// Least time between two log lines about the same kind of fault of a sender.
const SAYING_INTERVAL: Duration = Duration::from_secs(10);

/// When something was last said in the log that would otherwise be said for every message.
struct Sparingly(Mutex<Option<Instant>>);

impl Sparingly {
    const fn new() -> Self {
        Self(Mutex::new(None))
    }

    /// Whether it is time to say it again.
    fn now(&self) -> bool {
        let mut said = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let due = said.is_none_or(|at| at.elapsed() >= SAYING_INTERVAL);
        if due {
            *said = Some(Instant::now());
        }
        due
    }
}

/// Why a message is dropped whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Drop {
    BadKey,
    UnknownSpace,
    QueueFull,
    AgentQueueFull,
    SpaceClosed,
    TooManyAgents,
    StaleSession,
    SessionInFuture,
    StoreFailed,
}

impl Drop {
    const ALL: [Self; 9] = [
        Self::BadKey,
        Self::UnknownSpace,
        Self::QueueFull,
        Self::AgentQueueFull,
        Self::SpaceClosed,
        Self::TooManyAgents,
        Self::StaleSession,
        Self::SessionInFuture,
        Self::StoreFailed,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::BadKey => "bad_key",
            Self::UnknownSpace => "unknown_space",
            Self::QueueFull => "queue_full",
            Self::AgentQueueFull => "agent_queue_full",
            Self::SpaceClosed => "space_closed",
            Self::TooManyAgents => "too_many_agents",
            Self::StaleSession => "stale_session",
            Self::SessionInFuture => "session_in_future",
            Self::StoreFailed => "store_failed",
        }
    }
}

/// Counters of messages on their way to a space.
#[derive(Debug)]
pub(crate) struct IntakeCounters {
    messages: [Counter; 3],
    bytes: [Counter; 3],
    dropped: [Counter; Drop::ALL.len()],
}

impl IntakeCounters {
    pub(crate) fn new() -> Self {
        let codecs = [Codec::Postcard, Codec::Cbor, Codec::Json];
        Self {
            messages: codecs
                .map(|codec| counter!(names::RECEIVED_MESSAGES, "codec" => codec.name())),
            bytes: codecs.map(|codec| counter!(names::RECEIVED_BYTES, "codec" => codec.name())),
            dropped: dropped(),
        }
    }

    /// Counts a message for a space that does not exist, and says so in the log now and then:
    /// whoever misspelt a name looks there.
    pub(crate) fn unknown_space(&self, space: &str) {
        static SAID: Sparingly = Sparingly::new();
        self.dropped(Drop::UnknownSpace);
        if SAID.now() {
            tracing::warn!(space, "samples for a space that does not exist are dropped");
        }
    }

    pub(crate) fn received(&self, codec: Codec, bytes: usize) {
        self.messages[codec as usize].increment(1);
        self.bytes[codec as usize].increment(bytes as u64);
    }

    pub(crate) fn dropped(&self, reason: Drop) {
        self.dropped[reason as usize].increment(1);
    }
}

/// Counters of one space's writer.
pub(crate) struct SpaceCounters {
    space: String,
    live: Arc<Live>,
    dropped: [Counter; Drop::ALL.len()],
    applied: Counter,
    duplicates: Counter,
    reordered: Counter,
    beyond_window: Counter,
    abandoned: Counter,
    journal_bytes: Counter,
    round_samples: Histogram,
    level_surprise: Histogram,
    descriptor_surprise: Histogram,
    published: Counter,
    queue: Gauge,
    agents: Gauge,
    places: Gauge,
    trips: Gauge,
    landmarks: Gauge,
    by_status: [Gauge; 4],
    not_durable_max: Gauge,
    waiting_max: Gauge,
    made_room: Counter,
    forgotten_places: Counter,
    forgotten_trips: Counter,
}

impl SpaceCounters {
    /// Counters of the space of a name. Totals and sizes go to those who watch it, too.
    pub(crate) fn new(space: &str, live: &Arc<Live>) -> Self {
        let label = || space.to_owned();
        Self {
            space: space.to_owned(),
            live: Arc::clone(live),
            dropped: dropped(),
            applied: counter!(names::APPLIED_SAMPLES, "space" => label()),
            duplicates: counter!(names::DUPLICATE_SAMPLES, "space" => label()),
            reordered: counter!(names::REORDERED_SAMPLES, "space" => label()),
            beyond_window: counter!(names::BEYOND_WINDOW_SAMPLES, "space" => label()),
            abandoned: counter!(names::ABANDONED_SAMPLES, "space" => label()),
            journal_bytes: counter!(names::JOURNAL_BYTES, "space" => label()),
            round_samples: histogram!(names::ROUND_SAMPLES, "space" => label()),
            level_surprise: histogram!(names::LEVEL_SURPRISE, "space" => label()),
            descriptor_surprise: histogram!(names::DESCRIPTOR_SURPRISE, "space" => label()),
            published: counter!(names::PUBLISHED_ESTIMATES, "space" => label()),
            queue: gauge!(names::QUEUE_MESSAGES, "space" => label()),
            agents: gauge!(names::AGENTS, "space" => label()),
            places: gauge!(names::PLACES, "space" => label()),
            trips: gauge!(names::TRIPS, "space" => label()),
            landmarks: gauge!(names::LANDMARKS, "space" => label()),
            by_status: ["localized", "uncertain", "lost", "new"].map(
                |status| gauge!(names::AGENTS_BY_STATUS, "space" => label(), "status" => status),
            ),
            not_durable_max: gauge!(names::NOT_DURABLE_MAX, "space" => label()),
            waiting_max: gauge!(names::WAITING_MAX, "space" => label()),
            made_room: counter!(names::AGENTS_MADE_ROOM, "space" => label()),
            forgotten_places: counter!(names::FORGOTTEN_PLACES, "space" => label()),
            forgotten_trips: counter!(names::FORGOTTEN_TRIPS, "space" => label()),
        }
    }

    pub(crate) fn dropped(&self, reason: Drop) {
        self.live.totals.dropped.add(1);
        self.dropped[reason as usize].increment(1);
    }

    /// Counts samples refused for good, or lost.
    pub(crate) fn skipped(&self, samples: u64, reason: SkipReason) {
        let reason = match reason {
            SkipReason::Lost => "lost",
            SkipReason::NumberOutOfRange => "number_out_of_range",
            SkipReason::NonUnitQuaternion => "non_unit_quaternion",
            SkipReason::NegativeNoise => "negative_noise",
            SkipReason::TimeBackwards => "time_backwards",
            SkipReason::InvalidDescriptor => "invalid_descriptor",
            SkipReason::InvalidLabel => "invalid_label",
            SkipReason::InvalidNormal => "invalid_normal",
            SkipReason::SequenceLeap => "sequence_leap",
        };
        self.live.totals.skipped.add(samples);
        let space = self.space.clone();
        counter!(names::SKIPPED_SAMPLES, "space" => space, "reason" => reason).increment(samples);
    }

    pub(crate) fn offered(&self, offered: &Offered) {
        self.live.totals.duplicates.add(offered.duplicates);
        self.duplicates.increment(offered.duplicates);
        self.reordered.increment(offered.reordered);
        self.beyond_window.increment(offered.beyond_window);
    }

    /// Counts samples that waited for earlier ones when their session was taken over.
    pub(crate) fn abandoned(&self, samples: usize) {
        self.abandoned.increment(samples as u64);
    }

    /// Counts an agent that was removed so that another one could enrol.
    pub(crate) fn made_room(&self) {
        self.made_room.increment(1);
    }

    /// Forgets the sizes of a space that is gone.
    pub(crate) fn gone(&self) {
        for gauge in [
            &self.queue,
            &self.agents,
            &self.places,
            &self.trips,
            &self.landmarks,
            &self.not_durable_max,
            &self.waiting_max,
        ] {
            gauge.set(0.0);
        }
        self.by_status.iter().for_each(|gauge| gauge.set(0.0));
    }

    /// Counts a round that applied samples.
    pub(crate) fn round(&self, samples: u64, estimates: u64) {
        if samples > 0 {
            self.live.totals.applied.add(samples);
            self.applied.increment(samples);
            self.round_samples.record(samples as f64);
            self.published.increment(estimates);
        }
    }

    /// Counts what was forgotten, and records how far a percept was from what was expected.
    pub(crate) fn event(&self, map: &CognitiveMap, event: &Event) {
        match &event.kind {
            EventKind::PlaceForgotten { .. } => self.forgotten_places.increment(1),
            EventKind::TripForgotten { .. } => self.forgotten_trips.increment(1),
            EventKind::PerceptCompared {
                channel, surprise, ..
            } => {
                let Some(channel) = map.channel(*channel) else {
                    return;
                };
                let histogram = match channel.kind() {
                    ChannelKind::Level => &self.level_surprise,
                    ChannelKind::Descriptor { .. } => &self.descriptor_surprise,
                };
                histogram.record(*surprise);
            }
            _ => {}
        }
    }

    pub(crate) fn journaled(&self, bytes: usize) {
        self.journal_bytes.increment(bytes as u64);
    }

    pub(crate) fn sizes(&self, map: &CognitiveMap, queued: usize) {
        self.queue.set(queued as f64);
        self.agents.set(map.agent_count() as f64);
        self.places.set(map.place_count() as f64);
        self.trips.set(map.trip_count() as f64);
        self.landmarks.set(map.landmark_count() as f64);
        self.live.note_counts(encode::live_counts(map));
    }

    /// Records how the agents stand.
    pub(crate) fn standing(&self, standing: &Standing) {
        for (gauge, count) in self.by_status.iter().zip(standing.by_status) {
            gauge.set(f64::from(count));
        }
        self.not_durable_max.set(standing.not_durable_max as f64);
        self.waiting_max.set(standing.waiting_max as f64);
    }
}

/// How agents stand, one after the other.
#[derive(Debug, Default)]
pub(crate) struct Standing {
    by_status: [u32; 4],
    not_durable_max: u64,
    waiting_max: u64,
}

impl Standing {
    /// Notes an agent: how it is localised, none before its first sample, and how many of its
    /// samples are not durable and wait.
    pub(crate) fn note(&mut self, status: Option<Status>, not_durable: u64, waiting: u64) {
        let index = match status {
            Some(Status::Localized) => 0,
            Some(Status::Uncertain) => 1,
            Some(Status::Lost) => 2,
            None => 3,
        };
        self.by_status[index] += 1;
        self.not_durable_max = self.not_durable_max.max(not_durable);
        self.waiting_max = self.waiting_max.max(waiting);
    }
}

/// Counters of the committer.
pub(crate) struct CommitCounters {
    latency: Histogram,
}

impl CommitCounters {
    pub(crate) fn new() -> Self {
        Self {
            latency: histogram!(names::COMMIT_SECONDS),
        }
    }

    pub(crate) fn latency(&self, latency: Duration) {
        self.latency.record(latency.as_secs_f64());
    }

    #[expect(
        clippy::unused_self,
        reason = "the handle belongs to a space, spaces come and go"
    )]
    pub(crate) fn durable(&self, space: &str, samples: u64) {
        counter!(names::DURABLE_SAMPLES, "space" => space.to_owned()).increment(samples);
    }
}

/// Counts a message that cannot be read, and says so in the log now and then.
pub(crate) fn undecodable(key: &str, error: &DecodeError) {
    static SAID: Sparingly = Sparingly::new();
    if SAID.now() {
        tracing::warn!(key, %error, "messages that cannot be read are dropped");
    }
    let kind = match error {
        DecodeError::UnknownEncoding(_) => "unknown_encoding",
        DecodeError::UnsupportedVersion(_) => "unsupported_version",
        DecodeError::TooLong(_) => "too_long",
        DecodeError::Malformed { .. } => "malformed",
        DecodeError::EmptyBatch => "empty_batch",
        DecodeError::TooManySamples(_) => "too_many_samples",
        DecodeError::SequenceOverflow => "sequence_overflow",
        DecodeError::LastSession => "last_session",
    };
    counter!(names::DECODE_ERRORS, "kind" => kind).increment(1);
}

fn dropped() -> [Counter; Drop::ALL.len()] {
    Drop::ALL.map(|reason| counter!(names::DROPPED_MESSAGES, "reason" => reason.name()))
}
