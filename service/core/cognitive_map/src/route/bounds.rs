//! Lower bounds of lengths along the ways (ALT: Goldberg & Harrelson 2005).

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

use super::graph::{Graph, Junction};
use super::tuning::{BOUND_UNIT_UM, COARSE_UNITS, PAGE, PIVOTS};
use crate::fold::CognitiveMap;
use crate::memory::ids::PlaceId;
use crate::memory::way::{WayMap, Waypoint};
use state::PagedVec;

/// What is bounded of a waypoint: its distances from the pivots, in units of 10 µm.
#[derive(Clone, Copy, Debug)]
struct Distances([u32; PIVOTS]);

const NOWHERE: Distances = Distances([u32::MAX; PIVOTS]);

/// The ways as a search reads them, and distances along them from a few places, the *pivots*, to
/// all others, for [`routes`](CognitiveMap::routes).
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
    graph: Graph,
    /// None for bounds by the straight line alone.
    distances: PagedVec<Distances, PAGE>,
    /// In how coarse units a search is told distances; zero for bounds by the straight line alone.
    coarse: u32,
    /// The place of each waypoint: its number may become another one's.
    places: PagedVec<Option<PlaceId>, PAGE>,
}

/// The distances of a goal.
pub(super) struct Target {
    far: [u16; PIVOTS],
    unit_um: u64,
}

impl Target {
    /// What the first pivot says of a waypoint.
    pub(super) fn glance(&self, from: &Junction) -> u16 {
        from.far[0].abs_diff(self.far[0])
    }

    /// Lower bound of the length from a waypoint to the goal \[µm\], not below `glance`
    /// coarse units. Either distance may be less than a unit above what is noted.
    pub(super) fn bound_um(&self, from: &Junction, glance: u16) -> u64 {
        let pairs = from.far.iter().zip(&self.far);
        let most = pairs.fold(glance, |most, (a, b)| a.abs_diff(*b).max(most));
        u64::from(most.saturating_sub(1)) * self.unit_um
    }
}

impl RouteBounds {
    /// Bounds by the straight line alone, which are soon made.
    pub fn straight(map: &CognitiveMap) -> Self {
        Self::new(map, false)
    }

    fn new(map: &CognitiveMap, has_pivots: bool) -> Self {
        let mut bounds = Self {
            revision: map.revision(),
            graph: Graph::default(),
            distances: PagedVec::default(),
            coarse: u32::from(has_pivots),
            places: PagedVec::default(),
        };
        bounds.follow_numbers(&map.ways);
        bounds
    }

    /// Bounds for a map. Takes some 32 times as long as the longest search in it.
    pub fn of(map: &CognitiveMap) -> Self {
        let ways = &map.ways;
        let mut bounds = Self::new(map, true);
        let numbers = ways.waypoint_numbers() as usize;
        let mut nearest = vec![u32::MAX; numbers];
        let mut pivot = ways.waypoints().next().map(|(number, _)| number);
        // The first search only finds a waypoint at the rim.
        for turn in 0..=PIVOTS {
            let Some(from) = pivot else { break };
            let distances = bounds.distances_from(ways, from, numbers);
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
        let known = bounds.distances.iter().flat_map(|distances| distances.0);
        let longest = known.filter(|distance| *distance < u32::MAX).max();
        bounds.coarse = longest.unwrap_or(0) / COARSE_UNITS + 1;
        for number in 0..ways.waypoint_numbers() {
            bounds.tell(number);
        }
        bounds
    }

    /// Whether they know distances from pivots.
    pub fn has_pivots(&self) -> bool {
        self.coarse > 0
    }

    /// The ways.
    pub(super) fn graph(&self) -> &Graph {
        &self.graph
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
            self.graph.follow(ways, *number);
            let place = ways.waypoint(*number).map(Waypoint::place);
            if self.places.get(*number as usize) != Some(&place) {
                self.put(*number, NOWHERE);
                if let Some(known) = self.places.get_mut(*number as usize, 0) {
                    *known = place;
                }
            }
        }
        if !self.has_pivots() {
            return queue.len() <= most;
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
        let Some(here) = self.distances.get(from as usize).copied() else {
            return;
        };
        let mut changed = Vec::new();
        let Self {
            graph, distances, ..
        } = self;
        graph.for_each_link(ways, from, |to, length_um| {
            let length = units(length_um);
            let through = here.0.map(|distance| distance.saturating_add(length));
            let Some(known) = distances.get(to as usize) else {
                return;
            };
            let nearer = std::array::from_fn(|pivot| known.0[pivot].min(through[pivot]));
            if nearer != known.0
                && let Some(entry) = distances.get_mut(to as usize, 0)
            {
                *entry = Distances(nearer);
                changed.push(to);
            }
        });
        for to in changed {
            self.tell(to);
            queue.push_back(to);
        }
    }

    /// Tells a search how far the pivots of a waypoint are. What is too far counts as less, and so
    /// do pivots to which no way leads.
    fn tell(&mut self, number: u32) {
        if let Some(distances) = self.distances.get(number as usize) {
            let far = |distance: u32| u16::try_from(distance / self.coarse).unwrap_or(u16::MAX);
            self.graph.set_far(number, distances.0.map(far));
        }
    }

    /// Has an entry for each number.
    fn follow_numbers(&mut self, ways: &WayMap) {
        self.graph.follow_numbers(ways);
        for number in self.places.len()..ways.waypoint_numbers() as usize {
            let number = u32::try_from(number).expect("waypoints have 32-bit numbers");
            let place = ways.waypoint(number).map(Waypoint::place);
            self.places.push(place, 0);
            if self.has_pivots() {
                self.distances.push(NOWHERE, 0);
                self.tell(number);
            }
        }
    }

    fn put(&mut self, number: u32, distances: Distances) {
        if let Some(entry) = self.distances.get_mut(number as usize, 0) {
            *entry = distances;
            self.tell(number);
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

    /// Distances along the ways from a waypoint to all others, in either direction (Dijkstra 1959).
    fn distances_from(&self, ways: &WayMap, start: u32, numbers: usize) -> Vec<u32> {
        let mut distances = vec![u32::MAX; numbers];
        let mut open = BinaryHeap::from([Reverse((0_u32, start))]);
        distances[start as usize] = 0;
        while let Some(Reverse((distance, at))) = open.pop() {
            if distances[at as usize] != distance {
                continue;
            }
            self.graph.for_each_link(ways, at, |to, length_um| {
                let there = distance.saturating_add(units(length_um));
                let known = &mut distances[to as usize];
                if there < *known {
                    *known = there;
                    open.push(Reverse((there, to)));
                }
            });
        }
        distances
    }

    /// What bounds routes to a waypoint.
    pub(super) fn target(&self, goal: u32) -> Option<Target> {
        let far = self.graph.junction(goal)?.far;
        let unit_um = BOUND_UNIT_UM * u64::from(self.coarse);
        self.has_pivots().then_some(Target { far, unit_um })
    }
}

/// A length in units, rounded down.
fn units(length_um: u64) -> u32 {
    u32::try_from(length_um / BOUND_UNIT_UM).unwrap_or(u32::MAX)
}
