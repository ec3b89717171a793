//! A shard: the spaces of one store, with the threads that make them durable.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

use cogmap_proto::{Name, SpaceSettings};
use cognitive_map::Settings;
use metrics::gauge;

use super::health::Health;
use super::publisher::Publisher;
use super::question::QuestionRoom;
use super::shared::Surroundings;
use super::space::Space;
use super::workers::Workers;
use super::{EngineSettings, SpaceError, checkpointer, committer, stored_settings};
use crate::metrics::SPACE_STOPPED;
use crate::store::{Store, StoreError, StoredSpace};

/// What all shards of an engine share.
#[derive(Clone, Debug)]
pub(super) struct Common {
    pub(super) publisher: Arc<dyn Publisher>,
    pub(super) workers: Workers,
    pub(super) questions: QuestionRoom,
    pub(super) settings: EngineSettings,
    /// Whether the shards are other processes', and are only followed.
    pub(super) follows: bool,
}

/// The spaces of one store.
#[derive(Debug)]
pub(super) struct Shard {
    /// Taken to create or delete a space, and to close.
    control: Mutex<Control>,
    store: Arc<dyn Store>,
    health: Arc<Health>,
}

#[derive(Debug)]
struct Control {
    /// Gone after the shard has closed.
    around: Option<Surroundings>,
    threads: Vec<JoinHandle<()>>,
}

impl Shard {
    /// Starts the spaces that the store holds. Returns at once; they load in their own threads.
    ///
    /// # Errors
    /// The list of spaces cannot be read.
    pub(super) fn open(
        store: Arc<dyn Store>,
        common: &Common,
    ) -> Result<(Self, BTreeMap<String, Arc<Space>>), StoreError> {
        let health = Arc::new(Health::default());
        let stored = store.spaces()?;
        let settings = common.settings;
        let (commits, committer) = committer::start(
            Arc::clone(&store),
            Arc::clone(&common.publisher),
            Arc::clone(&health),
            settings.commit_interval,
        );
        let (jobs, checkpointer) = checkpointer::start(Arc::clone(&store), Arc::clone(&health));
        let around = Surroundings {
            store: Arc::clone(&store),
            publisher: Arc::clone(&common.publisher),
            health: Arc::clone(&health),
            commits,
            jobs,
            workers: common.workers.clone(),
            questions: common.questions.clone(),
            settings,
            follows: common.follows,
        };
        let mut spaces = BTreeMap::new();
        for stored in stored {
            let space = start(&stored, &around);
            spaces.insert(stored.name, Arc::new(space));
        }
        let control = Mutex::new(Control {
            around: Some(around),
            threads: vec![committer, checkpointer],
        });
        let shard = Self {
            control,
            store,
            health,
        };
        Ok((shard, spaces))
    }

    /// What is wrong with the store, if anything.
    pub(super) fn health(&self) -> &Health {
        &self.health
    }

    /// The spaces that the store holds.
    pub(super) fn stored(&self) -> Result<Vec<StoredSpace>, StoreError> {
        self.store.spaces()
    }

    /// Which owner of the store in a row this is.
    pub(super) fn term(&self) -> u64 {
        self.store.term()
    }

    /// The right to change the list of spaces, or none once it has closed.
    pub(super) fn change(&self) -> Result<Change<'_>, SpaceError> {
        let control = self.control();
        if control.around.is_none() {
            return Err(SpaceError::Closed);
        }
        Ok(Change(control))
    }

    /// Takes its spaces off the list by `take`, after which none is created any more. Takes what is
    /// queued in them, makes it durable, checkpoints each, ends all threads and gives up the store.
    pub(super) fn close(&self, take: impl FnOnce() -> Vec<Arc<Space>>) {
        let mut control = self.control();
        control.around = None;
        let spaces = take();
        // All at once: each writes a checkpoint.
        for space in &spaces {
            space.begin_to_close();
        }
        for space in &spaces {
            space.close();
        }
        // With the writers gone, the last senders are too, and these threads end by themselves.
        for thread in control.threads.drain(..) {
            if thread.join().is_err() {
                tracing::error!("a thread of the engine ended with a panic");
            }
        }
        self.store.give_up();
        for space in spaces {
            if space.stop_reason().is_some() {
                gauge!(SPACE_STOPPED, "space" => space.name().to_owned()).set(0.0);
            }
        }
    }

    fn control(&self) -> MutexGuard<'_, Control> {
        self.control.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The right to change the list of spaces of a shard that is open.
pub(super) struct Change<'a>(MutexGuard<'a, Control>);

impl Change<'_> {
    fn around(&self) -> &Surroundings {
        self.0.around.as_ref().expect("the shard is open")
    }

    /// Starts a space that the store holds.
    pub(super) fn start(&self, stored: &StoredSpace) -> Space {
        start(stored, self.around())
    }

    /// Creates a space.
    pub(super) fn create(
        &self,
        name: &Name,
        settings: &SpaceSettings,
        core: (Settings, i64),
    ) -> Result<Space, SpaceError> {
        let bytes = serde_json::to_vec(settings).expect("plain data encodes");
        let around = self.around();
        let number = around.store.create_space(name.as_str(), &bytes)?;
        Ok(Space::start(
            number,
            name.as_str(),
            settings.clone(),
            core,
            around,
        ))
    }

    /// Deletes a space that nobody sees any more.
    pub(super) fn delete(&self, space: &Space) -> Result<(), SpaceError> {
        space.close();
        if space.stop_reason().is_some() {
            gauge!(SPACE_STOPPED, "space" => space.name().to_owned()).set(0.0);
        }
        Ok(self.around().store.delete_space(space.number())?)
    }
}

/// Starts a space that the store holds; one whose record is damaged is stopped.
fn start(stored: &StoredSpace, around: &Surroundings) -> Space {
    let (number, name) = (stored.number, &stored.name);
    match stored_settings(stored) {
        Ok((settings, core)) => Space::start(number, name, settings, core, around),
        Err(reason) => Space::stopped(number, name, reason, around),
    }
}
