//! The trips of a space, and which of them may go first.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::occurrences::Occurrences;
use super::{Leg, TRIPS_MAX, Trip, TripEnd};
use crate::memory::ids::TripId;
use crate::memory::strength::{Clock, Strength};
use state::{CorruptState, StateWriter};
use state::{PageItems, SparseVec};
use state::{Summary, SummaryTree, merged};

/// Trips per page.
const PAGE: usize = 16;
/// Most forgotten trips whose pages of legs a checkpoint can say are gone: far more than are
/// forgotten between two checkpoints. The legs of others stay where they are stored, and are passed
/// over.
const FORGOTTEN_MAX: usize = 4096;

/// All trips, in the order of recording.
#[derive(Clone, Debug, Default)]
pub(crate) struct TripMap {
    trips: SparseVec<Trip, PAGE>,
    /// Number of legs of all trips.
    legs: usize,
    /// Of the trips that have ended, page by page.
    summaries: SummaryTree<Weakest>,
    /// The trips under way: at most one for each agent.
    under_way: Arc<BTreeSet<TripId>>,
    /// The trips that are never forgotten.
    pinned: Arc<BTreeSet<TripId>>,
    /// The trips forgotten last, oldest first.
    forgotten: SparseVec<Forgotten, 64>,
    /// Where they lead through each place.
    occurrences: Occurrences,
}

/// The weakest of some trips, the lowest identifier of equally weak ones.
#[derive(Clone, Debug, PartialEq)]
struct Weakest(Strength, TripId);

/// A forgotten trip.
#[derive(Clone, Copy, Debug)]
struct Forgotten {
    trip: usize,
    leg_pages: usize,
    revision: u64,
}

impl Summary for Weakest {
    fn merge(&mut self, other: &Self) {
        if other.0.cmp(self.0).then(other.1.cmp(&self.1)).is_lt() {
            *self = other.clone();
        }
    }
}

impl TripMap {
    /// A trip.
    pub(crate) fn get(&self, trip: TripId) -> Option<&Trip> {
        self.trips.get(trip.0 as usize)
    }

    /// Number of trips.
    pub(crate) fn len(&self) -> usize {
        self.trips.len()
    }

    /// Number of trips that there have ever been.
    pub(crate) fn recorded(&self) -> usize {
        self.trips.next_index()
    }

    /// Number of legs of all trips.
    pub(crate) fn legs(&self) -> usize {
        self.legs
    }

    /// Whether there was such a trip that has been forgotten.
    pub(crate) fn is_forgotten(&self, trip: TripId) -> bool {
        (trip.0 as usize) < self.recorded() && self.get(trip).is_none()
    }

    /// The trips from an identifier on, in the order of recording.
    pub(crate) fn iter_from(&self, first: TripId) -> impl Iterator<Item = (TripId, &Trip)> {
        numbered(self.trips.iter_from(first.0 as usize))
    }

    /// Bytes of memory that the trips take with their legs, reserved ones included.
    pub(crate) fn bytes(&self) -> usize {
        let legs = self.trips.iter().map(|(_, trip)| trip.legs.bytes());
        let lists = self.summaries.bytes() + self.forgotten.bytes() + self.occurrences.bytes();
        legs.sum::<usize>() + self.trips.bytes() + lists
    }

    /// Where they lead through each place.
    pub(crate) fn occurrences(&self) -> &Occurrences {
        &self.occurrences
    }

    /// Adds a trip of no legs yet. None when there have been as many as a space can have.
    pub(crate) fn begin(&mut self, trip: Trip, revision: u64) -> Option<TripId> {
        let id = u32::try_from(self.recorded()).ok()?;
        if id >= TRIPS_MAX {
            return None;
        }
        self.trips.push(trip, revision);
        Arc::make_mut(&mut self.under_way).insert(TripId(id));
        Some(TripId(id))
    }

    /// Appends a leg that ended at `stamp_ns`; answers whether no more legs fit.
    pub(crate) fn push_leg(
        &mut self,
        trip: TripId,
        leg: Leg,
        stamp_ns: i64,
        revision: u64,
    ) -> bool {
        let Some(record) = self.trips.get_mut(trip.0 as usize, revision) else {
            return false;
        };
        let (from, to) = (leg.from(), leg.to());
        record.push(leg, stamp_ns, revision);
        self.legs += 1;
        // As many as a trip has legs at most.
        let position = u32::try_from(record.leg_count()).unwrap_or(u32::MAX);
        if position == 1 {
            self.occurrences.push(from, trip, 0);
        }
        self.occurrences.push(to, trip, position);
        record.is_full()
    }

    /// Ends a trip; answers with its number of legs. From now on it may be the weakest.
    pub(crate) fn end(&mut self, trip: TripId, reason: TripEnd, revision: u64) -> Option<usize> {
        let record = self.trips.get_mut(trip.0 as usize, revision)?;
        record.end(reason);
        Arc::make_mut(&mut self.under_way).remove(&trip);
        let legs = record.leg_count();
        self.summarise(trip);
        Some(legs)
    }

    /// A leg of a trip was travelled again: all of them together count as one use.
    pub(crate) fn travel_again(&mut self, trip: TripId, now: Clock, revision: u64) {
        if let Some(record) = self.trips.get_mut(trip.0 as usize, revision) {
            let legs = record.leg_count().max(1);
            record.strength.used(now, 1.0 / legs as f64);
            self.summarise(trip);
        }
    }

    /// The weakest trip that has ended, the lowest identifier of equally weak ones.
    pub(crate) fn weakest(&self) -> Option<TripId> {
        self.summaries.of_all().map(|weakest| weakest.1)
    }

    /// The trip under way that began first, of those that may be forgotten.
    pub(crate) fn first_under_way(&self) -> Option<TripId> {
        let mut under_way = self.under_way.iter();
        under_way.find(|trip| !self.is_pinned(**trip)).copied()
    }

    /// Whether a trip is never to be forgotten.
    pub(crate) fn is_pinned(&self, trip: TripId) -> bool {
        self.pinned.contains(&trip)
    }

    /// The trips that are never to be forgotten.
    pub(crate) fn pinned(&self) -> impl Iterator<Item = TripId> {
        self.pinned.iter().copied()
    }

    /// Says whether a trip is never to be forgotten.
    pub(crate) fn pin(&mut self, trip: TripId, is_pinned: bool) {
        if self.get(trip).is_none() || self.is_pinned(trip) == is_pinned {
            return;
        }
        let pinned = Arc::make_mut(&mut self.pinned);
        if is_pinned {
            pinned.insert(trip);
        } else {
            pinned.remove(&trip);
        }
        self.summarise(trip);
    }

    /// Removes a trip. The agent that is under way on it will notice.
    pub(crate) fn forget(&mut self, trip: TripId, revision: u64) -> Option<Trip> {
        let index = trip.0 as usize;
        let record = self.trips.remove(index, revision)?;
        self.legs -= record.leg_count();
        self.occurrences.forget(trip);
        if record.ended.is_none() {
            Arc::make_mut(&mut self.under_way).remove(&trip);
        }
        self.summarise(trip);
        if self.forgotten.len() >= FORGOTTEN_MAX {
            let oldest = self.forgotten.next_index() - self.forgotten.len();
            self.forgotten.remove(oldest, 0);
        }
        let forgotten = Forgotten {
            trip: index,
            leg_pages: record.legs.page_count(),
            revision,
        };
        self.forgotten.push(forgotten, 0);
        Some(record)
    }

    /// Summarises the page of a trip anew.
    fn summarise(&mut self, trip: TripId) {
        let page = trip.0 as usize / PAGE;
        let ended = numbered(self.trips.iter_page(page)).filter(|(_, trip)| trip.ended.is_some());
        let ended = ended.filter(|(id, _)| !self.pinned.contains(id));
        let weakest: Vec<_> = ended.map(|(id, trip)| Weakest(trip.strength, id)).collect();
        self.summaries.set(page, merged(weakest.iter()));
    }

    /// The pages of trips that changed after a revision.
    pub(crate) fn changed_pages(
        &self,
        since: u64,
    ) -> impl Iterator<Item = (usize, PageItems<'_, Trip>)> {
        self.trips.changed_pages(since)
    }

    /// The pages of legs that changed after a revision: trip, page, legs; none of a forgotten trip.
    pub(crate) fn changed_legs(&self, since: u64) -> impl Iterator<Item = (usize, usize, &[Leg])> {
        let gone = self.forgotten.iter().map(|(_, forgotten)| *forgotten);
        let gone = gone.filter(move |forgotten| forgotten.revision > since);
        let gone = gone.flat_map(|forgotten| {
            (0..forgotten.leg_pages).map(move |page| (forgotten.trip, page, &[][..]))
        });
        // A leg is appended to its trip, so legs change only where their trip does.
        let pages = self.trips.changed_pages(since);
        let changed = pages.flat_map(|(page, _)| self.trips.iter_page(page));
        gone.chain(changed.flat_map(move |(trip, record)| {
            let pages = record.legs.changed_pages(since);
            pages.map(move |(page, _, legs)| (trip, page, legs))
        }))
    }

    /// Writes the digests of all pages.
    pub(crate) fn write_digests(&self, out: &mut StateWriter) {
        self.trips.write_digests(out);
    }

    /// Adds a checkpoint's page of trips.
    pub(crate) fn restore_page(
        &mut self,
        page: usize,
        bytes: &[u8],
        revision: u64,
    ) -> Result<(), CorruptState> {
        if page * PAGE >= TRIPS_MAX as usize {
            return Err(CorruptState::Invalid);
        }
        self.trips.restore_page(page, bytes, revision)
    }

    /// Appends a checkpoint's page of legs to their trip. Those of a forgotten one are passed over.
    pub(crate) fn restore_legs(
        &mut self,
        trip: usize,
        bytes: &[u8],
        revision: u64,
    ) -> Result<(), CorruptState> {
        let known = trip < self.recorded();
        match self.trips.get_mut(trip, revision) {
            Some(record) => {
                let before = record.leg_count();
                record.push_leg_page(bytes, revision)?;
                self.legs += record.leg_count() - before;
                Ok(())
            }
            None if known => Ok(()),
            None => Err(CorruptState::Invalid),
        }
    }

    /// Sets how many trips there have been, once all are there.
    pub(crate) fn skip_to(&mut self, recorded: usize) {
        self.trips.skip_to(recorded);
    }

    /// Makes what follows from the trips, once all have been restored.
    pub(crate) fn summarise_all(&mut self) {
        let mut pages: Vec<_> = self.iter_from(TripId(0)).map(|(id, _)| id).collect();
        pages.dedup_by_key(|id| id.0 as usize / PAGE);
        for first in pages {
            self.summarise(first);
        }
        let under_way = self.iter_from(TripId(0));
        let under_way = under_way.filter(|(_, trip)| trip.ended.is_none());
        self.under_way = Arc::new(under_way.map(|(id, _)| id).collect());
        let mut occurrences = Occurrences::default();
        for (id, trip) in self.iter_from(TripId(0)) {
            for (position, place) in (0..).zip(trip.places()) {
                occurrences.push(place, id, position);
            }
        }
        self.occurrences = occurrences;
    }
}

/// Trips by identifier, which fits by construction.
fn numbered<'a>(
    trips: impl Iterator<Item = (usize, &'a Trip)>,
) -> impl Iterator<Item = (TripId, &'a Trip)> {
    trips.map(|(index, trip)| {
        let id = u32::try_from(index).expect("identifiers are given out as 32 bits");
        (TripId(id), trip)
    })
}
