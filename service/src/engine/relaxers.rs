//! Threads that relax the past of maps beside their writers.
//!
//! A map begins a relaxation at one record and needs its outcome at a later one, both fixed by the
//! records ([`RelaxationJob`]). Who computes the outcome makes no difference to it: a thread of
//! these, or the writer where none has begun when it is needed.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};

use cognitive_map::{CognitiveMap, RelaxationJob};

/// Most relaxations that wait for a thread, each with a snapshot. A space has one at a time; those
/// beyond are left to their writers.
const WAITING_MAX: usize = 64;

/// The way to the threads. Clones share them; they end when all are gone.
#[derive(Clone, Debug)]
pub(crate) struct Relaxers(Option<SyncSender<RelaxationJob>>);

/// Starts so many threads; without any, the writers relax themselves.
pub(crate) fn start(threads: usize) -> (Relaxers, Vec<JoinHandle<()>>) {
    if threads == 0 {
        return (Relaxers(None), Vec::new());
    }
    let (sender, jobs) = sync_channel(WAITING_MAX);
    let jobs = Arc::new(Mutex::new(jobs));
    let start = |_| {
        let jobs = Arc::clone(&jobs);
        Builder::new()
            .name("relaxer".into())
            .spawn(move || run(&jobs))
            .expect("the system can start a thread")
    };
    (Relaxers(Some(sender)), (0..threads).map(start).collect())
}

fn run(jobs: &Mutex<Receiver<RelaxationJob>>) {
    loop {
        // Whoever waits for the next job has the lock; who works has not.
        let next = jobs.lock().unwrap_or_else(PoisonError::into_inner).recv();
        let Ok(job) = next else {
            return;
        };
        // The map that needs it meets the same panic, and its space says so.
        if catch_unwind(AssertUnwindSafe(|| job.run())).is_err() {
            tracing::error!("a relaxation ended with a panic");
        }
    }
}

/// Hands over the relaxations of one map.
#[derive(Debug)]
pub(crate) struct Handover {
    relaxers: Relaxers,
    /// Revision of the latest one.
    latest: u64,
}

impl Handover {
    pub(crate) fn new(relaxers: Relaxers) -> Self {
        Self {
            relaxers,
            latest: 0,
        }
    }

    /// Hands over the relaxation under way, if it is new. Never blocks.
    pub(crate) fn offer(&mut self, map: &CognitiveMap) {
        let Some(job) = map.relaxation().filter(|job| job.revision() > self.latest) else {
            return;
        };
        self.latest = job.revision();
        if let Relaxers(Some(jobs)) = &self.relaxers {
            let _ = jobs.try_send(job.clone());
        }
    }
}
