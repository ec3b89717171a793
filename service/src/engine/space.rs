//! A space, as everyone but its writer sees it.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError, RwLock};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use arc_swap::ArcSwapOption;
use cogmap_proto::{
    Codec, EventId, IngestAnswer, Name, ObjectLesson, SampleBatch, SpaceSettings, Trajectory,
};
use cognitive_map::{CognitiveMap, Label, Lesson, Settings};
use tokio::sync::oneshot;

use super::checkpointer::{Checkpointer, Job};
use super::committer::Commit;
use super::desk::AgentDesk;
use super::events::{EventFollower, EventLog};
use super::health::Health;
use super::message::{Call, IngestError, ObjectRequest, Request};
use super::outlet::Outlet;
use super::question::QuestionRoom;
use super::queue::{Inbox, NotQueued, Queue, queue};
use super::recovery;
use super::refinement::Refinements;
use super::settings::EngineSettings;
use super::trajectory;
use super::writer::Writer;
use crate::store::{SpaceNumber, Store, StoreError};

/// A space: its readers' and senders' side.
#[derive(Debug)]
pub struct Space {
    shared: Arc<Shared>,
    settings: SpaceSettings,
    queue: Queue,
    thread: Mutex<Option<JoinHandle<()>>>,
}

/// What the space and its writer share.
#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) name: Arc<str>,
    pub(crate) number: SpaceNumber,
    pub(crate) interval_ns: i64,
    pub(crate) agents_max: usize,
    pub(crate) reorder_window: usize,
    pub(crate) gap_timeout: Duration,
    pub(crate) store: Arc<dyn Store>,
    pub(crate) outlet: Arc<dyn Outlet>,
    pub(crate) health: Arc<Health>,
    /// What happened of late.
    pub(crate) events: EventLog,
    /// Revision of the map at the end of the latest round.
    pub(crate) revision: AtomicU64,
    /// Set once: the writer takes what is queued and ends.
    pub(crate) closing: AtomicBool,
    /// Set once the map is loaded, or could not be.
    loaded: OnceLock<Result<(), String>>,
    agents: RwLock<BTreeMap<String, Arc<AgentDesk>>>,
    snapshot: ArcSwapOption<CognitiveMap>,
    /// Those who wait for a snapshot; none once the writer is gone.
    wishes: Mutex<Option<Vec<Wish>>>,
    /// The map relaxed for those who asked for the past.
    refinements: Refinements,
    questions: QuestionRoom,
    /// Set when the writer ended although the space was not closing.
    broken: AtomicBool,
}

/// Someone who waits for a snapshot.
type Wish = oneshot::Sender<Arc<CognitiveMap>>;

/// Why a space cannot be read now.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unavailable {
    /// It is still loading.
    #[error("the space is recovering")]
    Recovering,
    /// It is closing.
    #[error("the space is closing")]
    Closing,
    /// The work on it ended with a panic.
    #[error("the work was interrupted")]
    Interrupted,
    /// It could not be loaded, or is not written any more.
    #[error("{0}")]
    Failed(String),
}

/// Why a trajectory cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum TrajectoryError {
    /// There is no such agent.
    #[error("unknown agent")]
    UnknownAgent,
    /// The store cannot be read.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The map cannot be read.
    #[error(transparent)]
    Unavailable(#[from] Unavailable),
}

/// What a space needs of the engine.
#[derive(Clone, Debug)]
pub(crate) struct Surroundings {
    pub(crate) store: Arc<dyn Store>,
    pub(crate) outlet: Arc<dyn Outlet>,
    pub(crate) health: Arc<Health>,
    pub(crate) commits: std::sync::mpsc::Sender<Commit>,
    pub(crate) jobs: std::sync::mpsc::Sender<Job>,
    pub(crate) questions: QuestionRoom,
    pub(crate) settings: EngineSettings,
}

impl Space {
    /// Starts the space's thread, which loads the map and then writes it.
    pub(crate) fn start(
        number: SpaceNumber,
        name: &str,
        settings: SpaceSettings,
        (core, interval_ns): (Settings, i64),
        around: &Surroundings,
    ) -> Self {
        let (queue, inbox) = queue(around.settings.queue_messages, around.settings.queue_bytes);
        let shared = Arc::new(Shared {
            name: name.into(),
            number,
            interval_ns,
            agents_max: around.settings.agents_max,
            reorder_window: around.settings.reorder_window,
            gap_timeout: around.settings.gap_timeout,
            store: Arc::clone(&around.store),
            outlet: Arc::clone(&around.outlet),
            health: Arc::clone(&around.health),
            events: EventLog::new(),
            revision: AtomicU64::new(0),
            closing: AtomicBool::new(false),
            loaded: OnceLock::new(),
            agents: RwLock::default(),
            snapshot: ArcSwapOption::empty(),
            wishes: Mutex::new(Some(Vec::new())),
            refinements: Refinements::default(),
            questions: around.questions.clone(),
            broken: AtomicBool::new(false),
        });
        let thread = {
            let (shared, around) = (Arc::clone(&shared), around.clone());
            Builder::new()
                .name(format!("space {name}"))
                .spawn(move || load_and_run(&shared, inbox, around, &core))
                .expect("the system can start a thread")
        };
        Self {
            shared,
            settings,
            queue,
            thread: Mutex::new(Some(thread)),
        }
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.shared.name
    }

    /// Its number in the store.
    pub(crate) fn number(&self) -> SpaceNumber {
        self.shared.number
    }

    /// Its settings.
    pub fn settings(&self) -> &SpaceSettings {
        &self.settings
    }

    /// Whether the map is still being loaded.
    pub fn recovering(&self) -> bool {
        self.shared.loaded.get().is_none()
    }

    /// Why the map could not be loaded or is not written any more, if so.
    pub fn failure(&self) -> Option<String> {
        if self.shared.broken.load(Ordering::Acquire) {
            return Some("the space's writer has failed; the log says more".to_owned());
        }
        self.shared
            .loaded
            .get()
            .and_then(|loaded| loaded.clone().err())
    }

    /// The map as it was at the end of a round that ended after the call, or is unchanged since.
    ///
    /// # Errors
    /// The space is still loading, could not be loaded, or closes.
    pub async fn snapshot(&self) -> Result<Arc<CognitiveMap>, Unavailable> {
        self.available()?;
        if let Some(snapshot) = self.shared.snapshot.load_full()
            && snapshot.revision() == self.shared.revision.load(Ordering::Acquire)
        {
            return Ok(snapshot);
        }
        let (wish, granted) = oneshot::channel();
        match &mut *self.shared.wishes() {
            Some(wishes) => wishes.push(wish),
            // The writer is gone: nobody will grant it.
            None => drop(wish),
        }
        self.queue.call();
        granted.await.map_err(|_| {
            let detail = self.failure();
            detail.map_or(Unavailable::Closing, Unavailable::Failed)
        })
    }

    /// An agent, by name.
    pub fn agent(&self, name: &str) -> Option<Arc<AgentDesk>> {
        self.shared.agents().get(name).cloned()
    }

    /// Up to `limit` agents in the order of their names, those after `after`.
    pub fn agents_after(&self, after: Option<&str>, limit: usize) -> Vec<Arc<AgentDesk>> {
        use std::ops::Bound::{Excluded, Unbounded};
        let from = after.map_or(Unbounded, Excluded);
        let agents = self.shared.agents();
        agents
            .range::<str, _>((from, Unbounded))
            .take(limit)
            .map(|(_, desk)| desk.clone())
            .collect()
    }

    /// Follows the events after `after`, or those from now on.
    ///
    /// # Errors
    /// The space is still loading, or could not be loaded.
    pub fn follow(&self, after: Option<EventId>) -> Result<EventFollower, Unavailable> {
        self.available()?;
        let revision = self.shared.revision.load(Ordering::Acquire);
        Ok(self.shared.events.follow(after, revision))
    }

    /// Queues samples as they came over Zenoh.
    pub(crate) fn offer(&self, agent: &str, codec: Codec, payload: &[u8]) -> Result<(), NotQueued> {
        self.queue.push(agent, codec, payload)
    }

    /// Takes samples and answers when they are durable. Samples beyond a gap are not kept waiting:
    /// whoever can be answered is told what is missing.
    ///
    /// # Errors
    /// See [`IngestError`].
    pub async fn ingest(
        &self,
        agent: &Name,
        batch: SampleBatch,
    ) -> Result<IngestAnswer, IngestError> {
        let (reply, answer) = oneshot::channel();
        self.call(Call::Samples(Request {
            agent: agent.as_str().into(),
            batch,
            reply,
        }))?;
        answer.await.unwrap_or(Err(IngestError::Closed))
    }

    /// Teaches an object at once and answers when that is durable. `lesson` is what came, `valid` the same as the map
    /// takes it.
    ///
    /// # Errors
    /// See [`IngestError`].
    pub async fn teach(
        &self,
        name: &Label,
        lesson: ObjectLesson,
        valid: Lesson,
    ) -> Result<(), IngestError> {
        self.change_object(name, Some((lesson, valid))).await
    }

    /// Forgets an object, if there is one of that name, and answers when that is durable.
    ///
    /// # Errors
    /// See [`IngestError`].
    pub async fn forget_object(&self, name: &Label) -> Result<(), IngestError> {
        self.change_object(name, None).await
    }

    async fn change_object(
        &self,
        name: &Label,
        lesson: Option<(ObjectLesson, Lesson)>,
    ) -> Result<(), IngestError> {
        let (reply, answer) = oneshot::channel();
        self.call(Call::Object(ObjectRequest {
            name: name.clone(),
            lesson,
            reply,
        }))?;
        answer.await.unwrap_or(Err(IngestError::Closed))
    }

    /// Queues what someone waits for.
    fn call(&self, call: Call) -> Result<(), IngestError> {
        match self.available() {
            Ok(()) => {}
            Err(Unavailable::Recovering) => return Err(IngestError::Recovering),
            Err(Unavailable::Closing) => return Err(IngestError::Closed),
            Err(error) => return Err(IngestError::Store(error.to_string())),
        }
        self.queue.request(call).map_err(|error| match error {
            NotQueued::Full => IngestError::Busy,
            NotQueued::Closed => IngestError::Closed,
        })
    }

    /// Up to `limit` poses of an agent's causal trajectory with `from_ns <= stamp < to_ns`; of its
    /// current session when none is named.
    ///
    /// # Errors
    /// There is no such agent, or the store cannot be read.
    pub async fn trajectory(
        &self,
        agent: &str,
        session: Option<u64>,
        from_ns: Option<i64>,
        to_ns: Option<i64>,
        limit: usize,
    ) -> Result<Trajectory, TrajectoryError> {
        let desk = self.agent(agent).ok_or(TrajectoryError::UnknownAgent)?;
        let shared = Arc::clone(&self.shared);
        let read = move || {
            trajectory::read(
                &*shared.store,
                shared.number,
                &desk,
                session,
                (from_ns, to_ns),
                limit,
            )
        };
        tokio::task::spawn_blocking(read)
            .await
            .map_err(|_| TrajectoryError::Store(StoreError::Io("reading was interrupted".into())))?
    }

    /// The map relaxed for those who asked for the past.
    pub(super) fn refinements(&self) -> &Refinements {
        &self.shared.refinements
    }

    /// Room for localisations that are under way, of all spaces.
    pub(crate) fn question_room(&self) -> &QuestionRoom {
        &self.shared.questions
    }

    /// Takes what is queued, checkpoints, and ends the thread.
    pub(crate) fn close(&self) {
        self.shared.closing.store(true, Ordering::Release);
        self.queue.call();
        let thread = self
            .thread
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        if let Some(thread) = thread
            && thread.join().is_err()
        {
            tracing::error!(space = self.name(), "the writer ended with a panic");
        }
    }

    /// Whether the space can be read.
    ///
    /// # Errors
    /// It is still loading, or could not be loaded.
    pub fn available(&self) -> Result<(), Unavailable> {
        match self.failure() {
            Some(detail) => Err(Unavailable::Failed(detail)),
            None if self.recovering() => Err(Unavailable::Recovering),
            None => Ok(()),
        }
    }
}

/// Stands for the writer's thread: when it ends, also by a panic, nobody waits for it any more.
struct Presence<'a>(&'a Shared);

impl Drop for Presence<'_> {
    fn drop(&mut self) {
        if !self.0.closing.load(Ordering::Acquire) {
            self.0.broken.store(true, Ordering::Release);
            tracing::error!(space = %self.0.name, "the space's writer has ended");
        }
        // Whoever waits learns it by the end of the channel.
        *self.0.wishes() = None;
    }
}

fn load_and_run(shared: &Arc<Shared>, inbox: Inbox, around: Surroundings, core: &Settings) {
    let Surroundings {
        store,
        health,
        commits,
        jobs,
        settings,
        ..
    } = around;
    let closing = || shared.closing.load(Ordering::Acquire);
    let told = (&*shared.name, shared.interval_ns);
    match recovery::recover(&*store, shared.number, core, told, closing) {
        Ok(recovered) => {
            let progress = (recovered.checkpoint_revision, recovered.next_block);
            let interval = settings.checkpoint_interval;
            let checkpointer =
                Checkpointer::new(shared.number, store, health, jobs, interval, progress);
            let space = &*shared.name;
            tracing::info!(space, revision = recovered.map.revision(), "space loaded");
            shared
                .revision
                .store(recovered.map.revision(), Ordering::Release);
            shared.events.begin(recovered.events.clone());
            let writer = Writer::new(Arc::clone(shared), commits, checkpointer, recovered);
            let _present = Presence(shared);
            let _ = shared.loaded.set(Ok(()));
            writer.run(inbox);
        }
        Err(error) => {
            if !closing() {
                tracing::error!(space = %shared.name, %error, "load space");
            }
            let _ = shared.loaded.set(Err(error.to_string()));
        }
    }
}

impl Shared {
    /// Lists a new agent.
    pub(crate) fn seat(&self, desk: Arc<AgentDesk>) {
        let mut agents = self.agents.write().unwrap_or_else(PoisonError::into_inner);
        agents.insert(desk.name().to_owned(), desk);
    }

    /// Gives the map to all who wish for it: one copy for all, and copying is cheap.
    pub(crate) fn serve_snapshots(&self, map: &CognitiveMap) {
        let wishes = self.wishes().as_mut().map(std::mem::take);
        let wishes = wishes.unwrap_or_default();
        if wishes.is_empty() {
            return;
        }
        let snapshot = Arc::new(map.clone());
        self.snapshot.store(Some(Arc::clone(&snapshot)));
        for wish in wishes {
            // Whoever wished may have gone.
            let _ = wish.send(Arc::clone(&snapshot));
        }
    }

    fn agents(&self) -> std::sync::RwLockReadGuard<'_, BTreeMap<String, Arc<AgentDesk>>> {
        self.agents.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn wishes(&self) -> std::sync::MutexGuard<'_, Option<Vec<Wish>>> {
        self.wishes.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
