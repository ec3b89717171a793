//! A space, as everyone but its writer sees it.

mod instructions;
mod live;
mod loading;
mod questions;
mod refined;
mod trajectories;

use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::Instant;

use cogmap_proto::{Codec, EventId, IngestAnswer, Name, ObjectLesson, SampleBatch, SpaceSettings};
use cognitive_map::{CognitiveMap, Label, Lesson, Settings};
use tokio::sync::oneshot;

pub use live::LiveFollower;

use super::agent_view::AgentView;
use super::events::EventFollower;
use super::message::{Call, IngestError, ObjectRequest, Request};
use super::question::QuestionRoom;
use super::queue::{NotQueued, Queue, queue};
use super::refinement::Refinements;
use super::shared::{Shared, Surroundings};
use super::unavailable::Unavailable;
use crate::store::SpaceNumber;

/// A space: its readers' and senders' side.
#[derive(Debug)]
pub struct Space {
    shared: Arc<Shared>,
    settings: SpaceSettings,
    queue: Queue,
    thread: Mutex<Option<JoinHandle<()>>>,
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

    /// Revision of the map at the end of the latest round.
    pub fn revision(&self) -> u64 {
        self.shared.revision.load(Ordering::Acquire)
    }

    /// Of a space that is followed: when all was folded that could be read by then. None before the
    /// first time, and of a space that this process writes.
    pub fn caught_up(&self) -> Option<Instant> {
        *self.shared.lock_caught_up()
    }

    /// Whether a map of this space knows all that changed after a revision: it came to the revision
    /// after it was loaded.
    pub fn knows_changes_since(&self, revision: u64, map: &CognitiveMap) -> bool {
        let restored = self.shared.restored.load(Ordering::Acquire);
        (restored..=map.revision()).contains(&revision)
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

    /// Samples of all agents that are applied and not durable yet.
    pub fn lag_samples(&self) -> u64 {
        let agents = self.shared.agents();
        agents.values().map(|view| view.lag().not_durable).sum()
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

    /// Teaches an object at once and answers when that is durable. `lesson` is what came, `valid`
    /// the same as the map takes it.
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

    /// Has the thread take what is queued, checkpoint, and end; waits for nothing.
    pub(crate) fn begin_to_close(&self) {
        self.shared.closing.store(true, Ordering::Release);
        self.queue.call();
    }

    /// Takes what is queued, checkpoints, and ends the thread.
    pub(crate) fn close(&self) {
        self.begin_to_close();
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
