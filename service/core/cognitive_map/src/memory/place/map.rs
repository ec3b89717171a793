//! The places of a space and the way to the nearest of them.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Isometry3, Point3, Vector3};

use super::Place;
use super::code_search::CodeSearch;
use super::index::SpatialIndex;
use super::summary::PlaceSummary;
use crate::memory::ids::{PlaceId, TripId};
use crate::memory::strength::Clock;
use crate::settings::Settings;
use grid::{GridModules, PartialCode, Search};
use state::CorruptState;
use state::SparseVec;
use state::{Summary, SummaryTree, merged};

/// Places per page: small enough to copy one for each change after a snapshot.
const PAGE: usize = 64;
/// A place answers up to this distance, in field radii; its confidence is 1/16 there.
const REACH_IN_FIELD_RADII: f64 = 2.0;

/// All places, in the order of recruitment.
#[derive(Clone, Debug)]
pub(crate) struct PlaceMap {
    places: SparseVec<Place, PAGE>,
    index: SpatialIndex,
    reach_m: f64,
    code_search: CodeSearch,
    /// Of the places page by page.
    summaries: SummaryTree<PlaceSummary>,
    /// How many agents hold a place, where any does: at most two places for each agent. Some may
    /// have been forgotten since.
    held: Arc<BTreeMap<PlaceId, u32>>,
}

impl PlaceMap {
    /// No places yet.
    pub(crate) fn new(settings: &Settings) -> Self {
        let reach_m = REACH_IN_FIELD_RADII * settings.field_radius_m;
        Self {
            places: SparseVec::default(),
            index: SpatialIndex::new(reach_m),
            reach_m,
            code_search: CodeSearch::new(settings),
            summaries: SummaryTree::default(),
            held: Arc::default(),
        }
    }

    /// The places by identifier.
    pub(crate) fn places(&self) -> &SparseVec<Place, PAGE> {
        &self.places
    }

    /// A place.
    pub(crate) fn get(&self, place: PlaceId) -> Option<&Place> {
        self.places.get(place.0 as usize)
    }

    /// Number of places.
    pub(crate) fn len(&self) -> usize {
        self.places.len()
    }

    /// Whether there was such a place that has been forgotten.
    pub(crate) fn is_forgotten(&self, place: PlaceId) -> bool {
        (place.0 as usize) < self.places.next_index() && self.get(place).is_none()
    }

    /// Whether there is an identifier for one more place: 2³² have not been given out.
    pub(crate) fn has_identifiers(&self) -> bool {
        u32::try_from(self.places.next_index()).is_ok()
    }

    /// Adds a place. None when there have been 2³² already.
    pub(crate) fn recruit(&mut self, place: Place, revision: u64) -> Option<PlaceId> {
        let id = PlaceId(u32::try_from(self.places.next_index()).ok()?);
        let alone = PlaceSummary::of(id, &place, false);
        self.index.insert(id, place.position());
        self.places.push(place, revision);
        self.include(id, &alone);
        self.code_search
            .fit(self.summaries.of_all().map(|all| all.extent));
        Some(id)
    }

    /// The weakest place that no agent holds, the lowest identifier of equally weak ones.
    pub(crate) fn weakest(&self) -> Option<PlaceId> {
        self.summaries.of_all()?.weakest.map(|(_, id)| id)
    }

    /// The weakest place that some agent holds, without `except`, the lowest identifier of equally
    /// weak ones. Looks at all that are held.
    pub(crate) fn weakest_held(&self, except: [Option<PlaceId>; 2]) -> Option<PlaceId> {
        let held = self.held.keys().copied();
        let held = held.filter(|id| !except.contains(&Some(*id)));
        let strengths = held.filter_map(|id| Some((self.get(id)?.strength, id)));
        let weakest = strengths.min_by(|a, b| a.0.cmp(b.0).then(a.1.cmp(&b.1)));
        weakest.map(|(_, id)| id)
    }

    /// Removes a place. Agents that hold it will notice.
    pub(crate) fn forget(&mut self, id: PlaceId, revision: u64) -> Option<Place> {
        let place = self.places.remove(id.0 as usize, revision)?;
        self.index.remove(id, place.position());
        self.summarise(id);
        self.code_search
            .fit(self.summaries.of_all().map(|all| all.extent));
        Some(place)
    }

    /// An agent holds a place: it cannot be the weakest until all who hold it have released it.
    pub(crate) fn hold(&mut self, place: PlaceId) {
        let holders = Arc::make_mut(&mut self.held).entry(place).or_default();
        *holders += 1;
        if *holders == 1 && self.is_weakest_of_page(place) {
            self.summarise(place);
        }
    }

    /// An agent releases a place that it holds.
    pub(crate) fn release(&mut self, id: PlaceId) {
        let held = Arc::make_mut(&mut self.held);
        match held.get_mut(&id) {
            Some(holders) if *holders > 1 => *holders -= 1,
            Some(_) => {
                held.remove(&id);
                if let Some(place) = self.get(id) {
                    let alone = PlaceSummary::of(id, place, false);
                    self.include(id, &alone);
                }
            }
            None => {}
        }
    }

    /// Bytes of memory that the places and what finds them take, reserved ones included.
    pub(crate) fn bytes(&self) -> usize {
        self.places.bytes() + self.index.bytes() + self.summaries.bytes()
    }

    /// An agent came to a place.
    pub(crate) fn visit(&mut self, id: PlaceId, stamp_ns: i64, now: Clock, revision: u64) {
        if let Some(place) = self.places.get_mut(id.0 as usize, revision) {
            place.visit(stamp_ns, now);
            // A use makes stronger, so nothing changes but for the weakest.
            if self.is_weakest_of_page(id) {
                self.summarise(id);
            }
        }
    }

    /// Notes the trip that leads through a place.
    pub(crate) fn set_trip(&mut self, id: PlaceId, trip: TripId, revision: u64) {
        if let Some(place) = self.places.get_mut(id.0 as usize, revision) {
            place.trip = Some(trip);
        }
    }

    /// Notes by what a place goes with the past of its founder.
    pub(crate) fn set_attachment(&mut self, id: PlaceId, attachment: u32, revision: u64) {
        if let Some(place) = self.places.get_mut(id.0 as usize, revision) {
            place.attachment = Some(attachment);
        }
    }

    /// A place turned out to lie elsewhere.
    pub(crate) fn put(&mut self, id: PlaceId, at: &Isometry3<f64>, revision: u64) {
        let Some(moved) = self.get(id).and_then(|place| place.moved(at)) else {
            return;
        };
        if let Some(place) = self.places.get_mut(id.0 as usize, revision) {
            self.index.remove(id, &place.position);
            self.index.insert(id, &moved.position);
            *place = moved;
        }
        self.summarise(id);
        self.code_search
            .fit(self.summaries.of_all().map(|all| all.extent));
    }

    /// Whether a place is the weakest of its page.
    fn is_weakest_of_page(&self, id: PlaceId) -> bool {
        let page = self.summaries.of_group(id.0 as usize / PAGE);
        page.is_some_and(|page| page.weakest.is_some_and(|(_, weakest)| weakest == id))
    }

    /// A place of a page is added to the page's summary.
    fn include(&mut self, id: PlaceId, alone: &PlaceSummary) {
        let page = id.0 as usize / PAGE;
        let mut summary = self.summaries.of_group(page).unwrap_or(alone).clone();
        summary.merge(alone);
        self.summaries.set(page, Some(summary));
    }

    /// Summarises the page of a place anew.
    fn summarise(&mut self, id: PlaceId) {
        let page = id.0 as usize / PAGE;
        let places = numbered(self.places.iter_page(page));
        let summaries: Vec<_> = places
            .map(|(id, place)| PlaceSummary::of(id, place, self.held.contains_key(&id)))
            .collect();
        self.summaries.set(page, merged(summaries.iter()));
    }

    /// Extent of the box about all places along each axis \[m\].
    pub(crate) fn extent_m(&self) -> Vector3<f64> {
        let all = self.summaries.of_all();
        all.map_or_else(Vector3::zeros, |all| all.extent.edges_m())
    }

    /// A place answers up to this distance \[m\].
    pub(crate) fn reach_m(&self) -> f64 {
        self.reach_m
    }

    /// The place that answers strongest at a position, with its distance \[m\]: the nearest one
    /// within two field radii, the lowest id of equally near ones.
    ///
    /// This is the exact arg max of the codes' cosine (seed Eq. 6) in the limit of many cells:
    /// there the cosine of two codes of the same reference grid point falls with the distance
    /// between them, so the most similar place is the nearest one.
    pub(crate) fn winner(&self, position: &Point3<f64>) -> Option<(PlaceId, f64)> {
        let mut best: Option<(f64, PlaceId)> = None;
        let mut limit = self.reach_m * self.reach_m;
        self.index.search(position, limit, |place| {
            let squared = self.squared(place, position);
            if squared <= limit && best.is_none_or(|best| (squared, place) < best) {
                best = Some((squared, place));
                limit = squared;
            }
            limit
        });
        best.map(|(squared, place)| (place, squared.sqrt()))
    }

    /// Calls `visit` with every place, perhaps more than once, whose code is within tolerance of a
    /// code:
    ///
    /// ```text
    /// Σ over known m of dₘ² ≤ tolerance        dₘ torus distance in spacings
    /// ```
    ///
    /// and with some others. `visit` returns the tolerance for what is left, which must not grow.
    /// See [`grid::PositionSearch::run`]. When the search is given up, some places have been
    /// visited and others not.
    pub(crate) fn matching(
        &self,
        modules: &GridModules,
        code: &PartialCode,
        tolerance: f64,
        steps_max: u64,
        mut visit: impl FnMut(PlaceId) -> f64,
    ) -> Search {
        let mut searched = true;
        let search = self
            .code_search
            .run(modules, code, tolerance, steps_max, |ball| {
                let mut left = ball.tolerance;
                let squared = ball.squared_radius_m2(left);
                if squared >= 0.0 {
                    searched &= self.index.search(&ball.centre, squared, |place| {
                        left = visit(place).min(left);
                        ball.squared_radius_m2(left)
                    });
                }
                left
            });
        if searched { search } else { Search::GivenUp }
    }

    /// The place nearest to a position, however far, with its distance \[m\].
    pub(crate) fn nearest(&self, position: &Point3<f64>) -> Option<(PlaceId, f64)> {
        self.winner(position).or_else(|| {
            let all = self.ids().map(|id| (self.squared(id, position), id));
            let nearest = all.min_by(|a, b| a.0.total_cmp(&b.0));
            nearest.map(|(squared, id)| (id, squared.sqrt()))
        })
    }

    /// The places within a distance of a position, with their distances \[m\], in no particular
    /// order.
    pub(crate) fn within(&self, position: &Point3<f64>, radius_m: f64) -> Vec<(PlaceId, f64)> {
        let mut found = Vec::new();
        let mut check = |id| {
            let squared: f64 = self.squared(id, position);
            if squared <= radius_m * radius_m {
                found.push((id, squared.sqrt()));
            }
        };
        let limit = radius_m * radius_m;
        let searched = self.index.search(position, limit, |place| {
            check(place);
            limit
        });
        if searched {
            found.sort_unstable_by_key(|(place, _)| *place);
            found.dedup_by_key(|(place, _)| *place);
        } else {
            self.ids().for_each(&mut check);
        }
        found
    }

    /// The places, in the order of recruitment.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (PlaceId, &Place)> {
        self.iter_from(PlaceId(0))
    }

    /// The places from an identifier on, in the order of recruitment.
    pub(crate) fn iter_from(&self, first: PlaceId) -> impl Iterator<Item = (PlaceId, &Place)> {
        numbered(self.places.iter_from(first.0 as usize))
    }

    /// All identifiers.
    pub(crate) fn ids(&self) -> impl Iterator<Item = PlaceId> {
        self.iter().map(|(id, _)| id)
    }

    /// Identifiers of the pages in which a place was recruited, changed or forgotten after a
    /// revision, in order: those of forgotten places and of places that did not change among them.
    pub(crate) fn ids_near_changes(&self, since: u64) -> impl Iterator<Item = PlaceId> {
        let next = self.places.next_index();
        let pages = self.places.changed_pages(since);
        let ids = pages.flat_map(move |(page, _)| page * PAGE..next.min((page + 1) * PAGE));
        ids.map(|id| PlaceId(u32::try_from(id).expect("identifiers are given out as 32 bits")))
    }

    /// Squared distance of a place from a position \[m²\].
    fn squared(&self, place: PlaceId, position: &Point3<f64>) -> f64 {
        self.get(place).map_or(f64::INFINITY, |place| {
            (place.position() - position).norm_squared()
        })
    }

    /// Adds a checkpoint's page of places.
    pub(crate) fn restore_page(
        &mut self,
        page: usize,
        bytes: &[u8],
        revision: u64,
    ) -> Result<(), CorruptState> {
        if u32::try_from(page * PAGE + PAGE - 1).is_err() {
            return Err(CorruptState::Invalid);
        }
        self.places.restore_page(page, bytes, revision)?;
        for (id, place) in numbered(self.places.iter_page(page)) {
            self.index.insert(id, place.position());
        }
        self.summarise(PlaceId(u32::try_from(page * PAGE).expect("checked above")));
        self.code_search
            .fit(self.summaries.of_all().map(|all| all.extent));
        Ok(())
    }

    /// Sets how many places there have been; fewer than there are have no effect.
    pub(crate) fn skip_to(&mut self, recruited: usize) {
        self.places.skip_to(recruited);
    }
}

/// Places by identifier, which fits by construction.
fn numbered<'a>(
    places: impl Iterator<Item = (usize, &'a Place)>,
) -> impl Iterator<Item = (PlaceId, &'a Place)> {
    places.map(|(index, place)| {
        let id = u32::try_from(index).expect("identifiers are given out as 32 bits");
        (PlaceId(id), place)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::AgentId;
    use nalgebra::{UnitQuaternion, Vector3};
    use proptest::prelude::*;

    fn founded(position: Point3<f64>, revision: u64) -> Place {
        let now = Clock::at(revision, &Settings::default());
        let rotation = UnitQuaternion::identity();
        Place::found(position, rotation, Vector3::zeros(), AgentId(0), 0, now)
    }

    fn map_of(positions: &[Point3<f64>]) -> PlaceMap {
        let mut map = PlaceMap::new(&Settings::default());
        for &position in positions {
            map.recruit(founded(position, 0), 1).unwrap();
        }
        map
    }

    /// Coordinates on a coarse lattice, so that equal distances occur, or anywhere; near the origin
    /// or far away from it.
    fn coordinate() -> impl Strategy<Value = f64> {
        let near = prop_oneof![(-12i32..12).prop_map(|x| f64::from(x) * 0.125), -3.0..3.0];
        (near, prop::sample::select(vec![0.0, 0.0, 0.0, 1e8])).prop_map(|(x, far)| x + far)
    }

    fn point() -> impl Strategy<Value = Point3<f64>> {
        (coordinate(), coordinate(), coordinate()).prop_map(|(x, y, z)| Point3::new(x, y, z))
    }

    proptest! {
        #[test]
        fn equals_the_exhaustive_scan(
            positions in prop::collection::vec(point(), 0..150),
            query in point(),
            radius_m in 0.0..4.0f64,
        ) {
            let map = map_of(&positions);
            let distance = |position: &Point3<f64>| (position - query).norm();
            // By squares: far away the roots of different squares may be equal.
            let squared = |position: &Point3<f64>| (position - query).norm_squared();
            let nearest = (0u32..).zip(&positions).map(|(id, p)| (squared(p), PlaceId(id)));
            let nearest = nearest.min_by(|a, b| a.partial_cmp(b).unwrap());
            let nearest = nearest.map(|(squared, id)| (id, squared.sqrt()));
            prop_assert_eq!(map.nearest(&query), nearest);
            prop_assert_eq!(map.winner(&query), nearest.filter(|(_, d)| *d <= 0.5));

            let mut within = map.within(&query, radius_m);
            within.sort_by_key(|(id, _)| *id);
            let all = (0u32..).zip(&positions).map(|(id, p)| (PlaceId(id), distance(p)));
            prop_assert_eq!(within, all.filter(|(_, d)| *d <= radius_m).collect::<Vec<_>>());
        }

        /// Of all places only those of even numbers stay, and then everything is asked again; those
        /// that are held never count as the weakest.
        #[test]
        fn forgotten_places_answer_nothing(
            positions in prop::collection::vec(point(), 1..150),
            held in prop::collection::vec(0u32..150, 0..20),
            query in point(),
        ) {
            let mut map = map_of(&positions);
            for id in &held {
                map.hold(PlaceId(*id));
            }
            let all: Vec<_> = map.ids().collect();
            for id in all.iter().filter(|id| id.0 % 2 == 1) {
                let forgotten = map.forget(*id, 2).unwrap();
                prop_assert_eq!(forgotten.position(), &positions[id.0 as usize]);
                prop_assert!(map.forget(*id, 2).is_none() && map.is_forgotten(*id));
            }
            let left: Vec<_> = all.into_iter().filter(|id| id.0 % 2 == 0).collect();
            prop_assert_eq!(map.ids().collect::<Vec<_>>(), left.clone());
            let squared = |id: PlaceId| (positions[id.0 as usize] - query).norm_squared();
            let nearest = left.iter().map(|id| (squared(*id), *id));
            let nearest = nearest.min_by(|a, b| a.partial_cmp(b).unwrap());
            let nearest = nearest.map(|(squared, id)| (id, squared.sqrt()));
            prop_assert_eq!(map.nearest(&query), nearest);
            prop_assert_eq!(map.winner(&query), nearest.filter(|(_, d)| *d <= 0.5));
            // All are equally strong.
            let free = left.iter().copied().find(|id| !held.contains(&id.0));
            prop_assert_eq!(map.weakest(), free);
            for id in &held {
                map.release(PlaceId(*id));
            }
            prop_assert_eq!(map.weakest(), left.first().copied());
            map.visit(PlaceId(0), 0, Clock::at(1, &Settings::default()), 3);
            let second = left.get(1).or(left.first()).copied();
            prop_assert_eq!(map.weakest(), second);
        }

        #[test]
        fn a_snapshot_keeps_its_places(
            positions in prop::collection::vec(point(), 1..100),
            later in prop::collection::vec(point(), 1..100),
        ) {
            let mut map = map_of(&positions);
            let snapshot = map.clone();
            for position in &later {
                map.recruit(founded(*position, 0), 2).unwrap();
            }
            let near = snapshot.within(&positions[0], 1e3);
            prop_assert!(near.iter().all(|(id, _)| (id.0 as usize) < positions.len()));
            prop_assert_eq!(map.places().len(), positions.len() + later.len());
        }
    }

    #[test]
    fn absurd_positions_are_no_harm() {
        let far = [f64::MAX, -f64::MAX, 1e300, f64::INFINITY, f64::NAN];
        let positions: Vec<_> = far.into_iter().map(|x| Point3::new(x, 0.0, -x)).collect();
        let map = map_of(&positions);
        for position in &positions {
            map.winner(position);
            map.within(position, 1.0);
            map.within(position, f64::INFINITY);
        }
    }
}
