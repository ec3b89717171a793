//! Marks of how far spaces are durable, synced beside the committer.

use std::collections::BTreeMap;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, PoisonError, RwLock};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use crate::store::SpaceNumber;
use crate::store::log::SpaceLog;

/// The journals that are open for writing.
pub(super) type Logs = RwLock<BTreeMap<SpaceNumber, Arc<SpaceLog>>>;

/// Time between syncs of the marks, which bounds what a power cut takes from them.
const MARK_SYNC_INTERVAL: Duration = Duration::from_secs(1);

/// The thread that syncs the marks beside the committer.
#[derive(Debug)]
pub(super) struct MarkSync {
    stop: Sender<()>,
    thread: JoinHandle<()>,
    due: Arc<AtomicBool>,
}

impl MarkSync {
    /// Starts the thread.
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

    /// Has the marks synced soon, if any was written.
    pub(super) fn wake(&self, written: bool) {
        if written {
            self.due.store(true, Ordering::Release);
        }
    }

    /// Ends the thread after a last sync.
    pub(super) fn stop(self) {
        drop(self.stop);
        if self.thread.join().is_err() {
            tracing::error!("the thread that syncs marks ended with a panic");
        }
    }
}
