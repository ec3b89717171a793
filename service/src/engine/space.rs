//! A space, as everyone but its writer sees it.

mod loading;
mod questions;
mod refined;
mod trajectories;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError, RwLock};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use arc_swap::ArcSwapOption;
use cogmap_proto::{Codec, EventId, IngestAnswer, Name, ObjectLesson, SampleBatch, SpaceSettings};
use cognitive_map::{AgentId, CognitiveMap, Label, Lesson, Settings};
use metrics::gauge;
use tokio::sync::oneshot;

use super::agent_view::AgentView;
use super::checkpointer::Job;
use super::committer::Commit;
use super::events::{EventFollower, EventLog};
use super::health::Health;
use super::message::{Call, IngestError, ObjectRequest, Request};
use super::publisher::Publisher;
use super::question::QuestionRoom;
use super::queue::{NotQueued, Queue, queue};
use super::refinement::Refinements;
use super::session_bound::SessionBound;
use super::settings::EngineSettings;
use super::unavailable::Unavailable;
use crate::metrics::SPACE_STOPPED;
use crate::store::{SpaceNumber, Store};

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
    pub(crate) sessions: SessionBound,
    pub(crate) reorder_window: usize,
    pub(crate) gap_timeout: Duration,
    pub(crate) store: Arc<dyn Store>,
    pub(crate) publisher: Arc<dyn Publisher>,
    pub(crate) health: Arc<Health>,
    /// What happened of late.
    pub(crate) events: EventLog,
    /// Revision of the map at the end of the latest round.
    pub(crate) revision: AtomicU64,
    /// Set once: the writer takes what is queued and ends.
    pub(crate) closing: AtomicBool,
    /// Set once the map is loaded, or could not be.
    loaded: OnceLock<Result<(), Unavailable>>,
    agents: RwLock<BTreeMap<String, Arc<AgentView>>>,
    /// Removed agents that were in the map, by name, the latest last.
    former: RwLock<BTreeMap<String, Vec<AgentId>>>,
    snapshot: ArcSwapOption<CognitiveMap>,
    /// Those who wait for a snapshot; none once the writer is gone.
    snapshot_requests: Mutex<Option<Vec<SnapshotRequest>>>,
    /// The map relaxed for those who asked for the past.
    refinements: Refinements,
    questions: QuestionRoom,
    /// Set when the writer ended although the space was not closing.
    broken: AtomicBool,
}

/// Someone who waits for a snapshot.
type SnapshotRequest = oneshot::Sender<Arc<CognitiveMap>>;

/// What a space needs of the engine.
#[derive(Clone, Debug)]
pub(crate) struct Surroundings {
    pub(crate) store: Arc<dyn Store>,
    pub(crate) publisher: Arc<dyn Publisher>,
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
        let shared = Shared::new(number, name, interval_ns, around);
        let thread = {
            let (shared, around) = (Arc::clone(&shared), around.clone());
            Builder::new()
                .name(format!("space {name}"))
                .spawn(move || loading::load_and_run(&shared, inbox, around, &core))
                .expect("the system can start a thread")
        };
        Self {
            shared,
            settings,
            queue,
            thread: Mutex::new(Some(thread)),
        }
    }

    /// A space that cannot be started, because its record is damaged. It can be deleted.
    pub(crate) fn stopped(
        number: SpaceNumber,
        name: &str,
        reason: String,
        around: &Surroundings,
    ) -> Self {
        let (queue, _) = queue(around.settings.queue_messages, around.settings.queue_bytes);
        let shared = Shared::new(number, name, 0, around);
        shared.stop(reason);
        Self {
            shared,
            settings: SpaceSettings::default(),
            queue,
            thread: Mutex::new(None),
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

    /// Why the map could not be loaded, if so: what is damaged, and what is lost.
    pub fn stop_reason(&self) -> Option<&str> {
        match self.shared.loaded.get() {
            Some(Err(Unavailable::Stopped(reason))) => Some(reason),
            _ => None,
        }
    }

    /// Why the map is not written any more, if so.
    pub fn failure(&self) -> Option<String> {
        let failed = self.shared.broken.load(Ordering::Acquire);
        failed.then(|| "the space's writer has failed; the log says more".to_owned())
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
        let (request, granted) = oneshot::channel();
        match &mut *self.shared.snapshot_requests() {
            Some(requests) => requests.push(request),
            // The writer is gone: nobody will grant it.
            None => drop(request),
        }
        self.queue.call();
        granted.await.map_err(|_| {
            let detail = self.failure();
            detail.map_or(Unavailable::Closing, Unavailable::Failed)
        })
    }

    /// An agent, by name.
    pub fn agent(&self, name: &str) -> Option<Arc<AgentView>> {
        self.shared.agents().get(name).cloned()
    }

    /// Up to `limit` agents in the order of their names, those after `after`.
    pub fn agents_after(&self, after: Option<&str>, limit: usize) -> Vec<Arc<AgentView>> {
        use std::ops::Bound::{Excluded, Unbounded};
        let from = after.map_or(Unbounded, Excluded);
        let agents = self.shared.agents();
        agents
            .range::<str, _>((from, Unbounded))
            .take(limit)
            .map(|(_, view)| view.clone())
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

    /// What it shares with its writer.
    pub(super) fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    /// Queues what someone waits for.
    pub(super) fn call(&self, call: Call) -> Result<(), IngestError> {
        match self.available() {
            Ok(()) => {}
            Err(Unavailable::Recovering) => return Err(IngestError::Recovering),
            Err(Unavailable::Closing) => return Err(IngestError::Closed),
            Err(Unavailable::Stopped(reason)) => return Err(IngestError::Stopped(reason)),
            Err(error) => return Err(IngestError::Store(error.to_string())),
        }
        self.queue.request(call).map_err(|error| match error {
            NotQueued::Full | NotQueued::LaneFull => IngestError::Busy,
            NotQueued::Closed => IngestError::Closed,
        })
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
        if let Some(detail) = self.failure() {
            return Err(Unavailable::Failed(detail));
        }
        let loaded = self.shared.loaded.get();
        loaded.cloned().unwrap_or(Err(Unavailable::Recovering))
    }
}

impl Shared {
    fn new(number: SpaceNumber, name: &str, interval_ns: i64, around: &Surroundings) -> Arc<Self> {
        Arc::new(Self {
            name: name.into(),
            number,
            interval_ns,
            agents_max: around.settings.agents_max,
            sessions: SessionBound::new(around.settings.session_ahead_max),
            reorder_window: around.settings.reorder_window,
            gap_timeout: around.settings.gap_timeout,
            store: Arc::clone(&around.store),
            publisher: Arc::clone(&around.publisher),
            health: Arc::clone(&around.health),
            events: EventLog::new(),
            revision: AtomicU64::new(0),
            closing: AtomicBool::new(false),
            loaded: OnceLock::new(),
            agents: RwLock::default(),
            former: RwLock::default(),
            snapshot: ArcSwapOption::empty(),
            snapshot_requests: Mutex::new(Some(Vec::new())),
            refinements: Refinements::default(),
            questions: around.questions.clone(),
            broken: AtomicBool::new(false),
        })
    }

    /// Stops the space for good, before it has begun: only an operator can help.
    fn stop(&self, reason: String) {
        tracing::error!(space = %self.name, reason, "the space is stopped");
        gauge!(SPACE_STOPPED, "space" => self.name.to_string()).set(1.0);
        let _ = self.loaded.set(Err(Unavailable::Stopped(reason)));
    }

    /// Lists a new agent.
    pub(crate) fn add_view(&self, view: Arc<AgentView>) {
        let mut agents = self.agents.write().unwrap_or_else(PoisonError::into_inner);
        agents.insert(view.name().to_owned(), view);
    }

    /// Lists an agent no longer.
    pub(crate) fn remove_view(&self, name: &str) {
        let mut agents = self.agents.write().unwrap_or_else(PoisonError::into_inner);
        agents.remove(name);
    }

    /// Notes a removed agent that was in the map.
    pub(super) fn note_former(&self, name: &str, id: AgentId) {
        let mut former = self.former.write().unwrap_or_else(PoisonError::into_inner);
        former.entry(name.to_owned()).or_default().push(id);
    }

    /// The removed agents of a name that were in the map, the latest last.
    pub(super) fn former(&self, name: &str) -> Vec<AgentId> {
        let former = self.former.read().unwrap_or_else(PoisonError::into_inner);
        former.get(name).cloned().unwrap_or_default()
    }

    /// Gives the map to all who request for it: one copy for all, and copying is cheap.
    pub(crate) fn serve_snapshots(&self, map: &CognitiveMap) {
        let requests = self.snapshot_requests().as_mut().map(std::mem::take);
        let requests = requests.unwrap_or_default();
        if requests.is_empty() {
            return;
        }
        let snapshot = Arc::new(map.clone());
        self.snapshot.store(Some(Arc::clone(&snapshot)));
        for request in requests {
            // Whoever wished may have gone.
            let _ = request.send(Arc::clone(&snapshot));
        }
    }

    fn agents(&self) -> std::sync::RwLockReadGuard<'_, BTreeMap<String, Arc<AgentView>>> {
        self.agents.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn snapshot_requests(&self) -> std::sync::MutexGuard<'_, Option<Vec<SnapshotRequest>>> {
        self.snapshot_requests
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}
