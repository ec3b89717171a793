//! Where a surface goes on beyond what was felt of it.

use std::f64::consts::PI;

use nalgebra::Point3;

use super::graph::LinkGraph;
use super::plane::plane_normal;
use super::spread::Spread;
use super::tuning::{
    BETWEEN_MIN, ENTRIES_MAX, ENTRY_REACH, EXPLORED_REACH, MISSING_PER_KNOWN, PARTIAL_PRIOR,
    STAY_PER_MISSING, UNEXPECTED_SHARE, UNEXPLORED_MIN,
};
use crate::index::nearest_place::NearestPlace;
use crate::tuning::{EVEN_SHARE_MIN, FIELD_PER_SPACING, NODE_STEP};

/// The part of space of which a model knows little: beyond the edge of what was felt, and in the
/// gaps between what was felt.
#[derive(Clone, Debug)]
pub(crate) struct OpenRegion {
    felt: Vec<FeltPlace>,
    /// Whether all places are at the edge of what was felt.
    is_edge_everywhere: bool,
    nearest: NearestPlace,
    /// The places and nodes about the edge of what was felt.
    entries: Vec<u32>,
    /// Whether what is missing are holes in a surface that is known about them.
    pub(crate) has_holes: bool,
    /// Typical distance of places \[m\].
    typical_m: f64,
    /// Share of contacts in a gap that are not as predicted there.
    pub(crate) unexpected: f64,
    /// Probability that a contact is with what was not felt; 0 where next to nothing is missing.
    pub(crate) unexplored: f64,
    /// Length of what was felt, or the side of a square as large \[m\].
    known_m: f64,
    /// The same of what is missing \[m\].
    missing_m: f64,
    /// How much is missing, per what was felt.
    missing_odds: f64,
}

/// Part of space, as far as a model tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// Beside a place that was felt.
    Known,
    /// In a gap between places: what lies there is predicted, and may be otherwise.
    Gap,
    /// Beyond an edge of what was felt.
    Beyond,
}

/// A place that was felt.
#[derive(Clone, Copy, Debug)]
struct FeltPlace {
    is_open: bool,
    /// Squared distance beyond which a gap begins \[m²\].
    gap_m2: f64,
}

impl OpenRegion {
    /// Of places, of which the first `felt` were felt and have these links; none of a model that
    /// was felt all over and without gaps.
    ///
    /// `body_unexpected` is the share of contacts that are not as the model's body predicts, if it
    /// has one. What is missing of a curve is taken for a straight line over each gap between two
    /// of its ends; what is missing of a surface for a disc with the circumference of each of its
    /// edges.
    pub(crate) fn new(
        positions: &[Point3<f64>],
        felt: usize,
        graph: &LinkGraph,
        (spread, spacing_m): (Spread, f64),
        body_unexpected: Option<f64>,
    ) -> Option<Self> {
        if felt < BETWEEN_MIN {
            return None;
        }
        let all = positions;
        let felt = &positions[..felt];
        let is_curve = graph.is_curve();
        let everywhere = is_curve && plane_normal(felt).is_none();
        let pieces = graph.edges(felt, is_curve);
        let mut is_open = vec![everywhere; felt.len()];
        for own in pieces.iter().flatten() {
            is_open[*own as usize] = true;
        }
        let open = (0u32..).zip(&is_open).filter(|(_, is_open)| **is_open);
        let edge: Vec<u32> = open.map(|(number, _)| number).collect();
        let count = felt.len() as f64;
        let (missing, known) = if is_curve && !everywhere {
            (missing_m(felt, &edge), graph.typical_m * count)
        } else {
            let disc = |around: f64| around * around / (4.0 * PI);
            let holes = pieces.iter().map(|piece| disc(piece.len() as f64));
            let missing = if everywhere { disc(count) } else { holes.sum() };
            (missing, count)
        };
        let unexplored = missing / (missing + known).max(f64::MIN_POSITIVE);
        let is_open_anywhere = unexplored >= UNEXPLORED_MIN;
        let has_nodes = all.len() > felt.len();
        if !is_open_anywhere && !has_nodes && spread == Spread::Even {
            return None;
        }
        // A gap begins beyond the field of a place, at most as wide as two nodes are apart.
        let gap_m2 = |own: usize| {
            if spread == Spread::OnPlaces {
                return (0.5 * spacing_m).powi(2);
            }
            let mean_m = graph.mean_link_m(own, felt).unwrap_or(0.0);
            if has_nodes && mean_m > NODE_STEP * spacing_m {
                (0.5 * NODE_STEP * spacing_m).powi(2)
            } else {
                f64::INFINITY
            }
        };
        let places = (0..felt.len()).map(|own| FeltPlace {
            is_open: is_open[own] && is_open_anywhere,
            gap_m2: gap_m2(own),
        });
        let places: Vec<FeltPlace> = places.collect();
        let near = |position: &Point3<f64>| {
            let mut ends = edge.iter().map(|end| felt[*end as usize] - position);
            ends.any(|apart| apart.norm() < ENTRY_REACH * graph.typical_m)
        };
        let entries = (0u32..).zip(all).filter(|(_, position)| near(position));
        let entries: Vec<u32> = entries.map(|(number, _)| number).collect();
        let step = entries.len().div_ceil(ENTRIES_MAX).max(1);
        Some(Self {
            felt: places,
            is_edge_everywhere: everywhere,
            has_holes: !is_curve,
            nearest: NearestPlace::new(felt),
            entries: entries.into_iter().step_by(step).collect(),
            typical_m: graph.typical_m,
            unexpected: match spread {
                Spread::Even => body_unexpected.unwrap_or(UNEXPECTED_SHARE),
                Spread::OnPlaces => EVEN_SHARE_MIN,
            },
            unexplored: if is_open_anywhere {
                PARTIAL_PRIOR * unexplored
            } else {
                0.0
            },
            known_m: if is_curve {
                graph.typical_m * count
            } else {
                graph.typical_m * count.sqrt()
            },
            missing_m: if is_curve && !everywhere {
                missing
            } else {
                graph.typical_m * missing.sqrt()
            },
            missing_odds: missing / known.max(f64::MIN_POSITIVE),
        })
    }

    /// Places and nodes about where it begins, by their number among both.
    pub(crate) fn entries(&self) -> &[u32] {
        &self.entries
    }

    /// Variance of the first contact on what was explored about such a place, per axis \[m²\].
    pub(crate) fn entry_m2(&self) -> f64 {
        (FIELD_PER_SPACING * self.typical_m).powi(2)
    }

    /// Probability that a walk where the surface is not as predicted is still there after a step
    /// \[m\]: such a part is about half as long as what was felt.
    pub(crate) fn stay_in_gap(&self, step_m: f64) -> f64 {
        (-step_m / (MISSING_PER_KNOWN * self.known_m).max(f64::MIN_POSITIVE)).exp()
    }

    /// Probability that a walk that has been beyond what was felt for so long \[m\] is still there
    /// after a step \[m\].
    ///
    /// Holes are as large as their edges tell. How much is missing beyond the ends of a curve is
    /// hardly known: of the walks of any length half are back after about as much again (Lomax
    /// 1954).
    pub(crate) fn stay_beyond(&self, walked_m: f64, step_m: f64) -> f64 {
        let typical_m = STAY_PER_MISSING * self.missing_m;
        if self.has_holes {
            return (-step_m / typical_m.max(f64::MIN_POSITIVE)).exp();
        }
        let before_m = typical_m + walked_m;
        before_m / (before_m + step_m).max(f64::MIN_POSITIVE)
    }

    /// Whether what was felt tells nothing of a point. Where a walk went over a surface all of it
    /// is the edge, and yet the surface about it is known.
    pub(crate) fn is_beyond(&self, point: &Point3<f64>) -> bool {
        if !self.is_edge_everywhere {
            return self.part(point) == Part::Beyond;
        }
        let nearest = self.nearest.find(point);
        nearest.is_some_and(|(square, _)| square > self.typical_m.powi(2))
    }

    /// Probability that a step \[m\] from what was felt leads beyond it: as many lead there as
    /// back, so that it is the less the less is missing. The first one needs something to be
    /// missing at all.
    pub(crate) fn leave(&self, step_m: f64, has_left: bool) -> f64 {
        let prior = if has_left { 1.0 } else { PARTIAL_PRIOR };
        ((1.0 - self.stay_beyond(0.0, step_m)) * self.missing_odds * prior).min(1.0)
    }

    /// What the model says of a point.
    pub(crate) fn part(&self, point: &Point3<f64>) -> Part {
        let Some((square, number)) = self.nearest.find(point) else {
            return Part::Known;
        };
        let place = &self.felt[number as usize];
        let is_far = square > (EXPLORED_REACH * self.typical_m).powi(2);
        if place.is_open || is_far && self.unexplored > 0.0 {
            Part::Beyond
        } else if square > place.gap_m2 {
            Part::Gap
        } else {
            Part::Known
        }
    }
}

/// Length of what is missing between the ends of curves \[m\]: each goes on to the nearest other
/// one.
fn missing_m(felt: &[Point3<f64>], ends: &[u32]) -> f64 {
    let at = |end: u32| felt[end as usize];
    let gap = |end: &u32| {
        let others = ends.iter().filter(|other| *other != end);
        let gaps = others.map(|other| (at(*other) - at(*end)).norm());
        gaps.fold(f64::INFINITY, f64::min)
    };
    let gaps = ends.iter().map(gap).filter(|gap| gap.is_finite());
    0.5 * gaps.sum::<f64>()
}
