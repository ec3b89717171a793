//! Syncs of several journals at once.

use std::io;
use std::sync::Arc;
use std::thread::Builder;

use crate::store::log::{Pending, SpaceLog};

/// Most files that are synced at once.
const SYNCS_AT_ONCE: usize = 8;

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
