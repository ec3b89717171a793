//! The search for the cheapest route (A*: Hart, Nilsson & Raphael 1968).

use nalgebra::{Point3, Vector3};

use super::bounds::{RouteBounds, Target};
use super::cost::Costs;
use super::frontier::Frontier;
use super::graph::{Graph, Junction, Link};
use super::path::{Hop, Path};
use super::reached::Reached;
use super::{NoRoute, RouteCost, tuning};
use crate::memory::ids::PlaceId;
use crate::memory::way::Edge;

/// What a search has found out so far.
pub(super) struct Search<'a> {
    costs: &'a Costs<'a>,
    /// Whether every edge may be taken and costs its length.
    are_lengths: bool,
    reached: Reached,
    frontier: Frontier,
}

/// A lower bound of the cost from a waypoint to the goal.
struct Bound<'a> {
    goal: Option<u32>,
    /// Least cost for each metre of the straight line, in millionths.
    micro_per_m: f64,
    goal_m: Vector3<f64>,
    target: Option<Target>,
    /// The ways, as bounds know them.
    graph: Option<&'a Graph>,
}

/// What one look at a waypoint tells.
#[derive(Clone, Copy)]
struct Glance<'g> {
    at: &'g Junction,
    /// Lower bound of the distance by the first pivot, in coarse units.
    least: u16,
    is_dead_end: bool,
}

impl Bound<'_> {
    /// That without a goal.
    fn none() -> Self {
        Self {
            goal: None,
            micro_per_m: 0.0,
            goal_m: Vector3::zeros(),
            target: None,
            graph: None,
        }
    }

    /// That from a waypoint, at which one has glanced. Where distances from pivots are known the
    /// straight line adds next to nothing.
    fn from(&self, glance: &Glance<'_>) -> u64 {
        match &self.target {
            Some(target) => target.bound_um(glance.at, glance.least),
            None => self.straight(&glance.at.near),
        }
    }

    /// A first look at a waypoint.
    fn glance<'g>(&self, at: &'g Junction) -> Glance<'g> {
        let least = self.target.as_ref().map_or(0, |target| target.glance(at));
        let is_dead_end = at.is_dead_end();
        Glance {
            at,
            least,
            is_dead_end,
        }
    }

    /// That from where an edge leads.
    fn along(&self, edge: &Edge) -> u64 {
        let junction = self.graph.and_then(|graph| graph.junction(edge.to));
        junction.map_or_else(
            || self.straight(&edge.near),
            |at| self.from(&self.glance(at)),
        )
    }

    /// That by the straight line.
    fn straight(&self, near: &[f32; 3]) -> u64 {
        let near = Vector3::from(near.map(f64::from));
        // Each coordinate is rounded by at most half a bit of its 24.
        let rounding_m = near.abs().sum() * f64::from(f32::EPSILON);
        let straight_m = ((near - self.goal_m).norm() - rounding_m).max(0.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "distances are not negative, and the cast saturates"
        )]
        let straight = (straight_m * self.micro_per_m) as u64;
        straight
    }
}

impl<'a> Search<'a> {
    pub(super) fn new(costs: &'a Costs<'a>) -> Self {
        let numbers = costs.ways.waypoint_numbers() as usize;
        Self {
            costs,
            are_lengths: costs.are_lengths(),
            reached: Reached::new(numbers),
            frontier: Frontier::default(),
        }
    }

    /// Looks for all cheapest routes from one waypoint to another, or to all others; answers their
    /// cost. `gives_up` is asked about once a millisecond.
    pub(super) fn run(
        &mut self,
        start: u32,
        goal: Option<u32>,
        bounds: Option<&RouteBounds>,
        gives_up: &mut dyn FnMut() -> bool,
    ) -> Result<Option<u64>, NoRoute> {
        let bound = goal.map_or_else(Bound::none, |goal| self.bound(goal, bounds));
        let found = |search: &Self| goal.and_then(|goal| search.cost_to(goal));
        self.reached.reach(start, 0);
        self.frontier.push(0, start);
        let mut visited = 0_usize;
        while let Some((least, at)) = self.frontier.pop() {
            if found(self).is_some_and(|found| least > found) {
                break;
            }
            let Some(cost) = self.reached.visit(at) else {
                continue; // it was found by a cheaper way before
            };
            visited += 1;
            if visited.is_multiple_of(tuning::ASK_EVERY) && gives_up() {
                return Err(NoRoute::GivenUp);
            }
            self.expand(at, cost, &bound);
        }
        Ok(found(self))
    }

    /// Goes on from a waypoint.
    fn expand(&mut self, at: u32, cost: u64, bound: &Bound<'_>) {
        if self.are_lengths
            && let Some(graph) = bound.graph
            && let Some(links) = graph.junction(at).and_then(Junction::links)
        {
            return self.expand_along(graph, links, cost, bound);
        }
        let costs = self.costs;
        let Some(waypoint) = costs.ways.waypoint(at) else {
            return;
        };
        for edge in waypoint.edges() {
            let Some(more) = costs.of(waypoint, edge) else {
                continue;
            };
            let there = cost + more;
            if self.reached.reach(edge.to, there) {
                self.frontier.push(there + bound.along(edge), edge.to);
            }
        }
    }

    /// Goes on along links. Most of what a search waits for is what lies far apart in memory. So
    /// where the links lead is glanced at together, and in any case: no branch has to be guessed
    /// before the processor fetches what the bounds need.
    fn expand_along(&mut self, graph: &Graph, links: &[Link], cost: u64, bound: &Bound<'_>) {
        let mut ahead = [None; tuning::LINKS];
        for (ahead, link) in ahead.iter_mut().zip(links) {
            *ahead = graph.junction(link.to).map(|at| bound.glance(at));
        }
        for (link, glance) in links.iter().zip(ahead) {
            let there = cost + u64::from(link.length_um);
            if self.reached.reach(link.to, there)
                && let Some(glance) = glance
                && (!glance.is_dead_end || bound.goal == Some(link.to))
            {
                self.frontier.push(there + bound.from(&glance), link.to);
            }
        }
    }

    /// Cost to a waypoint, as far as it is known.
    fn cost_to(&self, at: u32) -> Option<u64> {
        self.reached.cost(at)
    }

    fn bound<'b>(&self, goal: u32, bounds: Option<&'b RouteBounds>) -> Bound<'b> {
        let ways = self.costs.ways;
        let Some(waypoint) = ways.waypoint(goal) else {
            return Bound::none();
        };
        let cost = self.costs.options.cost;
        // Rounding must not lift a bound above the sum of what was rounded up.
        let micro_per_m = tuning::MICRO * (1.0 - 1e-9);
        let micro_per_m = match cost {
            RouteCost::Length | RouteCost::Recency => micro_per_m,
            RouteCost::Time => micro_per_m * ways.least_s_per_m(),
            RouteCost::Uncertainty => micro_per_m * ways.least_m2_per_m(),
        };
        let along = matches!(cost, RouteCost::Length | RouteCost::Recency);
        let bounds = bounds.filter(|_| along);
        Bound {
            goal: Some(goal),
            micro_per_m,
            goal_m: waypoint.pose().translation.vector,
            target: bounds.and_then(|bounds| bounds.target(goal)),
            graph: bounds.map(RouteBounds::graph),
        }
    }

    /// Of the cheapest routes to the goal, that whose places have the lowest numbers, counted from
    /// the goal: each waypoint of a cheapest route has been visited.
    pub(super) fn path(&self, start: u32, goal: u32, bounds: Option<&RouteBounds>) -> Path {
        let graph = bounds.filter(|_| self.are_lengths).map(RouteBounds::graph);
        let mut numbers = vec![goal];
        let mut at = goal;
        while at != start {
            let links = graph.and_then(|graph| graph.junction(at)?.links());
            let before = match links {
                Some(links) => self.junction_before(at, links),
                None => self.waypoint_before(at),
            };
            let Some(before) = before else {
                break; // never: the goal was reached
            };
            numbers.push(before);
            at = before;
        }
        debug_assert!(at == start, "the route leads back to its start");
        numbers.reverse();
        let ways = self.costs.ways;
        let hops = numbers.windows(2).filter_map(|pair| {
            let mut edges = ways.waypoint(pair[0])?.edges().iter();
            let edge = edges.find(|edge| edge.to == pair[1])?;
            Some((pair[1], Hop::Way(*edge)))
        });
        std::iter::once((start, Hop::Start)).chain(hops).collect()
    }

    /// The waypoint before another one on a shortest route. Lengths are the same in both
    /// directions, and links are in the order of their places.
    fn junction_before(&self, at: u32, links: &[Link]) -> Option<u32> {
        let cost = self.cost_to(at)?;
        let mut links = links.iter();
        let before = links.find(|link| {
            let known = self.cost_to(link.to);
            known.is_some_and(|known| known + u64::from(link.length_um) == cost)
        });
        before.map(|link| link.to)
    }

    /// The waypoint before another one on a cheapest route.
    fn waypoint_before(&self, at: u32) -> Option<u32> {
        let costs = self.costs;
        let (cost, here) = (self.cost_to(at)?, costs.ways.waypoint(at)?);
        here.edges().iter().find_map(|back| {
            let known = self.cost_to(back.to).filter(|known| *known < cost)?;
            let before = costs.ways.waypoint(back.to)?;
            let edge = before.edge_to(here.place())?;
            (known + costs.of(before, edge)? == cost).then_some(back.to)
        })
    }

    /// Of all that was reached, the place nearest to a position, with its distance \[m\].
    pub(super) fn nearest_reached(&self, position: &Point3<f64>) -> Option<(PlaceId, f64)> {
        let distances = self.reached.numbers().filter_map(|number| {
            let waypoint = self.costs.ways.waypoint(number)?;
            let offset = waypoint.pose().translation.vector - position.coords;
            Some((offset.norm(), waypoint.place()))
        });
        let nearest = distances.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        nearest.map(|(distance_m, place)| (place, distance_m))
    }
}
