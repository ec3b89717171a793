//! Checkpoints: what changed since the last one, written beside the running space.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use cognitive_map::CognitiveMap;

use super::episodes::EndedEpisodes;
use super::events::EventRing;
use super::health::Health;
use super::trajectory::{CorruptChunk, Recorder};
use crate::store::{Checkpoint, SpaceNumber, Store};

/// A space's side of the checkpoints.
#[derive(Debug)]
pub(crate) struct Checkpointer {
    space: SpaceNumber,
    store: Arc<dyn Store>,
    health: Arc<Health>,
    jobs: Sender<Job>,
    progress: Arc<Progress>,
    interval: Duration,
    last: Instant,
    last_block: u64,
}

/// How far the checkpoints of a space are.
#[derive(Debug)]
struct Progress {
    /// Whether one is being written.
    writing: AtomicBool,
    /// Revision of the map that the latest one holds.
    revision: AtomicU64,
}

/// A checkpoint to write.
#[derive(Debug)]
pub(crate) struct Job {
    space: SpaceNumber,
    next_block: u64,
    map: CognitiveMap,
    beside: Beside,
    progress: Arc<Progress>,
}

/// What a checkpoint holds beside the map.
#[derive(Clone, Debug)]
pub(crate) struct Beside {
    /// One for each agent, in the agents' order.
    pub(crate) recorders: Vec<Recorder>,
    /// The latest events.
    pub(crate) events: EventRing,
    /// The latest episode of each agent that has ended.
    pub(crate) episodes: EndedEpisodes,
}

impl Beside {
    /// Its bytes: the recorders, the events and the episodes, each behind what older versions read.
    fn write(&self) -> Vec<u8> {
        let mut bytes = Recorder::write_all(&self.recorders);
        bytes.extend(self.events.write());
        bytes.extend(self.episodes.write());
        bytes
    }

    /// Reads what [`Beside::write`] or an older version wrote beside the map.
    pub(crate) fn read(bytes: &[u8], map: &CognitiveMap) -> Result<Self, CorruptChunk> {
        let (recorders, rest) = Recorder::read_all(bytes)?;
        let events = EventRing::read(rest);
        let (events, rest) = events.unwrap_or_else(|| (EventRing::since(map.revision()), &[]));
        Ok(Self {
            recorders,
            events,
            episodes: EndedEpisodes::read(rest, map.agent_numbers()),
        })
    }
}

/// Starts the thread that writes checkpoints. It ends when all senders are gone.
pub(crate) fn start(store: Arc<dyn Store>, health: Arc<Health>) -> (Sender<Job>, JoinHandle<()>) {
    let (sender, receiver) = channel();
    let thread = Builder::new()
        .name("checkpointer".into())
        .spawn(move || run(&*store, &health, &receiver))
        .expect("the system can start a thread");
    (sender, thread)
}

fn run(store: &dyn Store, health: &Health, jobs: &Receiver<Job>) {
    while let Ok(job) = jobs.recv() {
        write(store, health, &job);
    }
}

fn write(store: &dyn Store, health: &Health, job: &Job) {
    if health.failed().is_some() || !health.keeps_derived() {
        return;
    }
    let since = job.progress.revision.load(Ordering::Acquire);
    let checkpoint = Checkpoint {
        next_block: job.next_block,
        pages: job.map.checkpoint(since).collect(),
        recorders: job.beside.write(),
    };
    match store.write_checkpoint(job.space, &checkpoint) {
        Ok(()) => job
            .progress
            .revision
            .store(job.map.revision(), Ordering::Release),
        Err(error) => health.derived_fail(&error),
    }
}

/// However it ends, the next one may begin: nobody waits for a thread that has ended with a panic.
impl Drop for Job {
    fn drop(&mut self) {
        self.progress.writing.store(false, Ordering::Release);
    }
}

impl Checkpointer {
    pub(crate) fn new(
        space: SpaceNumber,
        store: Arc<dyn Store>,
        health: Arc<Health>,
        jobs: Sender<Job>,
        interval: Duration,
        (revision, next_block): (u64, u64),
    ) -> Self {
        let progress = Progress {
            writing: AtomicBool::new(false),
            revision: revision.into(),
        };
        let progress = Arc::new(progress);
        let last = Instant::now();
        Self {
            space,
            store,
            health,
            jobs,
            progress,
            interval,
            last,
            last_block: next_block,
        }
    }

    /// Begins a checkpoint if it is time for one.
    pub(crate) fn offer(
        &mut self,
        next_block: u64,
        map: &CognitiveMap,
        beside: impl FnOnce() -> Beside,
    ) {
        let due = next_block > self.last_block && self.last.elapsed() >= self.interval;
        if due && !self.progress.writing.swap(true, Ordering::AcqRel) {
            (self.last, self.last_block) = (Instant::now(), next_block);
            // The thread outlives the writers; were it gone, the journal would still be whole.
            let _ = self.jobs.send(self.job(next_block, map, beside()));
        }
    }

    /// Writes a last checkpoint, here and now.
    pub(crate) fn finish(
        &mut self,
        next_block: u64,
        map: &CognitiveMap,
        beside: impl FnOnce() -> Beside,
    ) {
        while self.progress.writing.load(Ordering::Acquire) {
            std::thread::sleep(Duration::from_millis(1));
        }
        if next_block > self.last_block
            || self.progress.revision.load(Ordering::Acquire) < map.revision()
        {
            write(
                &*self.store,
                &self.health,
                &self.job(next_block, map, beside()),
            );
        }
    }

    fn job(&self, next_block: u64, map: &CognitiveMap, beside: Beside) -> Job {
        let progress = Arc::clone(&self.progress);
        Job {
            space: self.space,
            next_block,
            map: map.clone(),
            beside,
            progress,
        }
    }
}

#[cfg(test)]
mod tests {
    use cogmap_proto::SpaceSettings;

    use super::*;
    use crate::decode::core_settings;
    use crate::store::{Derived, Journal, LocalStore};

    #[test]
    fn the_last_checkpoint_is_written_although_the_thread_is_gone() {
        let directory = tempfile::tempdir().unwrap();
        let store = Arc::new(LocalStore::open(directory.path()).unwrap());
        let space = store.create_space("lab", b"").unwrap();
        let map = CognitiveMap::new(core_settings(&SpaceSettings::default()).unwrap());
        let beside = || Beside {
            recorders: Vec::new(),
            events: EventRing::since(0),
            episodes: EndedEpisodes::default(),
        };
        let (jobs, receiver) = channel();
        let health = Arc::new(Health::default());
        let mut checkpointer = Checkpointer::new(
            space,
            Arc::clone(&store) as Arc<dyn Store>,
            health,
            jobs,
            Duration::ZERO,
            (0, 0),
        );
        drop(receiver);
        checkpointer.offer(1, &map, beside);
        checkpointer.finish(2, &map, beside);
        let written = store.checkpoint(space).unwrap().unwrap();
        assert_eq!(written.next_block, 2);
    }
}
