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
mod readiness;
mod recovery;
mod refinement;
mod removal;
mod repair;
mod route_bounds;
mod sequencer;
mod session_bound;
mod settings;
mod shard;
mod shared;
mod space;
mod trajectory;
mod unavailable;
mod workers;
mod writer;

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use arc_swap::ArcSwap;
use cogmap_proto::{Codec, DecodeError, Name, SpaceSettings};
use cognitive_map::InvalidSettings;
use tokio::sync::watch;

pub use agent_view::AgentView;
#[cfg(test)]
pub(crate) use agent_view::view_of;
pub(crate) use due::Messages;
pub use events::{EVENTS_KEPT, EventFollower, Followed};
pub use message::IngestError;
pub use publisher::{Publisher, Silent};
pub use question::QuestionError;
pub use readiness::Readiness;
pub use refinement::{SharedText, refined_trajectories};
pub use repair::{AgentLoss, LostBlocks, MissingSamples, RepairReport, repair};
pub use settings::EngineSettings;
pub use space::{LiveFollower, Space};
pub use trajectory::{Around, Chunk, Recorder, TrajectoryPage};
pub use unavailable::{TrajectoryError, Unavailable};

use crate::decode::{core_settings, trajectory_interval_ns};
use crate::store::{ShardNumber, Shards, Store, StoreError, StoredSpace};
use counters::{Drop, IntakeCounters};
use question::QuestionRoom;
use queue::NotQueued;
use shard::{Common, Shard};

/// The engine: the shards of a store that this process owns, and their spaces. Clones share it.
#[derive(Clone, Debug)]
pub struct Engine(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    /// The spaces of all open shards.
    spaces: ArcSwap<BTreeMap<String, Arc<Space>>>,
    shards: ArcSwap<BTreeMap<ShardNumber, Arc<Shard>>>,
    /// How many shards the store has, open or not.
    count: Shards,
    /// Taken to open or close a shard, and to shut down.
    control: Mutex<Control>,
    /// Told whenever spaces come or go.
    changes: watch::Sender<()>,
    intake: IntakeCounters,
    spaces_max: usize,
}

#[derive(Debug)]
struct Control {
    /// Gone after the shutdown.
    common: Option<Common>,
    threads: Vec<JoinHandle<()>>,
}

/// An open shard.
#[derive(Clone, Debug)]
pub struct OpenShard {
    /// Its number.
    pub number: ShardNumber,
    /// Which owner of the shard in a row this process is.
    pub term: u64,
    /// Why it takes no samples, if so.
    pub failure: Option<String>,
    /// Its spaces, by name.
    pub spaces: Vec<Arc<Space>>,
}

/// Why a space cannot be created or deleted.
#[derive(Debug, thiserror::Error)]
pub enum SpaceError {
    /// Its settings make no sense.
    #[error(transparent)]
    InvalidSettings(#[from] InvalidSettings),
    /// It exists with other settings, and settings are fixed on creation.
    #[error("the space exists with other settings, which stay as they are: {0}")]
    ExistsWithOtherSettings(String),
    /// There are as many spaces as there may be.
    #[error("there are {0} spaces already")]
    TooManySpaces(usize),
    /// There is no such space.
    #[error("unknown space")]
    Unknown,
    /// The shard of the space is not open in this process.
    #[error("the shard of the space is not here")]
    NotHere,
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
    /// An engine over one store that is not divided. Returns at once; the spaces load in their own
    /// threads.
    ///
    /// # Errors
    /// The list of spaces cannot be read.
    pub fn open(
        store: Arc<dyn Store>,
        settings: EngineSettings,
        publisher: Arc<dyn Publisher>,
    ) -> Result<Self, StoreError> {
        let engine = Self::new(Shards::ONE, settings, publisher);
        engine.open_shard(ShardNumber(0), store)?;
        Ok(engine)
    }

    /// An engine for a store of so many shards, none of which is open yet.
    pub fn new(count: Shards, settings: EngineSettings, publisher: Arc<dyn Publisher>) -> Self {
        Self::with(count, settings, publisher, false)
    }

    /// An engine that follows shards of other processes: it takes no samples, and folds what they
    /// write.
    pub fn following(count: Shards, settings: EngineSettings) -> Self {
        Self::with(count, settings, Arc::new(Silent), true)
    }

    fn with(
        count: Shards,
        settings: EngineSettings,
        publisher: Arc<dyn Publisher>,
        follows: bool,
    ) -> Self {
        let (workers, threads) = workers::start(settings.relaxation_threads);
        let spaces_max = settings.spaces_max;
        let common = Common {
            publisher,
            workers,
            questions: QuestionRoom::default(),
            settings,
            follows,
        };
        Self(Arc::new(Inner {
            spaces: ArcSwap::default(),
            shards: ArcSwap::default(),
            count,
            control: Mutex::new(Control {
                common: Some(common),
                threads,
            }),
            changes: watch::Sender::default(),
            intake: IntakeCounters::new(),
            spaces_max,
        }))
    }

    /// Opens a shard and starts its spaces. Returns at once; they load in their own threads.
    ///
    /// # Errors
    /// The list of its spaces cannot be read, the shard is open, or the service is shutting down.
    pub fn open_shard(&self, number: ShardNumber, store: Arc<dyn Store>) -> Result<(), StoreError> {
        let closed = || StoreError::Io("the service is shutting down".to_owned());
        let common = self.control().common.clone().ok_or_else(closed)?;
        // The store may be slow, and other shards open and close meanwhile.
        let (shard, started) = Shard::open(store, &common)?;
        let control = self.control();
        if control.common.is_none() || self.0.shards.load().contains_key(&number) {
            drop(control);
            shard.close(|| started.into_values().collect());
            return Err(closed());
        }
        // Before the shard, so that none of them is unknown for a moment.
        self.change_spaces(|spaces| spaces.extend(started.clone()));
        let shard = Arc::new(shard);
        self.0.shards.rcu(|shards| {
            let mut shards = BTreeMap::clone(shards);
            shards.insert(number, Arc::clone(&shard));
            shards
        });
        Ok(())
    }

    /// Closes a shard: takes what is queued in its spaces, makes it durable, checkpoints each, and
    /// gives up the store. Of one that has failed, for another process owns it, nothing is written.
    pub fn close_shard(&self, number: ShardNumber) {
        let Some(shard) = self.0.shards.load().get(&number).cloned() else {
            return;
        };
        // From here on nobody finds the shard.
        self.0.shards.rcu(|shards| {
            let mut shards = BTreeMap::clone(shards);
            shards.remove(&number);
            shards
        });
        shard.close(|| {
            let closing = self.spaces_of(number);
            self.change_spaces(|spaces| {
                spaces.retain(|name, _| self.0.count.of(name) != number);
            });
            closing
        });
    }

    /// Starts the spaces that have come to a shard that is followed, and closes those that are
    /// gone.
    ///
    /// # Errors
    /// The list of its spaces cannot be read, or the shard is not open.
    pub fn follow_spaces(&self, number: ShardNumber) -> Result<(), SpaceError> {
        let shard = self.0.shards.load().get(&number).cloned();
        let shard = shard.ok_or(SpaceError::NotHere)?;
        let change = shard.change()?;
        let stored = shard.stored()?;
        let known = self.spaces_of(number);
        let is_gone =
            |space: &&Arc<Space>| !stored.iter().any(|stored| stored.number == space.number());
        let gone: Vec<_> = known.iter().filter(is_gone).collect();
        let has_come =
            |stored: &&StoredSpace| !known.iter().any(|space| space.number() == stored.number);
        let come: BTreeMap<_, _> = { stored.iter().filter(has_come) }
            .map(|stored| (stored.name.clone(), Arc::new(change.start(stored))))
            .collect();
        if !gone.is_empty() || !come.is_empty() {
            self.change_spaces(|spaces| {
                spaces.retain(|_, space| !gone.iter().any(|gone| Arc::ptr_eq(gone, space)));
                spaces.extend(come.clone());
            });
        }
        for space in gone {
            space.close();
        }
        Ok(())
    }

    /// The shards that are open.
    pub fn open_shards(&self) -> Vec<OpenShard> {
        let shards = self.0.shards.load();
        let open = shards.iter().map(|(number, shard)| OpenShard {
            number: *number,
            term: shard.term(),
            failure: shard.health().failed(),
            spaces: self.spaces_of(*number),
        });
        open.collect()
    }

    /// How many shards the store has, open or not.
    pub fn shards(&self) -> Shards {
        self.0.count
    }

    /// Whether the shard is open that a space of the name belongs to.
    pub fn owns(&self, space: &str) -> bool {
        self.shard_of(space).is_some()
    }

    /// Is told whenever spaces come or go.
    pub fn changes(&self) -> watch::Receiver<()> {
        self.0.changes.subscribe()
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
        let shard = self.shard_of(name.as_str()).ok_or(SpaceError::NotHere)?;
        let change = shard.change()?;
        if let Some(space) = self.space(name.as_str()) {
            return if space.settings() == settings {
                Ok((space, false))
            } else {
                let others = settings::differences(space.settings(), settings);
                Err(SpaceError::ExistsWithOtherSettings(others))
            };
        }
        let count = self.0.spaces.load().len();
        if count >= self.0.spaces_max {
            return Err(SpaceError::TooManySpaces(count));
        }
        let space = Arc::new(change.create(name, settings, core)?);
        self.change_spaces(|spaces| {
            spaces.insert(name.as_str().to_owned(), Arc::clone(&space));
        });
        Ok((space, true))
    }

    /// Deletes a space with all that it holds.
    ///
    /// # Errors
    /// See [`SpaceError`].
    pub fn delete_space(&self, name: &str) -> Result<(), SpaceError> {
        let shard = self.shard_of(name).ok_or(SpaceError::NotHere)?;
        let change = shard.change()?;
        let space = self.space(name).ok_or(SpaceError::Unknown)?;
        // What cannot be deleted must not vanish until the next start.
        if let Some(error) = shard.health().error() {
            return Err(error.into());
        }
        self.change_spaces(|spaces| {
            spaces.remove(name);
        });
        change.delete(&space)
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
        let threads = {
            let mut control = self.control();
            control.common = None;
            std::mem::take(&mut control.threads)
        };
        let open: Vec<_> = self.0.shards.load().keys().copied().collect();
        for number in open {
            self.close_shard(number);
        }
        for thread in threads {
            if thread.join().is_err() {
                tracing::error!("a thread of the engine ended with a panic");
            }
        }
    }

    /// The open shard that a space of a name belongs to.
    fn shard_of(&self, space: &str) -> Option<Arc<Shard>> {
        self.0.shards.load().get(&self.0.count.of(space)).cloned()
    }

    fn spaces_of(&self, number: ShardNumber) -> Vec<Arc<Space>> {
        let spaces = self.0.spaces.load();
        let of_shard = spaces
            .values()
            .filter(|space| self.0.count.of(space.name()) == number);
        of_shard.cloned().collect()
    }

    fn change_spaces(&self, change: impl Fn(&mut BTreeMap<String, Arc<Space>>)) {
        self.0.spaces.rcu(|spaces| {
            let mut spaces = BTreeMap::clone(spaces);
            change(&mut spaces);
            spaces
        });
        self.0.changes.send_replace(());
    }

    fn control(&self) -> MutexGuard<'_, Control> {
        self.0
            .control
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}
