//! What the writer of a space leaves for those who watch it live.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use cogmap_proto::{LiveCounts, LiveSighting};

/// Sightings that are kept: as many as a tick shows.
const SIGHTINGS_KEPT: usize = 64;

/// What those who watch a space share with its writer. While nobody watches, the writer looks at
/// one number in each round, and keeps the totals.
#[derive(Debug, Default)]
pub(crate) struct Live {
    watchers: AtomicUsize,
    sightings: Mutex<Sightings>,
    counts: Mutex<LiveCounts>,
    pub(crate) totals: Totals,
}

/// The latest sightings that were applied while somebody watched.
#[derive(Debug, Default)]
struct Sightings {
    kept: VecDeque<Arc<LiveSighting>>,
    /// Number of all of them since the start of the service.
    count: u64,
}

/// What a space has counted since the start of the service. `/metrics` has it too, but counters
/// there cannot be read.
#[derive(Debug, Default)]
pub(crate) struct Totals {
    /// Samples applied.
    pub(crate) applied: Total,
    /// Samples skipped for good.
    pub(crate) skipped: Total,
    /// Samples received again.
    pub(crate) duplicates: Total,
    /// Messages dropped whole.
    pub(crate) dropped: Total,
}

/// A number that only grows.
#[derive(Debug, Default)]
pub(crate) struct Total(AtomicU64);

/// Somebody who watches a space. The writer keeps sightings as long as there is one.
#[derive(Debug)]
pub(crate) struct Watcher {
    live: Arc<Live>,
    /// Number of the next sighting to take.
    next_sighting: u64,
}

impl Total {
    /// Adds to the number.
    pub(crate) fn add(&self, more: u64) {
        if more > 0 {
            self.0.fetch_add(more, Ordering::Relaxed);
        }
    }

    /// The number.
    pub(crate) fn get(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

impl Live {
    /// Whether somebody watches.
    pub(crate) fn is_watched(&self) -> bool {
        self.watchers.load(Ordering::Relaxed) > 0
    }

    /// Notes a sighting that was applied. The oldest makes room.
    pub(crate) fn note_sighting(&self, sighting: LiveSighting) {
        let mut sightings = self.sightings();
        if sightings.kept.len() == SIGHTINGS_KEPT {
            sightings.kept.pop_front();
        }
        sightings.kept.push_back(Arc::new(sighting));
        sightings.count += 1;
    }

    /// Notes the sizes of the space.
    pub(crate) fn note_counts(&self, counts: LiveCounts) {
        *self.counts.lock().unwrap_or_else(PoisonError::into_inner) = counts;
    }

    /// The sizes of the space: those of the latest round while somebody watches, otherwise at most
    /// a tenth of a second old.
    pub(crate) fn counts(&self) -> LiveCounts {
        *self.counts.lock().unwrap_or_else(PoisonError::into_inner)
    }

    // A panic while the lock is held cannot leave half a change behind.
    fn sightings(&self) -> MutexGuard<'_, Sightings> {
        { self.sightings.lock() }.unwrap_or_else(PoisonError::into_inner)
    }
}

impl Watcher {
    /// Watches from now on.
    pub(crate) fn new(live: &Arc<Live>) -> Self {
        live.watchers.fetch_add(1, Ordering::Relaxed);
        let next_sighting = live.sightings().count;
        Self {
            live: Arc::clone(live),
            next_sighting,
        }
    }

    /// The sightings since the last call that are still kept, oldest first.
    pub(crate) fn take_sightings(&mut self) -> Vec<LiveSighting> {
        let kept: Vec<_> = {
            let sightings = self.live.sightings();
            let fresh = sightings.count - self.next_sighting;
            let fresh = usize::try_from(fresh).unwrap_or(usize::MAX);
            let known = sightings.kept.len().saturating_sub(fresh);
            self.next_sighting = sightings.count;
            sightings.kept.iter().skip(known).cloned().collect()
        };
        kept.iter().map(|kept| LiveSighting::clone(kept)).collect()
    }
}

impl Drop for Watcher {
    fn drop(&mut self) {
        self.live.watchers.fetch_sub(1, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use cogmap_proto::Target;

    use super::*;

    fn sighting(stamp_ns: i64) -> LiveSighting {
        LiveSighting {
            agent: "ada".to_owned(),
            stamp_ns,
            from_m: [0.0; 3],
            to_m: [1.0, 0.0, 0.0],
            target: Target::Landmark("post".to_owned()),
        }
    }

    fn stamps(watcher: &mut Watcher) -> Vec<i64> {
        let taken = watcher.take_sightings();
        taken.iter().map(|one| one.stamp_ns).collect()
    }

    #[test]
    fn each_watcher_takes_the_latest_sightings_once() {
        let live = Arc::new(Live::default());
        assert!(!live.is_watched());
        live.note_sighting(sighting(0));
        let (mut eager, mut slow) = (Watcher::new(&live), Watcher::new(&live));
        assert!(live.is_watched());
        live.note_sighting(sighting(1));
        assert_eq!(stamps(&mut eager), [1], "none from before");
        assert!(stamps(&mut eager).is_empty());
        (2..100).for_each(|stamp| live.note_sighting(sighting(stamp)));
        assert_eq!(stamps(&mut slow), (36..100).collect::<Vec<_>>());
        assert_eq!(stamps(&mut eager), (36..100).collect::<Vec<_>>());
        drop((eager, slow));
        assert!(!live.is_watched());
    }
}
