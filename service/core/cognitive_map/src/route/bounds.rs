//! Lower bounds of lengths along the ways (ALT: Goldberg & Harrelson 2005).

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

use super::tuning::{BOUND_UNIT_UM, PIVOTS};
use crate::fold::CognitiveMap;
use crate::memory::ids::PlaceId;
use crate::memory::way::{Edge, WayMap, Waypoint};
use state::PagedVec;

/// What is bounded of a waypoint: its distances from the pivots, in units of 10 µm. They fill one
/// line of the processor's cache, and lie in no second one.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Distances([u32; PIVOTS]);

const NOWHERE: Distances = Distances([u32::MAX; PIVOTS]);

/// Distances along the ways from a few places, the *pivots*, to all others, for
/// [`routes`](CognitiveMap::routes).
///
/// ```text
/// |d(p, a) − d(p, b)| ≤ length of any route from a to b
/// ```
///
/// This holds for any d that changes by no more than a way's length along each way. So ways that
/// become longer or go need no repair, and where a way comes or becomes shorter, only what it
/// brings nearer does.
#[derive(Clone, Debug)]
pub struct RouteBounds {
    revision: u64,
    distances: PagedVec<Distances, 64>,
    /// The place of each waypoint: its number may become another one's.
    places: PagedVec<Option<PlaceId>, 64>,
}

/// The distances of a goal.
pub(super) struct Target<'a> {
    bounds: &'a RouteBounds,
    distances: Distances,
}

impl Target<'_> {
    /// Lower bound of the length from a waypoint to the goal \[µm\].
    pub(super) fn bound_um(&self, from: u32) -> u64 {
        let Some(from) = self.bounds.distances.get(from as usize) else {
            return 0;
        };
        let pairs = from.0.iter().zip(&self.distances.0);
        let most = pairs.fold(0, |most, (a, b)| a.abs_diff(*b).max(most));
        u64::from(most) * BOUND_UNIT_UM
    }
}

impl RouteBounds {
    /// Bounds for a map. Takes some 16 times as long as the longest search in it.
    pub fn of(map: &CognitiveMap) -> Self {
        let ways = &map.ways;
        let mut bounds = Self {
            revision: map.revision(),
            distances: PagedVec::default(),
            places: PagedVec::default(),
        };
        bounds.follow_numbers(ways);
        let numbers = ways.waypoint_numbers() as usize;
        let mut nearest = vec![u32::MAX; numbers];
        let mut pivot = ways.waypoints().next().map(|(number, _)| number);
        // The first search only finds a waypoint at the rim.
        for turn in 0..=PIVOTS {
            let Some(from) = pivot else { break };
            let distances = distances_from(ways, from, numbers);
            if turn > 0 {
                bounds.set(turn - 1, &distances);
            }
            let mut farthest = None;
            for (number, distance) in (0..).zip(&distances) {
                let known = &mut nearest[number as usize];
                if *distance == u32::MAX || ways.waypoint(number).is_none() {
                    continue;
                }
                *known = if turn == 0 {
                    u32::MAX
                } else {
                    *distance.min(known)
                };
                let far = if turn == 0 { *distance } else { *known };
                farthest = farthest.max(Some((far, Reverse(number))));
            }
            pivot = farthest.map(|(_, Reverse(number))| number);
        }
        bounds
    }

    /// The revision of the map that they are for.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Brings them up to date with a later map of the same space, by what changed in between.
    /// Answers false where more than `most` waypoints would have to be looked at, or the map is an
    /// earlier one; they are of no use then.
    #[must_use]
    pub fn follow(&mut self, map: &CognitiveMap, most: usize) -> bool {
        if map.revision() < self.revision {
            return false;
        }
        let ways = &map.ways;
        let mut queue: VecDeque<_> = ways.waypoints_changed(self.revision).collect();
        self.revision = map.revision();
        self.follow_numbers(ways);
        for number in &queue {
            let place = ways.waypoint(*number).map(Waypoint::place);
            if self.places.get(*number as usize) != Some(&place) {
                self.put(*number, NOWHERE);
                if let Some(known) = self.places.get_mut(*number as usize, 0) {
                    *known = place;
                }
            }
        }
        // What a changed waypoint is nearer to, and what is nearer to it.
        let around: Vec<_> = { queue.iter() }
            .filter_map(|number| ways.waypoint(*number))
            .flat_map(|waypoint| waypoint.edges().iter().map(|edge| edge.to))
            .collect();
        queue.extend(around);
        if queue.len() > most {
            return false;
        }
        for _ in 0..most {
            let Some(number) = queue.pop_front() else {
                return true;
            };
            self.spread(ways, number, &mut queue);
        }
        queue.is_empty()
    }

    /// Brings the neighbours of a waypoint as near to the pivots as it makes them.
    fn spread(&mut self, ways: &WayMap, from: u32, queue: &mut VecDeque<u32>) {
        let Some(waypoint) = ways.waypoint(from) else {
            return;
        };
        let Some(here) = self.distances.get(from as usize).copied() else {
            return;
        };
        for edge in waypoint.edges() {
            let length = units(edge);
            let through = here.0.map(|distance| distance.saturating_add(length));
            let Some(known) = self.distances.get(edge.to as usize) else {
                continue;
            };
            let nearer = std::array::from_fn(|pivot| known.0[pivot].min(through[pivot]));
            if nearer != known.0 {
                self.put(edge.to, Distances(nearer));
                queue.push_back(edge.to);
            }
        }
    }

    /// Has an entry for each number.
    fn follow_numbers(&mut self, ways: &WayMap) {
        for number in self.places.len()..ways.waypoint_numbers() as usize {
            let number = u32::try_from(number).expect("waypoints have 32-bit numbers");
            let place = ways.waypoint(number).map(Waypoint::place);
            self.places.push(place, 0);
            self.distances.push(NOWHERE, 0);
        }
    }

    fn put(&mut self, number: u32, distances: Distances) {
        if let Some(entry) = self.distances.get_mut(number as usize, 0) {
            *entry = distances;
        }
    }

    /// Sets the distances from a pivot.
    fn set(&mut self, pivot: usize, distances: &[u32]) {
        for (number, distance) in distances.iter().enumerate() {
            if let Some(entry) = self.distances.get_mut(number, 0) {
                entry.0[pivot] = *distance;
            }
        }
    }

    /// What bounds routes to a waypoint.
    pub(super) fn target(&self, goal: u32) -> Option<Target<'_>> {
        let distances = *self.distances.get(goal as usize)?;
        Some(Target {
            bounds: self,
            distances,
        })
    }
}

/// The length of an edge in units, rounded down.
fn units(edge: &Edge) -> u32 {
    u32::try_from(edge.length_um / BOUND_UNIT_UM).unwrap_or(u32::MAX)
}

/// Distances along the ways from a waypoint to all others, in either direction (Dijkstra 1959).
fn distances_from(ways: &WayMap, start: u32, numbers: usize) -> Vec<u32> {
    let mut distances = vec![u32::MAX; numbers];
    let mut open = BinaryHeap::from([Reverse((0, start))]);
    distances[start as usize] = 0;
    while let Some(Reverse((distance, at))) = open.pop() {
        if distances[at as usize] != distance {
            continue;
        }
        let edges = ways.waypoint(at).map(Waypoint::edges);
        for edge in edges.unwrap_or_default() {
            let there = distance.saturating_add(units(edge));
            let known = &mut distances[edge.to as usize];
            if there < *known {
                *known = there;
                open.push(Reverse((there, edge.to)));
            }
        }
    }
    distances
}
