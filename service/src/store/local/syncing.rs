//! Syncs of journals and of their marks.

use std::collections::BTreeMap;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, PoisonError, RwLock};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use super::super::SpaceNumber;
use super::super::log::{Pending, SpaceLog};

/// Time between syncs of the marks, which bounds what a power cut takes from them.
const MARK_SYNC_INTERVAL: Duration = Duration::from_secs(1);
/// Most files that are synced at once.
const SYNCS_AT_ONCE: usize = 8;

/// The journals that are open for writing.
pub(super) type Logs = RwLock<BTreeMap<SpaceNumber, Arc<SpaceLog>>>;

/// Syncs several journals: side by side, for the disk can join what comes at the same time.
pub(super) fn sync_all(pending: &[(Arc<SpaceLog>, Pending)]) -> io::Result<()> {
    let sync_some = |some: &[(Arc<SpaceLog>, Pending)]| {
        some.iter().try_for_each(|(log, pending)| log.sync(pending))
    };
    if pending.len() <= 1 {
        return sync_some(pending);
    }
    std::thread::scope(|scope| {
        let some = pending.chunks(pending.len().div_ceil(SYNCS_AT_ONCE));
        let threads: Vec<_> = some
            .map(|some| {
                let thread = Builder::new().name("sync".into());
                // Where the system has no thread to spare, one after the other.
                let spawned = thread.spawn_scoped(scope, move || sync_some(some));
                spawned.map_err(|_| sync_some(some))
            })
            .collect();
        let interrupted = |_| Err(io::Error::other("a sync ended with a panic"));
        let results = threads.into_iter().map(|thread| match thread {
            Ok(thread) => thread.join().unwrap_or_else(interrupted),
            Err(synced) => synced,
        });
        // All have ended before the first error is told.
        results.collect::<Vec<_>>().into_iter().collect()
    })
}

/// The thread that syncs the marks beside the committer.
#[derive(Debug)]
pub(super) struct MarkSync {
    stop: Sender<()>,
    thread: JoinHandle<()>,
    due: Arc<AtomicBool>,
}

impl MarkSync {
    pub(super) fn start(logs: Arc<Logs>) -> io::Result<Self> {
        let (stop, stopped) = channel::<()>();
        let due = Arc::new(AtomicBool::new(false));
        let is_due = Arc::clone(&due);
        let run = move || loop {
            let stopping = stopped.recv_timeout(MARK_SYNC_INTERVAL);
            if is_due.swap(false, Ordering::AcqRel) {
                let logs: Vec<_> = {
                    let logs = logs.read().unwrap_or_else(PoisonError::into_inner);
                    logs.values().cloned().collect()
                };
                for log in logs {
                    if let Err(error) = log.sync_mark() {
                        tracing::warn!(%error, "sync how far a space is durable");
                    }
                }
            }
            if stopping != Err(RecvTimeoutError::Timeout) {
                break;
            }
        };
        let thread = Builder::new().name("marks".into()).spawn(run)?;
        Ok(Self { stop, thread, due })
    }

    pub(super) fn wake(&self, written: bool) {
        if written {
            self.due.store(true, Ordering::Release);
        }
    }
    /// Ends the thread, after a last sync of what is due.
    pub(super) fn end(self) {
        drop(self.stop);
        if self.thread.join().is_err() {
            tracing::error!("the thread that syncs marks ended with a panic");
        }
    }
}
