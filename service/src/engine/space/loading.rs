//! The thread of a space: it loads the map, and then is its writer.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::Ordering;

use cognitive_map::Settings;

use crate::engine::checkpointer::Checkpointer;
use crate::engine::queue::Inbox;
use crate::engine::recovery::{self, Loading, RecoveryError};
use crate::engine::shared::{Shared, Surroundings};
use crate::engine::unavailable::Unavailable;
use crate::engine::workers::Handover;
use crate::engine::writer::Writer;

/// Stands for the writer's thread: when it ends, also by a panic, nobody waits for it any more.
struct Presence<'a>(&'a Shared);

impl Drop for Presence<'_> {
    fn drop(&mut self) {
        if !self.0.closing.load(Ordering::Acquire) {
            self.0.broken.store(true, Ordering::Release);
            tracing::error!(space = %self.0.name, "the space's writer has ended");
        }
        // Whoever waits learns it by the end of the channel.
        *self.0.snapshot_requests() = None;
    }
}

/// Loads the map of a space and then writes it, until the space closes.
pub(super) fn load_and_run(
    shared: &Arc<Shared>,
    inbox: Inbox,
    around: Surroundings,
    core: &Settings,
) {
    let Surroundings {
        store,
        health,
        commits,
        jobs,
        workers,
        settings,
        ..
    } = around;
    let closing = || shared.closing.load(Ordering::Acquire);
    let loading = Loading {
        store: &*store,
        health: &health,
        name: &shared.name,
        space: shared.number,
        settings: core,
        interval_ns: shared.interval_ns,
    };
    // A journal that nobody can fold must not leave everybody waiting.
    let recovered = catch_unwind(AssertUnwindSafe(|| recovery::recover(&loading, closing)));
    let interrupted = |_| Err(RecoveryError::Interrupted);
    match recovered.unwrap_or_else(interrupted) {
        Ok(recovered) => {
            let progress = (recovered.checkpoint_revision, recovered.next_block);
            let interval = settings.checkpoint_interval;
            let checkpointer =
                Checkpointer::new(shared.number, store, health, jobs, interval, progress);
            let space = &*shared.name;
            tracing::info!(space, revision = recovered.map.revision(), "space loaded");
            let restored = recovered.checkpoint_revision;
            shared.restored.store(restored, Ordering::Release);
            shared
                .revision
                .store(recovered.map.revision(), Ordering::Release);
            shared.events.begin(recovered.events.clone());
            let handover = Handover::new(workers);
            let writer = Writer::new(
                Arc::clone(shared),
                commits,
                checkpointer,
                handover,
                recovered,
            );
            let _present = Presence(shared);
            let _ = shared.loaded.set(Ok(()));
            if !shared.follows {
                return writer.run(inbox);
            }
            if let Err(error) = writer.follow(inbox) {
                tracing::error!(space, %error, "follow the journal");
            }
        }
        Err(RecoveryError::Closing) => {
            let _ = shared.loaded.set(Err(Unavailable::Closing));
        }
        Err(error) => shared.stop(error.to_string()),
    }
}
