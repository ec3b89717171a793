//! The engine: spaces, each with one writer, over one store.
//!
//! ```text
//! transport, http ─► queue ─► writer: decode ─► sequence ─► journal ─► apply ─► publish
//!                                                             │
//!                                            committer: sync ─┴─► watermark
//! ```
//!
//! The writer owns the map; nobody else locks it. Readers take readouts from an agent's view, or a
//! snapshot of the whole map, which the writer hands out between two rounds.

mod agent_view;
mod checkpointer;
mod committer;
mod counters;
mod due;
mod episodes;
mod events;
mod health;
mod live;
mod message;
mod publisher;
mod question;
mod queue;
mod recovery;
mod refinement;
mod relaxers;
mod removal;
mod repair;
mod route_bounds;
mod sequencer;
mod session_bound;
mod settings;
mod shared;
mod space;
mod trajectory;
mod unavailable;
mod writer;

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use arc_swap::ArcSwap;
use cogmap_proto::{Codec, DecodeError, Name, SpaceSettings};
use cognitive_map::InvalidSettings;
use metrics::gauge;

pub use agent_view::AgentView;
#[cfg(test)]
pub(crate) use agent_view::view_of;
pub(crate) use due::Messages;
pub use events::{EVENTS_KEPT, EventFollower, Followed};
pub use message::IngestError;
pub use publisher::{Publisher, Silent};
pub use question::QuestionError;
pub use refinement::{SharedText, refined_trajectories};
pub use repair::{AgentLoss, LostBlocks, MissingSamples, RepairReport, repair};
pub use settings::EngineSettings;
pub use space::{LiveFollower, Space};
pub use trajectory::{Around, Chunk, Recorder, TrajectoryPage};
pub use unavailable::{TrajectoryError, Unavailable};

use crate::decode::{core_settings, trajectory_interval_ns};
use crate::metrics::SPACE_STOPPED;
use crate::store::{Store, StoreError, StoredSpace};
use counters::{Drop, IntakeCounters};
use health::Health;
use question::QuestionRoom;
use queue::NotQueued;
use shared::Surroundings;

/// The engine. Clones share it.
#[derive(Clone, Debug)]
pub struct Engine(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    spaces: ArcSwap<BTreeMap<String, Arc<Space>>>,
    /// Taken to create or delete a space, and to shut down.
    control: Mutex<Control>,
    health: Arc<Health>,
    intake: IntakeCounters,
    spaces_max: usize,
}

#[derive(Debug)]
struct Control {
    /// Gone after the shutdown.
    around: Option<Surroundings>,
    threads: Vec<JoinHandle<()>>,
}

/// Whether the service can do its work.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Readiness {
    /// It can.
    Ready,
    /// It can, but for these spaces, which are stopped because they are damaged.
    ReadyBut {
        /// Their names, each with the reason.
        stopped: Vec<(String, String)>,
    },
    /// These spaces are still loading.
    Recovering {
        /// Their names.
        spaces: Vec<String>,
    },
    /// It takes no samples.
    Failed {
        /// Why.
        detail: String,
    },
}

/// Why a space cannot be created or deleted.
#[derive(Debug, thiserror::Error)]
pub enum SpaceError {
    /// Its settings make no sense.
    #[error(transparent)]
    InvalidSettings(#[from] InvalidSettings),
    /// It exists with other settings, and settings are fixed on creation.
    #[error("the space exists with other settings")]
    ExistsWithOtherSettings,
    /// There are as many spaces as there may be.
    #[error("there are {0} spaces already")]
    TooManySpaces(usize),
    /// There is no such space.
    #[error("unknown space")]
    Unknown,
    /// The store failed.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The service is shutting down.
    #[error("the service is shutting down")]
    Closed,
}

/// The settings that a space was created with, for the wire and for the core.
fn stored_settings(
    stored: &StoredSpace,
) -> Result<(SpaceSettings, (cognitive_map::Settings, i64)), String> {
    let (name, number) = (&stored.name, stored.number.0);
    let bytes = stored.settings.as_ref().ok_or_else(|| {
        format!(
            "name and settings of space number {number} are lost: both copies of its record are damaged; \
             restore it from a backup, or delete it as {name:?}"
        )
    })?;
    let wrong = |detail: &dyn std::fmt::Display| format!("settings of space {name:?}: {detail}");
    let settings: SpaceSettings = serde_json::from_slice(bytes).map_err(|error| wrong(&error))?;
    let core = core_settings(&settings).map_err(|error| wrong(&error))?;
    let interval_ns = trajectory_interval_ns(&settings);
    Ok((settings, (core, interval_ns)))
}

impl Engine {
    /// Starts the spaces that the store holds. Returns at once; they load in their own threads.
    ///
    /// # Errors
    /// The list of spaces cannot be read.
    pub fn open(
        store: Arc<dyn Store>,
        settings: EngineSettings,
        publisher: Arc<dyn Publisher>,
    ) -> Result<Self, StoreError> {
        let health = Arc::new(Health::default());
        let stored = store.spaces()?;
        let (commits, committer) = committer::start(
            Arc::clone(&store),
            Arc::clone(&publisher),
            Arc::clone(&health),
            settings.commit_interval,
        );
        let (jobs, checkpointer) = checkpointer::start(Arc::clone(&store), Arc::clone(&health));
        let (relaxers, mut threads) = relaxers::start(settings.relaxation_threads);
        threads.extend([committer, checkpointer]);
        let spaces_max = settings.spaces_max;
        let around = Surroundings {
            store,
            publisher,
            health: Arc::clone(&health),
            commits,
            jobs,
            relaxers,
            questions: QuestionRoom::default(),
            settings,
        };
        let mut spaces = BTreeMap::new();
        for stored in stored {
            let (number, name) = (stored.number, &stored.name);
            let space = match stored_settings(&stored) {
                Ok((settings, core)) => Space::start(number, name, settings, core, &around),
                Err(reason) => Space::stopped(number, name, reason, &around),
            };
            spaces.insert(stored.name, Arc::new(space));
        }
        let control = Control {
            around: Some(around),
            threads,
        };
        Ok(Self(Arc::new(Inner {
            spaces: ArcSwap::from_pointee(spaces),
            control: Mutex::new(control),
            health,
            intake: IntakeCounters::new(),
            spaces_max,
        })))
    }

    /// Whether the service can do its work.
    pub fn readiness(&self) -> Readiness {
        let spaces = self.0.spaces.load();
        if let Some(detail) = self.0.health.failed() {
            return Readiness::Failed { detail };
        }
        if let Some(detail) = spaces.values().find_map(|space| space.failure()) {
            return Readiness::Failed { detail };
        }
        let recovering: Vec<_> = spaces
            .values()
            .filter(|space| space.recovering())
            .map(|space| space.name().to_owned())
            .collect();
        if !recovering.is_empty() {
            return Readiness::Recovering { spaces: recovering };
        }
        let reason = |space: &Arc<Space>| {
            let reason = space.stop_reason()?;
            Some((space.name().to_owned(), reason.to_owned()))
        };
        let stopped: Vec<_> = spaces.values().filter_map(reason).collect();
        match &*stopped {
            [] => Readiness::Ready,
            [(_, reason), ..] if stopped.len() == spaces.len() => Readiness::Failed {
                detail: format!("all spaces are stopped; {reason}"),
            },
            _ => Readiness::ReadyBut { stopped },
        }
    }

    /// The spaces, by name.
    pub fn spaces(&self) -> Vec<Arc<Space>> {
        self.0.spaces.load().values().cloned().collect()
    }

    /// A space, by name.
    pub fn space(&self, name: &str) -> Option<Arc<Space>> {
        self.0.spaces.load().get(name).cloned()
    }

    /// Creates a space, or finds it if it exists with the same settings. Says whether it is new.
    ///
    /// # Errors
    /// See [`SpaceError`].
    ///
    /// # Panics
    /// Never: settings are plain data, which always encodes.
    pub fn create_space(
        &self,
        name: &Name,
        settings: &SpaceSettings,
    ) -> Result<(Arc<Space>, bool), SpaceError> {
        let core = (core_settings(settings)?, trajectory_interval_ns(settings));
        let control = self.control();
        let around = control.around.as_ref().ok_or(SpaceError::Closed)?;
        if let Some(space) = self.space(name.as_str()) {
            return if space.settings() == settings {
                Ok((space, false))
            } else {
                Err(SpaceError::ExistsWithOtherSettings)
            };
        }
        let count = self.0.spaces.load().len();
        if count >= self.0.spaces_max {
            return Err(SpaceError::TooManySpaces(count));
        }
        let bytes = serde_json::to_vec(settings).expect("plain data encodes");
        let number = around.store.create_space(name.as_str(), &bytes)?;
        let space = Space::start(number, name.as_str(), settings.clone(), core, around);
        let space = Arc::new(space);
        self.0.spaces.rcu(|spaces| {
            let mut spaces = BTreeMap::clone(spaces);
            spaces.insert(name.as_str().to_owned(), Arc::clone(&space));
            spaces
        });
        Ok((space, true))
    }

    /// Deletes a space with all that it holds.
    ///
    /// # Errors
    /// See [`SpaceError`].
    pub fn delete_space(&self, name: &str) -> Result<(), SpaceError> {
        let control = self.control();
        let around = control.around.as_ref().ok_or(SpaceError::Closed)?;
        let space = self.space(name).ok_or(SpaceError::Unknown)?;
        // What cannot be deleted must not vanish until the next start.
        if let Some(error) = self.0.health.error() {
            return Err(error.into());
        }
        self.0.spaces.rcu(|spaces| {
            let mut spaces = BTreeMap::clone(spaces);
            spaces.remove(name);
            spaces
        });
        space.close();
        if space.stop_reason().is_some() {
            gauge!(SPACE_STOPPED, "space" => name.to_owned()).set(0.0);
        }
        Ok(around.store.delete_space(space.number())?)
    }

    /// Takes a message as it came over Zenoh. Never blocks; what cannot be taken is counted.
    pub fn offer(&self, space: &str, agent: &str, codec: Codec, payload: &[u8]) {
        let intake = &self.0.intake;
        intake.received(codec, payload.len());
        let spaces = self.0.spaces.load();
        let Some(space) = spaces.get(space) else {
            return intake.unknown_space(space);
        };
        let Err(refusal) = space.offer(agent, codec, payload) else {
            return;
        };
        space.shared().live.totals.dropped.add(1);
        intake.dropped(match refusal {
            NotQueued::Full => Drop::QueueFull,
            NotQueued::LaneFull => Drop::AgentQueueFull,
            NotQueued::Closed => Drop::SpaceClosed,
        });
    }

    /// Counts a message whose key is not a samples key with valid names.
    pub fn refuse_key(&self) {
        self.0.intake.dropped(Drop::BadKey);
    }

    /// Counts a message that cannot be read, whatever its space.
    pub fn refuse(&self, key: &str, error: &DecodeError) {
        counters::undecodable(key, error);
    }

    /// Takes what is queued, makes it durable, checkpoints every space and ends all threads.
    pub fn shutdown(&self) {
        let mut control = self.control();
        control.around = None;
        for space in self.spaces() {
            space.close();
        }
        // With the writers gone, the last senders are too, and these threads end by themselves.
        for thread in control.threads.drain(..) {
            if thread.join().is_err() {
                tracing::error!("a thread of the engine ended with a panic");
            }
        }
    }

    fn control(&self) -> MutexGuard<'_, Control> {
        self.0
            .control
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}
