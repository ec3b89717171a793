//! Bridges: ways without which two parts of the network would be separate.

use std::collections::{BTreeSet, VecDeque};

use super::{WayMap, Waypoint};

/// What two sides of a way have in common without it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Detour {
    /// There is another way round.
    Exists,
    /// There is none: the way is a bridge.
    None,
    /// It was not found within the bound.
    Unknown,
}

/// What a search from one end has reached.
struct Side {
    reached: BTreeSet<u32>,
    next: VecDeque<u32>,
}

impl Side {
    fn from(start: u32) -> Self {
        Self {
            reached: BTreeSet::from([start]),
            next: VecDeque::from([start]),
        }
    }
}

impl WayMap {
    /// Whether the ends of a way stay joined without it: a breadth-first search from both ends in
    /// turn. A side that has nowhere to go on is a part of the network of its own. `edges` is the
    /// number of edges that may be looked at, and what is left of it.
    pub(super) fn detour(&self, number: u32, edges: &mut usize) -> Detour {
        let Some(way) = self.way(number) else {
            return Detour::Unknown;
        };
        let mut sides = way.waypoints.map(Side::from);
        loop {
            for turn in [0, 1] {
                let Some(at) = sides[turn].next.pop_front() else {
                    return Detour::None;
                };
                let around = self.waypoint(at).map(Waypoint::edges);
                for edge in around.unwrap_or_default() {
                    if *edges == 0 {
                        return Detour::Unknown;
                    }
                    *edges -= 1;
                    if edge.way == number {
                        continue;
                    }
                    if sides[1 - turn].reached.contains(&edge.to) {
                        return Detour::Exists;
                    }
                    if sides[turn].reached.insert(edge.to) {
                        sides[turn].next.push_back(edge.to);
                    }
                }
            }
        }
    }
}
