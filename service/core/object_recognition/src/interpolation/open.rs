//! Where a surface goes on beyond what was felt of it.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Point3;

use super::graph::LinkGraph;
use crate::numeric::centroid;
use crate::tuning::{
    ENTRIES_MAX, ENTRY_REACH, EXPLORED_REACH, FIELD_PER_SPACING, FLAT_SHARE, UNEXPLORED_MIN,
};

/// The part of space that is nearest to a place beyond which nothing was felt.
#[derive(Clone, Debug)]
pub(crate) struct OpenRegion {
    felt: Vec<Point3<f64>>,
    is_open: Vec<bool>,
    /// The places and nodes about where it begins.
    entries: Vec<u32>,
    /// Typical distance of places \[m\].
    typical_m: f64,
    /// Share of the object that was not felt.
    pub(crate) unexplored: f64,
}

impl OpenRegion {
    /// Of places, of which the first `felt` were felt and have these links; none where next to
    /// nothing is missing.
    ///
    /// What is missing of a curve is taken for a half circle over each gap between two of its ends;
    /// what is missing of a surface for a disc with the circumference of its edges.
    pub(crate) fn new(positions: &[Point3<f64>], felt: usize, graph: &LinkGraph) -> Option<Self> {
        if felt < 3 {
            return None;
        }
        let all = positions;
        let felt = &positions[..felt];
        let is_curve = 2 * graph.triangles.len() < felt.len();
        let everywhere = is_curve && !is_flat(felt);
        let pieces = graph.edges(felt, is_curve);
        let mut is_open = vec![everywhere; felt.len()];
        for own in pieces.iter().flatten() {
            is_open[*own as usize] = true;
        }
        let open = (0u32..).zip(&is_open).filter(|(_, is_open)| **is_open);
        let edge: Vec<u32> = open.map(|(number, _)| number).collect();
        let count = felt.len() as f64;
        let (missing, known) = if is_curve && !everywhere {
            let known = graph.typical_m * count;
            (missing_m(felt, &edge), known)
        } else {
            let disc = |around: f64| around * around / (4.0 * PI);
            let holes = pieces.iter().map(|piece| disc(piece.len() as f64));
            let missing = if everywhere { disc(count) } else { holes.sum() };
            (missing, count)
        };
        let unexplored = missing / (missing + known).max(f64::MIN_POSITIVE);
        if std::env::var("DBG").is_ok() {
            eprintln!(
                "OPEN n={} tri={} curve={is_curve} every={everywhere} edge={} missing={missing:.3} known={known:.3} share={unexplored:.3} typ={:.4} nodes={}",
                felt.len(),
                graph.triangles.len(),
                edge.len(),
                graph.typical_m,
                all.len() - felt.len()
            );
        }
        if unexplored < UNEXPLORED_MIN {
            return None;
        }
        let near = |position: &Point3<f64>| {
            let mut ends = edge.iter().map(|end| felt[*end as usize] - position);
            ends.any(|apart| apart.norm() < ENTRY_REACH * graph.typical_m)
        };
        let entries = (0u32..).zip(all).filter(|(_, position)| near(position));
        let entries: Vec<u32> = entries.map(|(number, _)| number).collect();
        let step = entries.len().div_ceil(ENTRIES_MAX).max(1);
        Some(Self {
            felt: felt.to_vec(),
            is_open,
            entries: entries.into_iter().step_by(step).collect(),
            typical_m: graph.typical_m,
            unexplored,
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

    /// Whether a point is nearest to a place beyond which nothing was felt, or far from all places.
    pub(crate) fn holds(&self, point: &Point3<f64>) -> bool {
        let mut best = (f64::INFINITY, false);
        for (position, is_open) in self.felt.iter().zip(&self.is_open) {
            let square = (position - point).norm_squared();
            if square < best.0 {
                best = (square, *is_open);
            }
        }
        best.1 || best.0 > (EXPLORED_REACH * self.typical_m).powi(2)
    }
}

/// Length of what is missing between the ends of curves \[m\]: each goes on to the nearest other one.
fn missing_m(felt: &[Point3<f64>], ends: &[u32]) -> f64 {
    let at = |end: u32| felt[end as usize];
    let gap = |end: &u32| {
        let others = ends.iter().filter(|other| *other != end);
        let gaps = others.map(|other| (at(*other) - at(*end)).norm());
        gaps.fold(f64::INFINITY, f64::min)
    };
    let gaps = ends.iter().map(gap).filter(|gap| gap.is_finite());
    0.5 * FRAC_PI_2 * gaps.sum::<f64>()
}

/// Whether all places lie in a plane.
fn is_flat(felt: &[Point3<f64>]) -> bool {
    let middle = centroid(felt.iter().map(|position| position.coords));
    let spread = felt.iter().map(|position| {
        let apart = position.coords - middle;
        apart * apart.transpose()
    });
    let values = spread
        .sum::<nalgebra::Matrix3<f64>>()
        .symmetric_eigenvalues();
    values.min() < FLAT_SHARE * values.max()
}
