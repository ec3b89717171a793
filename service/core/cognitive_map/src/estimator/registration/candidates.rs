//! The hypotheses that are worth refining.

use nalgebra::Isometry3;

use super::hypotheses::Hypothesis;
use super::point_index::{PointIndex, one_to_one};
use super::tuning::CANDIDATES_MAX;
use super::{GATE, UncertainPoint, apart_m, mean_variance};

/// A motion that is to be looked at closely.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    pose: Isometry3<f64>,
    n_correspondences: usize,
    /// Sum of their normalised squares.
    squares: f64,
}

impl Candidate {
    fn is_better_than(&self, other: &Self) -> bool {
        (self.n_correspondences, -self.squares) > (other.n_correspondences, -other.squares)
    }
}

/// The best of the motions, no two nearly the same, best first.
pub(super) fn candidates(
    hypotheses: &[Hypothesis],
    index: &PointIndex<'_>,
    newer: &[UncertainPoint],
    correspondences_min: usize,
) -> Vec<Isometry3<f64>> {
    let corners = corners(newer);
    let near_m = 2.0 * GATE * mean_variance(newer).sqrt();
    let mut candidates = Vec::new();
    let mut correspondences = Vec::new();
    for hypothesis in hypotheses {
        index.pairs(
            &hypothesis.pose,
            newer,
            &|at| hypothesis.spread(at),
            &mut correspondences,
        );
        one_to_one(&mut correspondences);
        if correspondences.len() >= correspondences_min {
            let candidate = Candidate {
                pose: hypothesis.pose,
                n_correspondences: correspondences.len(),
                squares: correspondences
                    .iter()
                    .map(|correspondence| correspondence.square)
                    .sum(),
            };
            let is_same =
                |other: &Candidate| apart_m(&other.pose, &candidate.pose, &corners) < near_m;
            propose(&mut candidates, candidate, is_same);
        }
    }
    candidates.iter().map(|candidate| candidate.pose).collect()
}

/// Keeps the best candidates, best first; of those that are nearly the same motion, the best one.
fn propose(candidates: &mut Vec<Candidate>, new: Candidate, is_same: impl Fn(&Candidate) -> bool) {
    let worst = candidates.last();
    if candidates.len() >= CANDIDATES_MAX && worst.is_some_and(|worst| !new.is_better_than(worst)) {
        return;
    }
    if let Some(at) = candidates.iter().position(is_same) {
        if !new.is_better_than(&candidates[at]) {
            return;
        }
        candidates.remove(at);
    }
    let at = candidates.partition_point(|other| other.is_better_than(&new));
    candidates.insert(at, new);
    candidates.truncate(CANDIDATES_MAX);
}

/// Three landmarks far from one another: two motions that map these to the same points are one.
fn corners(points: &[UncertainPoint]) -> Vec<UncertainPoint> {
    let mut corners: Vec<UncertainPoint> = Vec::new();
    while corners.len() < points.len().min(3) {
        let far = |point: &UncertainPoint| {
            let distances = corners
                .iter()
                .map(|corner| (point.position - corner.position).norm());
            distances.fold(f64::INFINITY, f64::min)
        };
        let farthest = points.iter().max_by(|a, b| far(a).total_cmp(&far(b)));
        corners.extend(farthest);
    }
    corners
}
