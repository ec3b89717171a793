//! Threads that compute beside the writers what their maps will need.
//!
//! A map begins a relaxation at one record and needs its outcome at a later one, both fixed by the
//! records ([`RelaxationJob`]); it needs the indexes of an object when somebody touches something
//! ([`IndexingJob`]). Who computes them makes no difference to it: a thread of these, or the writer
//! where none has begun when they are needed.

use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc::{Receiver, SyncSender, TryRecvError, sync_channel};
use std::sync::{Arc, Mutex, PoisonError, TryLockError};
use std::thread::{Builder, JoinHandle};

use cognitive_map::{CognitiveMap, IndexingJob, RelaxationJob};

/// Most jobs that wait for a thread, each with a snapshot of what it is about. Those beyond are
/// left to their writers.
const WAITING_MAX: usize = 64;

/// What a thread has to compute.
#[derive(Debug)]
enum Job {
    Relaxation(RelaxationJob),
    Indexing(IndexingJob),
}

/// The way to the threads. Clones share them; they end when all are gone.
#[derive(Clone, Debug)]
pub(crate) struct Workers {
    /// None where there are no threads.
    jobs: Option<SyncSender<Job>>,
    threads: usize,
}

impl Workers {
    /// Whether there is room for a job.
    fn take(&self, job: Job) -> bool {
        let sent = self.jobs.as_ref().map(|jobs| jobs.try_send(job));
        sent.is_some_and(|sent| sent.is_ok())
    }
}

/// Starts so many threads; without any, the writers compute everything themselves.
pub(crate) fn start(threads: usize) -> (Workers, Vec<JoinHandle<()>>) {
    if threads == 0 {
        let jobs = None;
        return (Workers { jobs, threads }, Vec::new());
    }
    let (sender, jobs) = sync_channel(WAITING_MAX);
    let jobs = Arc::new(Mutex::new(jobs));
    let start = |_| {
        let jobs = Arc::clone(&jobs);
        Builder::new()
            .name("worker".into())
            .spawn(move || run(&jobs))
            .expect("the system can start a thread")
    };
    let jobs = Some(sender);
    (Workers { jobs, threads }, (0..threads).map(start).collect())
}

/// Takes jobs until there will be no more. Relaxations go first: a map waits for each at a record,
/// and for indexes only if something is touched.
fn run(jobs: &Mutex<Receiver<Job>>) {
    let mut indexing = VecDeque::new();
    loop {
        let next = if indexing.is_empty() {
            let jobs = jobs.lock().unwrap_or_else(PoisonError::into_inner);
            jobs.recv().map_err(|_| TryRecvError::Disconnected)
        } else {
            waiting(jobs)
        };
        match next {
            Ok(Job::Relaxation(job)) => attempt(|| job.run()),
            Ok(Job::Indexing(job)) => indexing.push_back(job),
            Err(TryRecvError::Disconnected) => return,
            Err(TryRecvError::Empty) => {
                let mut is_left = true;
                if let Some(job) = indexing.front() {
                    attempt(|| is_left = job.step());
                }
                if !is_left {
                    indexing.pop_front();
                }
            }
        }
    }
}

/// The next job, if one waits that no other thread is waiting for.
fn waiting(jobs: &Mutex<Receiver<Job>>) -> Result<Job, TryRecvError> {
    match jobs.try_lock() {
        Ok(jobs) => jobs.try_recv(),
        Err(TryLockError::Poisoned(jobs)) => jobs.into_inner().try_recv(),
        Err(TryLockError::WouldBlock) => Err(TryRecvError::Empty),
    }
}

/// Does a piece of work. The map that needs it meets the same panic, and its space says so.
fn attempt(work: impl FnOnce()) {
    if catch_unwind(AssertUnwindSafe(work)).is_err() {
        tracing::error!("a job beside a writer ended with a panic");
    }
}

/// Hands over the jobs of one map.
#[derive(Debug)]
pub(crate) struct Handover {
    workers: Workers,
    /// Revision of the latest relaxation.
    relaxation: u64,
    /// The same of the latest change of objects.
    indexing: Option<u64>,
}

impl Handover {
    pub(crate) fn new(workers: Workers) -> Self {
        Self {
            workers,
            relaxation: 0,
            indexing: None,
        }
    }

    /// Hands over what the map will need, if it is new. Never blocks; without room, relaxations are
    /// left to the map, and indexes are handed over the next time.
    pub(crate) fn offer(&mut self, map: &CognitiveMap) {
        if let Some(job) = map.relaxation()
            && job.revision() > self.relaxation
        {
            self.relaxation = job.revision();
            self.workers.take(Job::Relaxation(job.clone()));
        }
        if let Some(job) = map.indexing(self.indexing) {
            let wanted = job.left().min(self.workers.threads);
            let taken = (0..wanted).map(|_| self.workers.take(Job::Indexing(job.clone())));
            if wanted == 0 || taken.fold(false, |any, taken| any | taken) {
                self.indexing = Some(job.revision());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, Instant};

    use cognitive_map::{Label, Lesson, Record, Settings, Spacing, Touch, TouchNoise};

    use super::*;

    /// A map that was taught so many objects.
    fn taught(objects: u64) -> CognitiveMap {
        let mut map = CognitiveMap::new(Settings::default());
        let noise = TouchNoise::new(0.001, 0.1, 0.1).expect("noise");
        for number in 0..objects {
            let touch = |k: u8| Touch::new([f64::from(k) * 0.02, 0.0, 0.0], noise);
            let touches = (0..20).map(touch).collect::<Result<_, _>>();
            let record = Record::TeachObject {
                number,
                name: Label::new(&format!("rod-{number}")).expect("a name"),
                lesson: Lesson::new(Spacing::default(), touches.expect("touches")),
            };
            map.apply(&record, &mut Vec::new());
        }
        map
    }

    #[test]
    fn objects_are_indexed_while_nobody_touches_anything() {
        let map = taught(5);
        let (workers, threads) = start(2);
        let mut handover = Handover::new(workers);
        handover.offer(&map);
        let deadline = Instant::now() + Duration::from_secs(60);
        while map.indexing(None).expect("objects").left() > 0 {
            assert!(Instant::now() < deadline, "nobody indexes");
            std::thread::sleep(Duration::from_millis(1));
        }
        drop(handover);
        for thread in threads {
            thread.join().expect("no panic");
        }
    }

    #[test]
    fn what_finds_no_room_is_offered_again() {
        let map = taught(1);
        let (sender, jobs) = sync_channel(1);
        let other = taught(1).indexing(None).expect("an object");
        sender.send(Job::Indexing(other)).expect("room");
        let mut handover = Handover::new(Workers {
            jobs: Some(sender),
            threads: 2,
        });
        handover.offer(&map);
        assert!(jobs.try_recv().is_ok() && jobs.try_recv().is_err());
        handover.offer(&map);
        handover.offer(&map);
        assert!(matches!(jobs.try_recv(), Ok(Job::Indexing(job)) if job.left() == 1));
        assert!(jobs.try_recv().is_err(), "it is handed over once");
    }
}
