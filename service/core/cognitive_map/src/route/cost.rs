//! What a way costs.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::options::{Reverse, RouteCost, RouteOptions};
use super::path::Path;
use super::tuning;
use crate::memory::blockage::Blockage;
use crate::memory::way::{Edge, Way, WayMap, Waypoint};

/// What the ways cost, for one search.
#[derive(Debug)]
pub(super) struct Costs<'a> {
    pub(super) ways: &'a WayMap,
    pub(super) options: &'a RouteOptions,
    pub(super) revision: u64,
    pub(super) half_life: f64,
    /// How often ways were taken by the routes before.
    pub(super) penalties: BTreeMap<u32, u64>,
    /// What is blocked.
    pub(super) blockages: &'a [Blockage],
}

impl Costs<'_> {
    /// What an edge costs in millionths of the unit, one at least; `None` where it is not to be
    /// taken.
    pub(super) fn of(&self, from: &Waypoint, edge: &Edge) -> Option<u64> {
        let cost = self.plain(from, edge)?;
        if self.penalties.is_empty() {
            return Some(cost);
        }
        let taken = self.penalties.get(&edge.way).copied().unwrap_or(0);
        Some(cost + cost * tuning::PENALTY_PERCENT * taken / 100)
    }

    /// Whether every edge may be taken and costs its length.
    pub(super) fn are_lengths(&self) -> bool {
        let options = self.options;
        options.cost == RouteCost::Length
            && options.reverse == Reverse::Allowed
            && options.avoid_places.is_empty()
            && options.avoid_regions.is_empty()
            && self.penalties.is_empty()
            && self.blockages.is_empty()
    }

    /// What an edge costs without penalties.
    fn plain(&self, from: &Waypoint, edge: &Edge) -> Option<u64> {
        let options = self.options;
        if !edge.travelled && options.reverse == Reverse::Never {
            return None;
        }
        if !options.avoid_places.is_empty() && options.avoid_places.contains(&edge.place) {
            return None;
        }
        if !options.avoid_regions.is_empty() && self.leads_into_region(from, edge) {
            return None;
        }
        if !self.blockages.is_empty() && self.blocked(from, edge).next().is_some() {
            return None;
        }
        Some(match options.cost {
            RouteCost::Length => edge.length_um,
            RouteCost::Time => micro(duration_s(self.ways.way(edge.way)?, from)),
            RouteCost::Uncertainty => micro(self.ways.way(edge.way)?.position_variance_m2()),
            RouteCost::Recency => {
                let way = self.ways.way(edge.way)?;
                let age = self.revision.saturating_sub(way.last_revision()) as f64;
                let half_lives = (age / self.half_life).min(tuning::HALF_LIVES_MAX);
                times(edge.length_um, half_lives.exp2())
            }
        })
    }

    /// What a path costs without penalties.
    pub(super) fn without_penalties(&self, path: &Path) -> u64 {
        let edges = path.windows(2).filter_map(|pair| {
            let from = self.ways.waypoint(pair[0].0)?;
            self.plain(from, pair[1].1.edge()?)
        });
        edges.sum()
    }

    /// The blockages of an edge.
    pub(super) fn blocked(&self, from: &Waypoint, edge: &Edge) -> impl Iterator<Item = &Blockage> {
        let to = self.ways.waypoint(edge.to);
        let at = |end: &Waypoint| Point3::from(end.pose().translation.vector);
        let ends = to.map(|to| [(from.place(), at(from)), (to.place(), at(to))]);
        self.blockages.iter().filter(move |blockage| {
            ends.is_none_or(|[(from, from_m), (to, to_m)]| {
                blockage.blocked.blocks((from, &from_m), (to, &to_m))
            })
        })
    }

    fn leads_into_region(&self, from: &Waypoint, edge: &Edge) -> bool {
        let Some(to) = self.ways.waypoint(edge.to) else {
            return true;
        };
        let ends = [from, to].map(|end| end.pose().translation.vector.into());
        let mut regions = self.options.avoid_regions.iter();
        // One may leave a region in which the route starts.
        regions.any(|region| !region.contains(&ends[0]) && region.meets(&ends[0], &ends[1]))
    }
}

/// How long a way takes from one of its ends \[s\]: the mean, in the other direction where there is
/// none in this one.
pub(super) fn duration_s(way: &Way, from: &Waypoint) -> f64 {
    let there = way.travelled_from(from.place());
    let back = way.travelled_from(way.other_end(from.place()));
    there.mean_s().or(back.mean_s()).unwrap_or(0.0)
}

/// A quantity in whole millionths of its unit, rounded up, one at least.
fn micro(quantity: f64) -> u64 {
    times(1, quantity * tuning::MICRO)
}

/// A product, rounded up, at least the first factor's unit and at most 2⁴⁰.
fn times(whole: u64, factor: f64) -> u64 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "costs are not negative, and the cast saturates"
    )]
    let product = (whole as f64 * factor).ceil() as u64;
    product.clamp(1, 1 << 40)
}
