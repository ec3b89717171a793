//! Thinned ways: chains of ways as single edges, for programs that take straight edges.

use std::collections::BTreeSet;

use nalgebra::{Point3, Vector3};

use crate::fold::CognitiveMap;
use crate::memory::ids::PlaceId;
use crate::memory::way::{Way, Waypoint};

/// A chain of ways that lie within a tolerance of the straight line between its ends.
#[derive(Clone, Debug, PartialEq)]
pub struct ThinnedWay {
    /// Its places, the ends among them: at least two. The lower number of the ends comes first.
    pub places: Vec<PlaceId>,
    /// Length of the ways \[m\].
    pub length_m: f64,
    /// To the last place.
    pub there: ThinnedTraversal,
    /// To the first place.
    pub back: ThinnedTraversal,
}

/// How a chain is travelled in one direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThinnedTraversal {
    /// Whether all of its ways were travelled in this direction.
    pub is_travelled: bool,
    /// Sum of the mean durations of its ways, in the other direction where nobody went in this one
    /// \[s\].
    pub duration_s: f64,
}

/// A chain that grows.
struct Chain {
    places: Vec<PlaceId>,
    positions: Vec<Point3<f64>>,
}

impl CognitiveMap {
    /// The ways as a graph of fewer edges: each chain of ways between places where other than two
    /// ways meet is as few edges as leave each of its places within `tolerance_m` of them. The ways
    /// of an edge were all travelled in the same directions. Ways that are blocked in one direction
    /// or the other are left out. Equal maps give equal graphs.
    ///
    /// No edge leads from a place to itself, but there may be two between the same places.
    pub fn thinned_ways(&self, tolerance_m: f64) -> Vec<ThinnedWay> {
        let mut places: Vec<PlaceId> = self.waypoints().map(Waypoint::place).collect();
        places.sort_unstable();
        let blocked = self.ways().filter(|way| self.is_blocked(way));
        let mut done: BTreeSet<[PlaceId; 2]> = blocked.map(Way::ends).collect();
        let mut thinned = Vec::new();
        // Chains begin where ways meet; what is left are circles, which begin anywhere.
        let junctions = { places.iter() }.filter(|place| !self.is_passed(**place));
        for &place in junctions.chain(&places) {
            for way in self.ways_at(place) {
                let mut from = place;
                let mut way = way;
                while done.insert(way.ends()) {
                    let chain = self.chain(from, way, tolerance_m, &mut done);
                    let [.., before, last] = chain[..] else { break };
                    thinned.extend(self.thinned(chain));
                    let mut others = self.ways_at(last);
                    let onward = others.find(|other| other.other_end(last) != before);
                    let Some(onward) = onward.filter(|_| self.is_link(last)) else {
                        break;
                    };
                    (from, way) = (last, onward);
                }
            }
        }
        thinned
    }

    /// Whether nobody gets through a way, in one direction or the other.
    fn is_blocked(&self, way: &Way) -> bool {
        if self.blockages().is_empty() {
            return false;
        }
        let [Some(a), Some(b)] = way.ends().map(|end| self.waypoint(end)) else {
            return false;
        };
        let at = |end: &Waypoint| Point3::from(end.pose().translation.vector);
        let (a, b) = ((a.place(), &at(a)), (b.place(), &at(b)));
        let mut blocked = self.blockages().iter().map(|blockage| &blockage.blocked);
        blocked.any(|what| what.blocks(a, b) || what.blocks(b, a))
    }

    /// Whether two ways meet at a place, and both were travelled in the same directions through it.
    fn is_passed(&self, place: PlaceId) -> bool {
        let mut ways = self.ways_at(place);
        let (Some(one), Some(other), None) = (ways.next(), ways.next(), ways.next()) else {
            return false;
        };
        let went = |from: &Way, to: &Way| {
            let (came, left) = (
                from.travelled_from(from.other_end(place)),
                to.travelled_from(place),
            );
            (came.times() > 0, left.times() > 0)
        };
        let [(to, on), (to_back, on_back)] = [went(one, other), went(other, one)];
        to == on && to_back == on_back
    }

    /// Whether two ways meet at a place.
    fn is_link(&self, place: PlaceId) -> bool {
        self.ways_at(place).count() == 2
    }

    /// The places of the longest chain from a way on that lies within the tolerance of a straight
    /// line. Its ways are done.
    fn chain(
        &self,
        from: PlaceId,
        way: &Way,
        tolerance_m: f64,
        done: &mut BTreeSet<[PlaceId; 2]>,
    ) -> Vec<PlaceId> {
        let position = |place| {
            let waypoint = self.waypoint(place)?;
            Some(Point3::from(waypoint.pose().translation.vector))
        };
        let mut last = way.other_end(from);
        let (Some(start), Some(end)) = (position(from), position(last)) else {
            return Vec::new();
        };
        let mut chain = Chain {
            places: vec![from, last],
            positions: vec![start, end],
        };
        let mut before = from;
        while self.is_passed(last) {
            let mut others = self.ways_at(last);
            let Some(onward) = others.find(|other| other.other_end(last) != before) else {
                break;
            };
            let next = onward.other_end(last);
            let Some(at) = position(next).filter(|_| next != from) else {
                break;
            };
            if done.contains(&onward.ends()) || !chain.reaches(&at, tolerance_m) {
                break;
            }
            done.insert(onward.ends());
            chain.places.push(next);
            chain.positions.push(at);
            (before, last) = (last, next);
        }
        chain.places
    }

    /// The edge of a chain.
    fn thinned(&self, mut places: Vec<PlaceId>) -> Option<ThinnedWay> {
        if places.first()? > places.last()? {
            places.reverse();
        }
        let mut thinned = ThinnedWay {
            places,
            length_m: 0.0,
            there: ThinnedTraversal::NONE,
            back: ThinnedTraversal::NONE,
        };
        for pair in thinned.places.windows(2) {
            let way = self.way(pair[0], pair[1])?;
            thinned.length_m += way.length_m(&self.places_of_way(way)?);
            thinned.there.add(way, pair[0], pair[1]);
            thinned.back.add(way, pair[1], pair[0]);
        }
        Some(thinned)
    }
}

impl ThinnedTraversal {
    /// Of no way yet.
    const NONE: Self = Self {
        is_travelled: true,
        duration_s: 0.0,
    };

    fn add(&mut self, way: &Way, from: PlaceId, to: PlaceId) {
        let mean_s = way.travelled_from(from).mean_s();
        self.is_travelled &= mean_s.is_some();
        let other_s = way.travelled_from(to).mean_s();
        self.duration_s += mean_s.or(other_s).unwrap_or(0.0);
    }
}

impl Chain {
    /// Whether all places of the chain are within the tolerance of the line from its start to a
    /// position.
    fn reaches(&self, at: &Point3<f64>, tolerance_m: f64) -> bool {
        let start = self.positions[0];
        let line = at - start;
        self.positions.iter().all(|position| {
            let off = position - start;
            distance_m(&off, &line) <= tolerance_m
        })
    }
}

/// Distance of a point from a line that begins at the origin \[m\].
fn distance_m(point: &Vector3<f64>, line: &Vector3<f64>) -> f64 {
    let length = line.norm_squared();
    let along = if length > 0.0 {
        (point.dot(line) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (point - line * along).norm()
}
