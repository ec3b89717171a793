//! The search for the cheapest route (A*: Hart, Nilsson & Raphael 1968).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use nalgebra::{Point3, Vector3};

use super::bounds::{RouteBounds, Target};
use super::cost::Costs;
use super::path::{Hop, Path};
use super::{NoRoute, RouteCost, tuning};
use crate::memory::ids::PlaceId;
use crate::memory::way::Edge;

/// What a search has found out so far.
pub(super) struct Search<'a> {
    costs: &'a Costs<'a>,
    /// Of each waypoint twice the cost from the start, plus two, and plus one once it was gone on
    /// from; 0 where no way has been found yet. Zeroed memory costs nothing until it is touched.
    reached: Vec<u64>,
    open: BinaryHeap<Reverse<Open>>,
}

/// A waypoint to go on from: lower bound of a route through it, and its number.
type Open = (u64, u32);

/// A lower bound of the cost from a waypoint to the goal.
struct Bound<'a> {
    /// Least cost for each metre of the straight line, in millionths.
    micro_per_m: f64,
    goal: Vector3<f64>,
    target: Option<Target<'a>>,
}

impl Bound<'_> {
    /// That without a goal.
    fn none() -> Self {
        Self {
            micro_per_m: 0.0,
            goal: Vector3::zeros(),
            target: None,
        }
    }

    /// That from a waypoint that lies near a position. Where distances from pivots are known the
    /// straight line adds next to nothing.
    fn from(&self, number: u32, near: &[f32; 3]) -> u64 {
        if let Some(target) = &self.target {
            return target.bound_um(number);
        }
        let near = Vector3::from(near.map(f64::from));
        // Each coordinate is rounded by at most half a bit of its 24.
        let rounding_m = near.abs().sum() * f64::from(f32::EPSILON);
        let straight_m = ((near - self.goal).norm() - rounding_m).max(0.0);
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
            reached: vec![0; numbers],
            open: BinaryHeap::new(),
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
        self.reach(start, 0, 0);
        let mut visited = 0_usize;
        while let Some(Reverse((least, at))) = self.open.pop() {
            if found(self).is_some_and(|found| least > found) {
                break;
            }
            let reached = &mut self.reached[at as usize];
            if *reached & 1 == 1 {
                continue; // it was found by a cheaper way before
            }
            *reached |= 1;
            let cost = (*reached >> 1) - 1;
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
        let costs = self.costs;
        let Some(waypoint) = costs.ways.waypoint(at) else {
            return;
        };
        for edge in waypoint.edges() {
            let Some(more) = costs.of(waypoint, edge) else {
                continue;
            };
            let there = cost + more;
            if self.cost_to(edge.to).is_none_or(|known| there < known) {
                let least = there + bound.from(edge.to, &edge.near);
                self.reach(edge.to, there, least);
            }
        }
    }

    fn reach(&mut self, at: u32, cost: u64, least: u64) {
        self.reached[at as usize] = (cost + 1) << 1;
        self.open.push(Reverse((least, at)));
    }

    /// Cost to a waypoint, as far as it is known.
    fn cost_to(&self, at: u32) -> Option<u64> {
        (self.reached[at as usize] >> 1).checked_sub(1)
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
        Bound {
            micro_per_m,
            goal: waypoint.pose().translation.vector,
            target: { bounds.filter(|_| along) }.and_then(|bounds| bounds.target(goal)),
        }
    }

    /// Of the cheapest routes to the goal, that whose places have the lowest numbers, counted from
    /// the goal: each waypoint of a cheapest route has been visited.
    pub(super) fn path(&self, start: u32, goal: u32) -> Path {
        let (costs, mut at) = (self.costs, goal);
        let mut path = Vec::new();
        while at != start {
            let Some((before, edge)) = self.step_before(at) else {
                break; // never: the goal was reached
            };
            path.push((at, Hop::Way(edge)));
            at = before;
        }
        debug_assert!(at == start, "the route leads back to its start");
        debug_assert!(
            costs.ways.waypoint(start).is_some(),
            "ways lead to the start"
        );
        path.push((start, Hop::Start));
        path.reverse();
        path
    }

    /// The waypoint before another one on a cheapest route, and the edge between them.
    fn step_before(&self, at: u32) -> Option<(u32, Edge)> {
        let costs = self.costs;
        let (cost, here) = (self.cost_to(at)?, costs.ways.waypoint(at)?);
        here.edges().iter().find_map(|back| {
            let before = costs.ways.waypoint(back.to)?;
            let edge = before.edge_to(here.place())?;
            let through = self.cost_to(back.to)? + costs.of(before, edge)?;
            (through == cost).then_some((back.to, *edge))
        })
    }

    /// Of all that was reached, the place nearest to a position, with its distance \[m\].
    pub(super) fn nearest_reached(&self, position: &Point3<f64>) -> Option<(PlaceId, f64)> {
        let reached = (0..).zip(&self.reached).filter(|(_, cost)| **cost > 0);
        let distances = reached.filter_map(|(number, _): (u32, _)| {
            let waypoint = self.costs.ways.waypoint(number)?;
            let offset = waypoint.pose().translation.vector - position.coords;
            Some((offset.norm(), waypoint.place()))
        });
        let nearest = distances.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        nearest.map(|(distance_m, place)| (place, distance_m))
    }
}
