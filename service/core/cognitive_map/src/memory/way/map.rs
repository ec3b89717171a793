//! The ways of a space, and the waypoints where they meet.

use nalgebra::Isometry3;

use super::{Edge, Traversal, Traversals, Way, Waypoint};
use crate::input::RememberedWay;
use crate::memory::ids::PlaceId;
use crate::memory::strength::{Clock, Strength};
use state::{CorruptState, NONE, Slab, Slot, SparseVec, State, StateReader, StateWriter};
use state::{Summary, SummaryTree, merged, state_of_struct};

/// Ways and waypoints per page: few, since the copy of a page of waypoints copies their edges.
const PAGE: usize = 16;
/// Micrometres of a metre.
const UM_PER_M: f64 = 1e6;

/// All ways. A leg changes one of them, whatever their number.
#[derive(Clone, Debug, Default)]
pub(crate) struct WayMap {
    pub(super) ways: Slab<Way, PAGE>,
    pub(super) waypoints: Slab<Waypoint, PAGE>,
    /// The waypoint of each place.
    pub(super) of_place: SparseVec<u32, 64>,
    /// Of the ways page by page.
    pub(super) summaries: SummaryTree<Weakest>,
    /// How often the way has been spared that was spared most.
    pub(super) spared_max: u32,
    /// Whether every way is a bridge, as far as is known.
    pub(super) is_forest: bool,
    least: Least,
}

/// What is not in pages.
struct Head {
    ways: (u32, u32),
    waypoints: (u32, u32),
    spared_max: u32,
    is_forest: bool,
}

state_of_struct!(Head {
    ways,
    waypoints,
    spared_max,
    is_forest
});

/// What no way is below, not even one that has been forgotten. It only makes searches shorter, and
/// is no part of the state.
#[derive(Clone, Copy, Debug)]
struct Least {
    s_per_m: f64,
    m2_per_m: f64,
}

impl Default for Least {
    fn default() -> Self {
        Self {
            s_per_m: f64::INFINITY,
            m2_per_m: f64::INFINITY,
        }
    }
}

/// The way that is forgotten first of some.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Weakest {
    spared: u32,
    strength: Strength,
    ends: [PlaceId; 2],
    pub(super) way: u32,
}

impl Weakest {
    fn of(number: u32, way: &Way) -> Self {
        Self {
            spared: way.spared,
            strength: way.strength,
            ends: way.ends,
            way: number,
        }
    }
}

impl Least {
    fn include(&mut self, way: &Way, places: &Isometry3<f64>) {
        let distance_m = places.translation.vector.norm();
        let durations = way.travelled.iter().filter_map(Traversals::mean_s);
        let duration_s = durations.fold(f64::INFINITY, f64::min);
        // Ways of no length bound nothing, and a ratio that is none must not stay.
        let least = |least: f64, quantity: f64| {
            let ratio = quantity / distance_m;
            if ratio.is_nan() {
                least
            } else {
                least.min(ratio)
            }
        };
        self.s_per_m = least(self.s_per_m, duration_s);
        self.m2_per_m = least(self.m2_per_m, way.position_variance_m2());
    }
}

impl Summary for Weakest {
    fn merge(&mut self, other: &Self) {
        let order = other.spared.cmp(&self.spared);
        let order = order.then(other.strength.cmp(self.strength));
        if order.then(other.ends.cmp(&self.ends)).is_lt() {
            *self = other.clone();
        }
    }
}

impl WayMap {
    /// Number of ways.
    pub(crate) fn len(&self) -> usize {
        self.ways.len()
    }

    /// A way.
    pub(crate) fn way(&self, number: u32) -> Option<&Way> {
        self.ways.get(number)
    }

    /// The ways with their numbers, which others get once they are forgotten.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (u32, &Way)> {
        self.iter_from(0)
    }

    /// The ways from a number on.
    pub(crate) fn iter_from(&self, first: u32) -> impl Iterator<Item = (u32, &Way)> {
        let slots = (first..).zip(self.ways.pages.iter_from(first as usize));
        slots.filter_map(|(number, slot)| match slot {
            Slot::Taken(way) => Some((number, way)),
            Slot::Vacant(_) => None,
        })
    }

    /// Number of waypoint numbers that have been given out.
    pub(crate) fn waypoint_numbers(&self) -> u32 {
        self.waypoints.numbers()
    }

    /// A waypoint.
    pub(crate) fn waypoint(&self, number: u32) -> Option<&Waypoint> {
        self.waypoints.get(number)
    }

    /// The waypoints with their numbers.
    pub(crate) fn waypoints(&self) -> impl Iterator<Item = (u32, &Waypoint)> {
        self.waypoints.iter()
    }

    /// The number of a place's waypoint; `None` where no way leads.
    pub(crate) fn at(&self, place: PlaceId) -> Option<u32> {
        self.of_place.get(place.0 as usize).copied()
    }

    /// The way between two places.
    pub(crate) fn between(&self, a: PlaceId, b: PlaceId) -> Option<&Way> {
        self.way(self.number_between(a, b)?)
    }

    fn number_between(&self, a: PlaceId, b: PlaceId) -> Option<u32> {
        let waypoint = self.waypoints.get(self.at(a)?)?;
        let rank = waypoint.rank(b).ok()?;
        Some(waypoint.edges[rank].way)
    }

    /// How the places of a way lie: the second in the frame of the first.
    pub(crate) fn places_of(&self, way: &Way) -> Option<Isometry3<f64>> {
        let [first, second] = way.waypoints;
        let (first, second) = (self.waypoints.get(first)?, self.waypoints.get(second)?);
        Some(first.pose.inv_mul(&second.pose))
    }

    /// The waypoints that changed after a revision, or whose ways did, and some others.
    pub(crate) fn waypoints_changed(&self, since: u64) -> impl Iterator<Item = u32> {
        let pages = self.waypoints.pages.changed_pages(since);
        let numbers = pages.flat_map(|(_, first, slots)| first..first + slots.len());
        numbers.filter_map(|number| u32::try_from(number).ok())
    }

    /// No way takes less time for each metre of the straight line \[s/m\].
    pub(crate) fn least_s_per_m(&self) -> f64 {
        finite(self.least.s_per_m)
    }

    /// No way adds less variance for each metre of the straight line \[m²/m\].
    pub(crate) fn least_m2_per_m(&self) -> f64 {
        finite(self.least.m2_per_m)
    }

    /// Bytes of memory that it all takes, reserved ones included.
    pub(crate) fn bytes(&self) -> usize {
        let edges = self.waypoints.iter();
        let edges: usize = edges.map(|(_, waypoint)| waypoint.edges.capacity()).sum();
        let slabs = self.ways.pages.bytes() + self.waypoints.pages.bytes();
        edges * size_of::<Edge>() + slabs + self.of_place.bytes() + self.summaries.bytes()
    }

    /// A leg was travelled between places that lie at these poses, the lower number first. There
    /// must be room for one more way where there is none yet.
    pub(crate) fn travel(
        &mut self,
        traversal: &Traversal,
        poses: [&Isometry3<f64>; 2],
        now: Clock,
        revision: u64,
    ) {
        let ends = traversal.ends();
        let made = |waypoints| Way::new(traversal, waypoints, now, revision);
        let known = self.number_between(ends[0], ends[1]);
        let number = known.or_else(|| self.join(ends, poses, revision, made));
        let Some(number) = number else {
            return;
        };
        let places = poses[0].inv_mul(poses[1]);
        if let Some(way) = self.ways.get_mut(number, revision) {
            way.travel(traversal, &places, now, revision);
        }
        self.refresh(number, revision);
        self.summarise(number);
    }

    /// Takes in a way that another map has had. There must be room for one more, and none between
    /// these places.
    pub(crate) fn remember(&mut self, was: &RememberedWay, now: Clock, revision: u64) {
        let made = |waypoints| Way::remembered(was, waypoints, now, revision);
        let poses = was.poses.each_ref();
        if let Some(number) = self.join(was.ends, poses, revision, made) {
            self.refresh(number, revision);
            self.summarise(number);
        }
    }

    /// Makes a way between two waypoints; `None` when there are no more numbers.
    fn join(
        &mut self,
        ends: [PlaceId; 2],
        poses: [&Isometry3<f64>; 2],
        revision: u64,
        made: impl FnOnce([u32; 2]) -> Way,
    ) -> Option<u32> {
        // A way to a new place closes no circle.
        if ends.iter().all(|end| self.at(*end).is_some()) {
            self.is_forest = false;
        }
        let first = self.waypoint_at(ends[0], poses[0], revision)?;
        let second = self.waypoint_at(ends[1], poses[1], revision)?;
        let mut way = made([first, second]);
        way.spared = self.spared_max;
        let number = self.ways.insert(way, revision);
        if number == NONE {
            return None;
        }
        for (at, to, place) in [(first, second, ends[1]), (second, first, ends[0])] {
            let edge = Edge::new(place, to, number);
            if let Some(waypoint) = self.waypoints.get_mut(at, revision)
                && let Err(rank) = waypoint.rank(place)
            {
                waypoint.edges.insert(rank, edge);
            }
        }
        Some(number)
    }

    /// The waypoint of a place, a new one if it has none.
    fn waypoint_at(&mut self, place: PlaceId, pose: &Isometry3<f64>, revision: u64) -> Option<u32> {
        if let Some(number) = self.at(place) {
            return Some(number);
        }
        let waypoint = Waypoint {
            place,
            pose: *pose,
            attachment: None,
            edges: Vec::new(),
        };
        let number = self.waypoints.insert(waypoint, revision);
        if number == NONE {
            return None;
        }
        self.of_place.insert(place.0 as usize, number, revision);
        Some(number)
    }

    /// A place turned out to lie elsewhere.
    pub(crate) fn put(&mut self, place: PlaceId, pose: &Isometry3<f64>, revision: u64) {
        let Some(number) = self.at(place) else { return };
        let Some(waypoint) = self.waypoints.get_mut(number, revision) else {
            return;
        };
        waypoint.pose = *pose;
        let ways: Vec<_> = waypoint.edges.iter().map(|edge| edge.way).collect();
        for way in ways {
            self.refresh(way, revision);
        }
    }

    /// Brings the edges of a way up to date with it and its places.
    fn refresh(&mut self, number: u32, revision: u64) {
        let Some(way) = self.ways.get(number) else {
            return;
        };
        let Some(places) = self.places_of(way) else {
            return;
        };
        let length_um = micrometres(way.length_m(&places));
        self.least.include(way, &places);
        let ends = [0, 1].map(|k| {
            let travelled = way.travelled[k].times() > 0;
            let there = self.waypoints.get(way.waypoints[1 - k]);
            let near = there.map_or([0.0; 3], |there| rounded(&there.pose));
            (way.waypoints[k], way.ends[1 - k], travelled, near)
        });
        for (at, place, travelled, near) in ends {
            if let Some(waypoint) = self.waypoints.get_mut(at, revision)
                && let Ok(rank) = waypoint.rank(place)
            {
                let edge = &mut waypoint.edges[rank];
                (edge.length_um, edge.travelled, edge.near) = (length_um, travelled, near);
            }
        }
    }

    /// Summarises the page of a way anew.
    pub(super) fn summarise(&mut self, number: u32) {
        let page = number as usize / PAGE;
        let first = page * PAGE;
        let slots = (0..).zip(self.ways.pages.iter_from(first).take(PAGE));
        let weakest: Vec<_> = slots
            .filter_map(|(within, slot): (u32, _)| match slot {
                Slot::Taken(way) => {
                    let first = u32::try_from(first).ok()?;
                    Some(Weakest::of(first + within, way))
                }
                Slot::Vacant(_) => None,
            })
            .collect();
        self.summaries.set(page, merged(weakest.iter()));
    }

    /// Whether nothing has ever been travelled.
    pub(crate) fn is_untouched(&self) -> bool {
        self.ways.numbers() == 0
    }

    /// Writes what is not in pages.
    pub(crate) fn write_head(&self, out: &mut StateWriter) {
        let head = Head {
            ways: self.ways.vacancy(),
            waypoints: self.waypoints.vacancy(),
            spared_max: self.spared_max,
            is_forest: self.is_forest,
        };
        head.write(out);
    }

    /// Writes the digests of all pages.
    pub(crate) fn write_digests(&self, out: &mut StateWriter) {
        self.write_head(out);
        self.ways.pages.write_digests(out);
        self.waypoints.pages.write_digests(out);
    }

    /// The pages of ways that changed after a revision.
    pub(crate) fn changed_ways(
        &self,
        since: u64,
    ) -> impl Iterator<Item = (usize, usize, &[Slot<Way>])> {
        self.ways.pages.changed_pages(since)
    }

    /// The pages of waypoints that changed after a revision.
    pub(crate) fn changed_waypoints(
        &self,
        since: u64,
    ) -> impl Iterator<Item = (usize, usize, &[Slot<Waypoint>])> {
        self.waypoints.pages.changed_pages(since)
    }

    /// Appends a checkpoint's page of ways.
    pub(crate) fn push_ways(&mut self, bytes: &[u8], revision: u64) -> Result<(), CorruptState> {
        self.ways.pages.push_page(bytes, revision)
    }

    /// Appends a checkpoint's page of waypoints.
    pub(crate) fn push_waypoints(
        &mut self,
        bytes: &[u8],
        revision: u64,
    ) -> Result<(), CorruptState> {
        self.waypoints.pages.push_page(bytes, revision)
    }

    /// Makes what follows from ways and waypoints, once all have been restored.
    ///
    /// # Errors
    /// They are not those of one map.
    pub(crate) fn restore(&mut self, head: &[u8], revision: u64) -> Result<(), CorruptState> {
        let mut input = StateReader::new(head);
        let head = Head::read(&mut input)?;
        input.end()?;
        self.ways.set_vacancy(head.ways);
        self.waypoints.set_vacancy(head.waypoints);
        (self.spared_max, self.is_forest) = (head.spared_max, head.is_forest);
        if !self.ways.is_sound() || !self.waypoints.is_sound() {
            return Err(CorruptState::Invalid);
        }
        let waypoints: Vec<_> = self.waypoints.iter().map(|(n, w)| (w.place, n)).collect();
        for (place, number) in waypoints {
            if self.at(place).is_some() {
                return Err(CorruptState::Invalid);
            }
            self.of_place.insert(place.0 as usize, number, revision);
        }
        let ways: Vec<_> = self.ways.iter().map(|(n, way)| (n, way.clone())).collect();
        for (number, way) in ways {
            self.restore_edges(number, &way, revision)?;
            self.refresh(number, revision);
            self.summarise(number);
        }
        let lonely = |(_, waypoint): (u32, &Waypoint)| waypoint.edges.is_empty();
        if self.waypoints.iter().any(lonely) {
            return Err(CorruptState::Invalid);
        }
        Ok(())
    }

    /// Makes the edges of a way.
    fn restore_edges(&mut self, way: u32, of: &Way, revision: u64) -> Result<(), CorruptState> {
        for k in [0, 1] {
            let (at, place) = (of.waypoints[k], of.ends[1 - k]);
            let waypoint = self.waypoints.get_mut(at, revision);
            let waypoint = waypoint.filter(|waypoint| waypoint.place == of.ends[k]);
            let waypoint = waypoint.ok_or(CorruptState::Invalid)?;
            let Err(rank) = waypoint.rank(place) else {
                return Err(CorruptState::Invalid);
            };
            let edge = Edge::new(place, of.waypoints[1 - k], way);
            waypoint.edges.insert(rank, edge);
        }
        Ok(())
    }
}

/// A position in single precision.
fn rounded(pose: &Isometry3<f64>) -> [f32; 3] {
    #[expect(clippy::cast_possible_truncation, reason = "rounded on purpose")]
    pose.translation.vector.map(|x| x as f32).into()
}

/// A ratio, or zero where there is none.
fn finite(ratio: f64) -> f64 {
    if ratio.is_finite() { ratio } else { 0.0 }
}

/// A length in whole micrometres, rounded up, one at least.
pub(crate) fn micrometres(length_m: f64) -> u64 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "lengths are not negative, and the cast saturates"
    )]
    let micrometres = (length_m * UM_PER_M).ceil() as u64;
    // Below 2⁴⁰ µm, a thousand kilometres, sums over all ways of a map stay in range.
    micrometres.clamp(1, 1 << 40)
}
