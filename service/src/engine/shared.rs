//! What a space and its writer share.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, RwLock};
use std::time::{Duration, Instant};

use arc_swap::ArcSwapOption;
use cognitive_map::{AgentId, CognitiveMap};
use metrics::gauge;
use tokio::sync::oneshot;

use super::agent_view::AgentView;
use super::checkpointer::Job;
use super::committer::Commit;
use super::events::EventLog;
use super::health::Health;
use super::live::Live;
use super::publisher::Publisher;
use super::question::QuestionRoom;
use super::refinement::Refinements;
use super::route_bounds::RouteBoundsOfSpace;
use super::session_bound::SessionBound;
use super::settings::EngineSettings;
use super::unavailable::Unavailable;
use super::workers::Workers;
use crate::metrics::SPACE_STOPPED;
use crate::store::{SpaceNumber, Store};

/// What the space and its writer share.
#[derive(Debug)]
pub(crate) struct Shared {
    pub(crate) name: Arc<str>,
    pub(crate) number: SpaceNumber,
    /// Number of this process as the owner of the store.
    pub(crate) term: u64,
    /// Whether another process writes the space, and this one folds what it has written.
    pub(crate) follows: bool,
    /// Of a space that is followed: all that could be read at this time is folded.
    caught_up: Mutex<Option<Instant>>,
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
    /// What is left for those who watch.
    pub(crate) live: Arc<Live>,
    /// Revision of the map at the end of the latest round.
    pub(crate) revision: AtomicU64,
    /// Revision of the checkpoint that the map was restored from: of what changed before it, only
    /// what is left is known.
    pub(super) restored: AtomicU64,
    /// Set once: the writer takes what is queued and ends.
    pub(crate) closing: AtomicBool,
    /// Set once the map is loaded, or could not be.
    pub(super) loaded: OnceLock<Result<(), Unavailable>>,
    pub(super) agents: RwLock<BTreeMap<String, Arc<AgentView>>>,
    /// Removed agents that were in the map, by name, the latest last.
    pub(super) former: RwLock<BTreeMap<String, Vec<AgentId>>>,
    pub(super) snapshot: ArcSwapOption<CognitiveMap>,
    /// Those who wait for a snapshot; none once the writer is gone.
    pub(super) snapshot_requests: Mutex<Option<Vec<SnapshotRequest>>>,
    /// The map relaxed for those who asked for the past.
    pub(super) refinements: Refinements,
    pub(super) questions: QuestionRoom,
    /// What makes the search of routes shorter.
    pub(super) route_bounds: Arc<RouteBoundsOfSpace>,
    /// Set when the writer ended although the space was not closing.
    pub(super) broken: AtomicBool,
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
    pub(crate) workers: Workers,
    pub(crate) questions: QuestionRoom,
    pub(crate) settings: EngineSettings,
    /// Whether another process writes the spaces.
    pub(crate) follows: bool,
}

impl Shared {
    pub(super) fn new(
        number: SpaceNumber,
        name: &str,
        interval_ns: i64,
        around: &Surroundings,
    ) -> Arc<Self> {
        Arc::new(Self {
            name: name.into(),
            number,
            term: around.store.term(),
            follows: around.follows,
            caught_up: Mutex::default(),
            interval_ns,
            agents_max: around.settings.agents_max,
            sessions: SessionBound::new(around.settings.session_ahead_max),
            reorder_window: around.settings.reorder_window,
            gap_timeout: around.settings.gap_timeout,
            store: Arc::clone(&around.store),
            publisher: Arc::clone(&around.publisher),
            health: Arc::clone(&around.health),
            events: EventLog::new(),
            live: Arc::default(),
            revision: AtomicU64::new(0),
            restored: AtomicU64::new(0),
            closing: AtomicBool::new(false),
            loaded: OnceLock::new(),
            agents: RwLock::default(),
            former: RwLock::default(),
            snapshot: ArcSwapOption::empty(),
            snapshot_requests: Mutex::new(Some(Vec::new())),
            refinements: Refinements::default(),
            questions: around.questions.clone(),
            route_bounds: Arc::default(),
            broken: AtomicBool::new(false),
        })
    }

    /// Stops the space for good, before it has begun: only an operator can help.
    pub(super) fn stop(&self, reason: String) {
        tracing::error!(space = %self.name, reason, "the space is stopped");
        gauge!(SPACE_STOPPED, "space" => self.name.to_string()).set(1.0);
        let _ = self.loaded.set(Err(Unavailable::Stopped(reason)));
    }

    /// Notes that all that could be read at a time is folded.
    pub(crate) fn note_caught_up(&self, at: Instant) {
        *self.lock_caught_up() = Some(at);
    }

    pub(super) fn lock_caught_up(&self) -> MutexGuard<'_, Option<Instant>> {
        self.caught_up
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
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

    /// Gives the map to all who asked for it: one copy for all, and copying is cheap.
    pub(crate) fn serve_snapshots(&self, map: &CognitiveMap) {
        let requests = self.snapshot_requests().as_mut().map(std::mem::take);
        let requests = requests.unwrap_or_default();
        if requests.is_empty() {
            return;
        }
        let snapshot = Arc::new(map.clone());
        self.snapshot.store(Some(Arc::clone(&snapshot)));
        for request in requests {
            // Whoever asked may have gone.
            let _ = request.send(Arc::clone(&snapshot));
        }
    }

    pub(super) fn agents(
        &self,
    ) -> std::sync::RwLockReadGuard<'_, BTreeMap<String, Arc<AgentView>>> {
        self.agents.read().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn snapshot_requests(&self) -> MutexGuard<'_, Option<Vec<SnapshotRequest>>> {
        self.snapshot_requests
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}
