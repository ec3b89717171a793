//! The parts of trips that a sequence may be on.

use std::ops::Range;

use crate::memory::ids::{PlaceId, TripId};
use crate::memory::strength::Clock;
use crate::memory::trip::{TripEnd, TripMap};

use super::evidence::Evidence;

/// Places that the sequence may have skipped, or have besides: a part is so much longer on both
/// sides.
const SLACK: u32 = 2;
/// Positions up to which all trips are looked at as a whole: so few cost next to nothing, and what
/// is elsewhere is not small beside what is near.
const WHOLE_MAX: usize = 512;

/// A part of a trip.
#[derive(Debug)]
pub(super) struct Window {
    pub(super) trip: TripId,
    /// Position of its first place in the trip.
    pub(super) first: u32,
    pub(super) places: Vec<PlaceId>,
    /// The positions, counted from the first, that are near an element of the sequence.
    near: Vec<Range<usize>>,
    /// What comes after its last place.
    pub(super) after: After,
    /// How much the trip counts: 1, less as it fades. That later trips went the same way does not
    /// make it more, for they count themselves.
    pub(super) weight: f64,
}

/// What comes after a part of a trip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum After {
    /// A place.
    Place(PlaceId),
    /// The trip ended, and nobody went on.
    End,
    /// It is not known: the trip is under way, or what came next is not part of it.
    Unknown,
}

impl Window {
    /// The parts of all trips where an element of a sequence may be, by trip and position. `None`
    /// when told to give up.
    pub(super) fn of_all(
        elements: &[Evidence],
        trips: &TripMap,
        now: Clock,
        gives_up: &mut dyn FnMut() -> bool,
    ) -> Option<Vec<Self>> {
        let last = u32::try_from(elements.len().saturating_sub(1)).unwrap_or(u32::MAX);
        let mut spans: Vec<(TripId, u32, u32)> = Vec::new();
        for (rank, element) in (0..).zip(elements) {
            for place in element.places() {
                if gives_up() {
                    return None;
                }
                let occurrences = trips.occurrences().at(place);
                spans.extend(occurrences.map(|(trip, at)| {
                    let from = at.saturating_sub(rank + SLACK);
                    (trip, from, at.saturating_add(last - rank + SLACK))
                }));
            }
        }
        spans.sort_unstable();
        let mut joined: Vec<(TripId, u32, u32)> = Vec::new();
        for (trip, from, to) in spans {
            match joined.last_mut() {
                Some(before) if before.0 == trip && from <= before.2.saturating_add(1) => {
                    before.2 = before.2.max(to);
                }
                _ => joined.push((trip, from, to)),
            }
        }
        if !joined.is_empty() && trips.legs() + trips.len() <= WHOLE_MAX {
            let whole = trips.iter_from(TripId(0)).filter_map(|(trip, _)| {
                let mut window = Self::of(trips, trip, 0, u32::MAX - 1, now)?;
                let near = joined.iter().filter(|span| span.0 == trip);
                window.near = near
                    .map(|span| span.1 as usize..span.2 as usize + 1)
                    .collect();
                Some(window)
            });
            return Some(whole.collect());
        }
        let windows = joined.into_iter();
        Some(
            windows
                .filter_map(|(trip, from, to)| Self::of(trips, trip, from, to, now))
                .collect(),
        )
    }

    /// The part of a trip between two positions.
    fn of(trips: &TripMap, trip: TripId, from: u32, to: u32, now: Clock) -> Option<Self> {
        let record = trips.get(trip)?;
        let mut places = record.places_from(from as usize);
        let within: Vec<_> = { places.by_ref() }.take((to - from) as usize + 1).collect();
        if within.is_empty() {
            return None;
        }
        let after = match (places.next(), record.ended()) {
            (Some(place), _) => After::Place(place),
            (None, Some(TripEnd::Stillness | TripEnd::SessionEnd | TripEnd::Marker)) => After::End,
            (None, _) => After::Unknown,
        };
        Some(Self {
            trip,
            first: from,
            near: std::iter::once(0..within.len()).collect(),
            places: within,
            after,
            weight: record.strength.now(now).min(1.0),
        })
    }

    /// Whether it can be told of one of its places that the sequence is there.
    pub(super) fn is_near(&self, index: usize) -> bool {
        self.near.iter().any(|near| near.contains(&index))
    }

    /// What comes after one of its places.
    pub(super) fn after(&self, index: usize) -> After {
        let next = self.places.get(index + 1).copied();
        next.map_or(self.after, After::Place)
    }
}
