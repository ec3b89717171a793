//! The committer: one thread that makes groups of blocks durable and then says so.
//!
//! While it syncs, further blocks gather for the next sync; that is the group commit. Only it moves
//! watermarks, and only after the sync has returned.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use cogmap_proto::IngestAnswer;

use super::agent_view::AgentView;
use super::counters::CommitCounters;
use super::health::Health;
use super::message::{Change, IngestError, Reply};
use super::publisher::Publisher;
use crate::store::Store;

/// How often is looked, while nothing is written, whether the store may still be written.
const LOOK_INTERVAL: Duration = Duration::from_millis(250);

/// What a writer has appended to the store and applied.
#[derive(Debug)]
pub(crate) struct Commit {
    pub(crate) space: Arc<str>,
    pub(crate) samples: u64,
    pub(crate) marks: Vec<Mark>,
    pub(crate) answers: Vec<Answer>,
    /// Those who wait for a change that is no sample.
    pub(crate) changes: Vec<Change>,
}

/// Samples of an agent's session below `next` are in the store.
#[derive(Debug)]
pub(crate) struct Mark {
    pub(crate) view: Arc<AgentView>,
    pub(crate) session: u64,
    pub(crate) next: u64,
}

/// Someone to answer when it is durable.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) reply: Reply,
    pub(crate) view: Arc<AgentView>,
    pub(crate) duplicates: u64,
}

/// Starts the committer. It ends when all senders are gone.
pub(crate) fn start(
    store: Arc<dyn Store>,
    publisher: Arc<dyn Publisher>,
    health: Arc<Health>,
    interval: Duration,
) -> (Sender<Commit>, JoinHandle<()>) {
    let (sender, receiver) = channel();
    let thread = Builder::new()
        .name("committer".into())
        .spawn(move || run(&*store, &*publisher, &health, &receiver, interval))
        .expect("the system can start a thread");
    (sender, thread)
}

fn run(
    store: &dyn Store,
    publisher: &dyn Publisher,
    health: &Health,
    commits: &Receiver<Commit>,
    interval: Duration,
) {
    let counters = CommitCounters::new();
    let mut group = Vec::new();
    let mut last_sync: Option<Instant> = None;
    while let Some(first) = next(store, health, commits) {
        group.push(first);
        // A group that comes alone is synced at once; under load the interval lets groups gather.
        if let Some(rest) = last_sync.and_then(|last| interval.checked_sub(last.elapsed())) {
            let until = Instant::now() + rest;
            while let Ok(commit) =
                commits.recv_timeout(until.saturating_duration_since(Instant::now()))
            {
                group.push(commit);
            }
        }
        group.extend(commits.try_iter());
        let began = Instant::now();
        let result = if health.failed().is_some() {
            None
        } else {
            Some(store.sync())
        };
        counters.latency(began.elapsed());
        last_sync = Some(Instant::now());
        match result {
            Some(Ok(())) => group
                .drain(..)
                .for_each(|commit| acknowledge(commit, publisher, &counters)),
            Some(Err(error)) => {
                health.fail(&error);
                group.drain(..).for_each(|commit| refuse(commit, health));
            }
            None => group.drain(..).for_each(|commit| refuse(commit, health)),
        }
    }
}

/// The next commit; none when all senders are gone.
fn next(store: &dyn Store, health: &Health, commits: &Receiver<Commit>) -> Option<Commit> {
    loop {
        match commits.recv_timeout(LOOK_INTERVAL) {
            Ok(commit) => return Some(commit),
            Err(RecvTimeoutError::Disconnected) => return None,
            Err(RecvTimeoutError::Timeout) => {
                if let Err(error) = store.check_ownership() {
                    health.fail(&error);
                }
            }
        }
    }
}

fn acknowledge(commit: Commit, publisher: &dyn Publisher, counters: &CommitCounters) {
    counters.durable(&commit.space, commit.samples);
    for mark in &commit.marks {
        mark.view.marks().durable(mark.session, mark.next);
    }
    for mark in &commit.marks {
        publisher.watermark(&commit.space, &mark.view);
    }
    for Answer {
        reply,
        view,
        duplicates,
    } in commit.answers
    {
        // Whoever asked may have gone; the samples are durable all the same.
        let _ = reply.send(Ok(IngestAnswer {
            watermark: view.watermark(),
            duplicates,
            refused: Vec::new(),
        }));
    }
    for change in commit.changes {
        change.answer(Ok(()));
    }
}

fn refuse(commit: Commit, health: &Health) {
    for answer in commit.answers {
        let refusal = health.refusal().unwrap_or(IngestError::Closed);
        let _ = answer.reply.send(Err(refusal));
    }
    for change in commit.changes {
        change.answer(Err(health.refusal().unwrap_or(IngestError::Closed)));
    }
}
