//! The latest events of a space, for whoever follows them or pages through them.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use cogmap_proto::{EventId, EventRecord, MissedEvents};
use tokio::sync::watch;

/// Events that are kept: who falls behind or comes back later than that misses some.
pub const EVENTS_KEPT: usize = 1024;

/// The latest events of a space, in the order of their ids.
#[derive(Clone, Debug, Default)]
pub(crate) struct EventRing {
    kept: VecDeque<Arc<EventRecord>>,
    /// Number of events that have made room since the start of the service.
    dropped: u64,
    /// Every event after this one is kept.
    since: EventId,
}

/// Takes events from the writer, gives them to all who follow.
#[derive(Debug)]
pub(crate) struct EventLog {
    ring: Arc<Mutex<EventRing>>,
    /// Number of events since the start of the service.
    count: watch::Sender<u64>,
}

/// Somebody who follows the events of a space.
#[derive(Debug)]
pub struct EventFollower {
    ring: Arc<Mutex<EventRing>>,
    count: watch::Receiver<u64>,
    /// Number of the next event to take.
    next: u64,
    /// To be told before anything else.
    missed: Option<MissedEvents>,
}

/// What a follower takes at once.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Followed {
    /// What it has missed before these.
    pub missed: Option<MissedEvents>,
    /// The next events, oldest first.
    pub events: Vec<Arc<EventRecord>>,
}

impl EventRing {
    /// A ring that knows no event of the records up to `revision`, and will be told all later ones.
    pub(crate) fn since(revision: u64) -> Self {
        let index = if revision == 0 { 0 } else { u32::MAX };
        Self {
            since: EventId { revision, index },
            ..Self::default()
        }
    }

    pub(crate) fn push(&mut self, event: Arc<EventRecord>) {
        if self.kept.len() == EVENTS_KEPT
            && let Some(oldest) = self.kept.pop_front()
        {
            self.since = oldest.id;
            self.dropped += 1;
        }
        self.kept.push_back(event);
    }

    /// Number of events since the start of the service.
    fn count(&self) -> u64 {
        self.dropped + self.kept.len() as u64
    }

    /// Place of the first event after `id`, and whether some between are not kept any more.
    fn after(&self, id: EventId, revision: u64) -> (usize, bool) {
        // An id of a record that the space does not have is one of another past: of a space that
        // was deleted, or of records that a crash has taken. Nothing is known to be before what is
        // kept.
        if id < self.since || id.revision > revision {
            return (0, true);
        }
        (self.kept.partition_point(|event| event.id <= id), false)
    }

    /// Bytes of the ring, for a checkpoint.
    pub(crate) fn write(&self) -> Vec<u8> {
        let events: Vec<&EventRecord> = self.kept.iter().map(AsRef::as_ref).collect();
        postcard::to_stdvec(&(self.since, events)).expect("plain data encodes")
    }

    /// Reads what [`EventRing::write`] wrote, and gives the bytes after it; nothing where that is
    /// not what the bytes are.
    pub(crate) fn read(bytes: &[u8]) -> Option<(Self, &[u8])> {
        type Plain = (EventId, Vec<EventRecord>);
        let ((since, events), rest) = postcard::take_from_bytes::<Plain>(bytes).ok()?;
        let ordered = events.is_sorted_by(|a, b| a.id < b.id);
        let fits = events.len() <= EVENTS_KEPT && ordered;
        let ring = fits.then(|| Self {
            kept: events.into_iter().map(Arc::new).collect(),
            dropped: 0,
            since,
        });
        Some((ring?, rest))
    }
}

impl EventLog {
    pub(crate) fn new() -> Self {
        Self {
            ring: Arc::default(),
            count: watch::Sender::new(0),
        }
    }

    /// Begins with what is known at the start of the service.
    pub(crate) fn begin(&self, ring: EventRing) {
        let mut kept = lock(&self.ring);
        *kept = ring;
        self.count.send_replace(kept.count());
    }

    /// Takes events of a round.
    pub(crate) fn extend(&self, events: impl Iterator<Item = Arc<EventRecord>>) {
        let mut ring = lock(&self.ring);
        let before = ring.count();
        events.for_each(|event| ring.push(event));
        if ring.count() != before {
            self.count.send_replace(ring.count());
        }
    }

    /// What is kept now.
    pub(crate) fn ring(&self) -> EventRing {
        lock(&self.ring).clone()
    }

    /// Follows from the event after `after` on, or from now on. `revision` is that of the map.
    pub(crate) fn follow(&self, after: Option<EventId>, revision: u64) -> EventFollower {
        let count = self.count.subscribe();
        let ring = lock(&self.ring);
        let (next, missed) = match after {
            None => (ring.count(), None),
            Some(id) => {
                let (at, missed) = ring.after(id, revision);
                let next = ring.dropped + at as u64;
                (next, missed.then(|| ring.missed(None)))
            }
        };
        drop(ring);
        EventFollower {
            ring: Arc::clone(&self.ring),
            count,
            next,
            missed,
        }
    }
}

impl EventRing {
    /// That events before those that are kept were missed; how many, where somebody counted them.
    fn missed(&self, events: Option<u64>) -> MissedEvents {
        MissedEvents {
            events,
            next: self.kept.front().map(|event| event.id),
        }
    }
}

impl EventFollower {
    /// The next events, `limit` at most; none if there are none yet.
    pub fn take(&mut self, limit: usize) -> Followed {
        let ring = lock(&self.ring);
        let mut missed = self.missed.take();
        if self.next < ring.dropped {
            missed = Some(ring.missed(Some(ring.dropped - self.next)));
            self.next = ring.dropped;
        }
        let from = usize::try_from(self.next - ring.dropped).unwrap_or(usize::MAX);
        let events: Vec<_> = ring.kept.iter().skip(from).take(limit).cloned().collect();
        self.next += events.len() as u64;
        Followed { missed, events }
    }

    /// Returns when the space is gone.
    pub(super) async fn gone(&mut self) {
        // There is no number that it waits for, so it ends with the sender.
        let _ = self.count.wait_for(|_| false).await;
    }

    /// Waits until there is something to take. False when there will be nothing any more: the space
    /// is gone.
    pub async fn wait(&mut self) -> bool {
        let (next, told) = (self.next, self.missed.is_none());
        let came = self.count.wait_for(|count| *count > next || !told).await;
        came.is_ok()
    }
}

// A panic while the lock is held cannot leave half a change behind.
fn lock(ring: &Mutex<EventRing>) -> MutexGuard<'_, EventRing> {
    ring.lock().unwrap_or_else(PoisonError::into_inner)
}
