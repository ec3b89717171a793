//! The cheapest route, and others that go elsewhere.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Point3;

use super::cost::Costs;
use super::path::Path;
use super::search::Search;
use super::shortcut::Corridor;
use super::{NoRoute, Route, RouteBounds, RouteCost, RouteEnd, RouteOptions, tuning};
use crate::fold::CognitiveMap;
use crate::memory::blockage::BlockageId;

/// A route that was found, with its cost.
struct Found {
    path: Path,
    cost: u64,
}

/// What is asked for.
struct Question<'a> {
    start: u32,
    goal: u32,
    bounds: Option<&'a RouteBounds>,
}

impl CognitiveMap {
    /// The cheapest route from one end to another, and then up to as many others as the options
    /// ask for, the cheaper ones first; each shares at most half its length with any other before.
    ///
    /// The search is led by the straight line to the goal, and by `bounds` of this map where there
    /// are some; they do not change the answer. `gives_up` is asked about once a millisecond.
    ///
    /// # Errors
    /// No way leads there, or the search was given up.
    pub fn routes(
        &self,
        from: &RouteEnd,
        to: &RouteEnd,
        options: &RouteOptions,
        bounds: Option<&RouteBounds>,
        gives_up: &mut dyn FnMut() -> bool,
    ) -> Result<Vec<Route>, NoRoute> {
        let mut costs = self.costs(options);
        if from.place == to.place {
            return Ok(vec![self.route_along(&Vec::new(), 0, from, to)]);
        }
        let ends = self.ways.at(from.place).zip(self.ways.at(to.place));
        let Some((start, goal)) = ends else {
            return Err(self.nearest_reachable(&costs, from, to, gives_up));
        };
        let bounds = bounds.filter(|bounds| bounds.revision() == self.revision());
        let question = Question {
            start,
            goal,
            bounds,
        };
        let Some(first) = question.answer(&costs, gives_up)? else {
            return Err(self.nearest_reachable(&costs, from, to, gives_up));
        };
        let mut found = vec![first];
        question.find_others(&mut costs, &mut found, gives_up)?;
        if let Some(radius_m) = options.shortcuts_within_m {
            let mut corridor = Corridor::new(self, radius_m, &options.avoid_regions);
            corridor.keep_clear_of(costs.blockages);
            for route in &mut found {
                route.path = corridor.shorten(&route.path, gives_up);
                if options.cost == RouteCost::Length {
                    route.cost = corridor.length_um(&route.path);
                }
            }
        }
        let routes = { found.iter() }.map(|f| self.route_along(&f.path, f.cost, from, to));
        Ok(routes.collect())
    }

    /// What ways cost, as the options have it.
    pub(super) fn costs<'a>(&'a self, options: &'a RouteOptions) -> Costs<'a> {
        Costs {
            ways: &self.ways,
            options,
            revision: self.revision(),
            half_life: f64::from(self.settings().strength_half_life_samples),
            penalties: BTreeMap::new(),
            blockages: self.blockages(),
        }
    }

    /// The cheapest path between two waypoints, with its cost.
    pub(super) fn cheapest_path(
        &self,
        costs: &Costs<'_>,
        [start, goal]: [u32; 2],
        bounds: Option<&RouteBounds>,
        gives_up: &mut dyn FnMut() -> bool,
    ) -> Result<Option<(Path, u64)>, NoRoute> {
        let bounds = bounds.filter(|bounds| bounds.revision() == self.revision());
        let question = Question {
            start,
            goal,
            bounds,
        };
        let found = question.answer(costs, gives_up)?;
        Ok(found.map(|found| (found.path, found.cost)))
    }

    /// The blockages on the way that would lead from one end to another without any.
    fn blockages_between(
        &self,
        costs: &Costs<'_>,
        from: &RouteEnd,
        to: &RouteEnd,
        gives_up: &mut dyn FnMut() -> bool,
    ) -> Result<Vec<BlockageId>, NoRoute> {
        let ends = self.ways.at(from.place).zip(self.ways.at(to.place));
        let Some((start, goal)) = ends.filter(|_| !costs.blockages.is_empty()) else {
            return Ok(Vec::new());
        };
        let free = Costs {
            blockages: &[],
            ..self.costs(costs.options)
        };
        let path = self.cheapest_path(&free, [start, goal], None, gives_up)?;
        let path = path.map(|(path, _)| path).unwrap_or_default();
        let mut blockages = BTreeSet::new();
        for pair in path.windows(2) {
            if let (Some(before), Some(edge)) = (self.ways.waypoint(pair[0].0), pair[1].1.edge()) {
                blockages.extend(costs.blocked(before, edge).map(|blockage| blockage.id));
            }
        }
        Ok(blockages.into_iter().collect())
    }

    /// That there is no way, with the place nearest to the goal to which there is one.
    pub(super) fn nearest_reachable(
        &self,
        costs: &Costs<'_>,
        from: &RouteEnd,
        to: &RouteEnd,
        gives_up: &mut dyn FnMut() -> bool,
    ) -> NoRoute {
        let goal = self.position_of(to);
        let start = (from.place, (self.position_of(from) - goal).norm());
        let blockages = match self.blockages_between(costs, from, to, gives_up) {
            Ok(blockages) => blockages,
            Err(given_up) => return given_up,
        };
        let Some(number) = self.ways.at(from.place) else {
            return NoRoute::NoWay {
                nearest: start,
                blockages,
            };
        };
        let mut search = Search::new(costs);
        if let Err(given_up) = search.run(number, None, None, gives_up) {
            return given_up;
        }
        let nearest = search.nearest_reached(&goal).unwrap_or(start);
        NoRoute::NoWay { nearest, blockages }
    }

    /// Where an end is in `map`.
    pub(super) fn position_of(&self, end: &RouteEnd) -> Point3<f64> {
        let place = self.place(end.place).map(|place| *place.position());
        let waypoint = || Some(self.waypoint(end.place)?.pose().translation.vector.into());
        { end.position.or(place) }
            .or_else(waypoint)
            .unwrap_or_default()
    }
}

impl Question<'_> {
    fn answer(
        &self,
        costs: &Costs<'_>,
        gives_up: &mut dyn FnMut() -> bool,
    ) -> Result<Option<Found>, NoRoute> {
        let mut search = Search::new(costs);
        let goal = Some(self.goal);
        let found = search.run(self.start, goal, self.bounds, gives_up)?;
        Ok(found.map(|cost| Found {
            path: search.path(self.start, self.goal, self.bounds),
            cost,
        }))
    }

    /// Looks for other routes by making dearer what those before lead along.
    fn find_others(
        &self,
        costs: &mut Costs<'_>,
        found: &mut Vec<Found>,
        gives_up: &mut dyn FnMut() -> bool,
    ) -> Result<(), NoRoute> {
        let wanted = 1 + costs.options.alternatives;
        let trials = costs.options.alternatives * tuning::TRIALS_PER_ALTERNATIVE;
        let mut latest = found[0].path.clone();
        for _ in 0..trials {
            if found.len() == wanted {
                break;
            }
            for edge in latest.iter().filter_map(|(_, hop)| hop.edge()) {
                *costs.penalties.entry(edge.way).or_default() += 1;
            }
            let Some(other) = self.answer(costs, gives_up)? else {
                break;
            };
            latest = other.path;
            let cost = costs.without_penalties(&latest);
            let path = latest.clone();
            insert_unless_alike(found, Found { path, cost });
        }
        Ok(())
    }
}

/// Puts an alternative among those found, which are in the order of their costs but for the
/// first, unless it or a dearer one would have too much in common with one before. Of equally
/// cheap ones that found first comes first.
fn insert_unless_alike(found: &mut Vec<Found>, other: Found) {
    let rank = 1 + found[1..].partition_point(|known| known.cost <= other.cost);
    let (cheaper, dearer) = found.split_at(rank);
    let alike =
        { cheaper.iter() }.any(|known| is_alike(&other.path, &known.path)) || { dearer.iter() }
            .any(|known| is_alike(&known.path, &other.path));
    if !alike {
        found.insert(rank, other);
    }
}

/// Whether a path has too much of its length in common with another one.
fn is_alike(path: &Path, other: &Path) -> bool {
    let taken: BTreeSet<_> = other
        .iter()
        .filter_map(|(_, hop)| Some(hop.edge()?.way))
        .collect();
    let (mut length, mut shared) = (0, 0);
    for edge in path.iter().filter_map(|(_, hop)| hop.edge()) {
        length += edge.length_um;
        shared += if taken.contains(&edge.way) {
            edge.length_um
        } else {
            0
        };
    }
    shared as f64 > tuning::SHARED_MAX * length as f64
}
