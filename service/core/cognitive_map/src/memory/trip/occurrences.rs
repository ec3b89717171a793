//! Where trips lead through each place.

use crate::memory::ids::{PlaceId, TripId};
use state::{NONE, Slab, SparseVec};

/// Occurrences per page.
const PAGE: usize = 64;

/// The positions of all places in all trips. It follows from the trips, and is no part of the
/// state: a leg adds one or two, a forgotten trip takes its own away.
#[derive(Clone, Debug, Default)]
pub(crate) struct Occurrences {
    all: Slab<Occurrence, PAGE>,
    /// The latest of each place.
    of_place: SparseVec<u32, PAGE>,
    /// The latest of each trip.
    of_trip: SparseVec<u32, PAGE>,
}

/// A trip leads through a place.
#[derive(Clone, Copy, Debug)]
struct Occurrence {
    place: PlaceId,
    trip: TripId,
    /// 0 where the trip begins, then the end of each leg.
    position: u32,
    /// Those of the same place before and after it.
    older: u32,
    newer: u32,
    /// The one before it on the same trip.
    before: u32,
}

impl Occurrences {
    /// The positions of a place in trips, in no particular order.
    pub(crate) fn at(&self, place: PlaceId) -> impl Iterator<Item = (TripId, u32)> {
        let latest = self.of_place.get(place.0 as usize).copied();
        let first = latest.and_then(|number| self.all.get(number));
        let chain = std::iter::successors(first, |item| self.all.get(item.older));
        chain.map(|item| (item.trip, item.position))
    }

    /// A trip goes on to a place.
    pub(super) fn push(&mut self, place: PlaceId, trip: TripId, position: u32) {
        let latest = |items: &SparseVec<u32, PAGE>, key: u32| items.get(key as usize).copied();
        let older = latest(&self.of_place, place.0).unwrap_or(NONE);
        let occurrence = Occurrence {
            place,
            trip,
            position,
            older,
            newer: NONE,
            before: latest(&self.of_trip, trip.0).unwrap_or(NONE),
        };
        let number = self.all.insert(occurrence, 0);
        if number == NONE {
            return;
        }
        if let Some(older) = self.all.get_mut(older, 0) {
            older.newer = number;
        }
        self.of_place.insert(place.0 as usize, number, 0);
        self.of_trip.insert(trip.0 as usize, number, 0);
    }

    /// A trip is forgotten.
    pub(super) fn forget(&mut self, trip: TripId) {
        let mut number = self.of_trip.remove(trip.0 as usize, 0).unwrap_or(NONE);
        while let Some(gone) = self.all.remove(number, 0) {
            let place = gone.place.0 as usize;
            if let Some(older) = self.all.get_mut(gone.older, 0) {
                older.newer = gone.newer;
            }
            if let Some(newer) = self.all.get_mut(gone.newer, 0) {
                newer.older = gone.older;
            } else if gone.older == NONE {
                self.of_place.remove(place, 0);
            } else {
                self.of_place.insert(place, gone.older, 0);
            }
            number = gone.before;
        }
    }

    /// Bytes of memory that it takes, reserved ones included.
    pub(super) fn bytes(&self) -> usize {
        self.all.pages.bytes() + self.of_place.bytes() + self.of_trip.bytes()
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Against lists, while trips come, go on and go.
        #[test]
        fn every_place_knows_the_trips_through_it(
            steps in prop::collection::vec((0..5u32, 0..4u32, prop::bool::weighted(0.1)), 1..200),
        ) {
            let mut occurrences = Occurrences::default();
            let mut expected: Vec<(u32, TripId, u32)> = Vec::new();
            for (place, trip, is_forgotten) in steps {
                let trip = TripId(trip);
                if is_forgotten {
                    occurrences.forget(trip);
                    expected.retain(|item| item.1 != trip);
                } else {
                    let position = expected.iter().filter(|item| item.1 == trip).count();
                    let position = u32::try_from(position).unwrap();
                    occurrences.push(PlaceId(place), trip, position);
                    expected.push((place, trip, position));
                }
                for place in 0..5 {
                    let here = expected.iter().filter(|item| item.0 == place);
                    let mut here: Vec<_> = here.map(|item| (item.1, item.2)).collect();
                    here.sort_unstable();
                    let mut found: Vec<_> = occurrences.at(PlaceId(place)).collect();
                    found.sort_unstable();
                    prop_assert_eq!(found, here);
                }
            }
            prop_assert_eq!(occurrences.all.len(), expected.len());
        }
    }
}
