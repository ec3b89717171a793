//! A loop closure that may be accepted, and what it is compared by.

use nalgebra::{Isometry3, Matrix6};

use super::constraint::Constraint;
use super::keyframe::KeyframeSlab;
use super::problem::Problem;
use super::tuning;
use geometry::se3;
use pose_graph::Marginals;

/// A pending closure, with what it is compared by.
pub(super) struct Candidate {
    pub(super) constraint: u32,
    agent: u32,
    stamp_ns: i64,
    transform: Isometry3<f64>,
    /// Poses of its ends, and variances of odometry up to them since their chains began \[m²,
    /// rad²\].
    ends: [Isometry3<f64>; 2],
    variances: [[f64; 2]; 2],
    /// Its largest variances of shift and rotation \[m², rad²\].
    own: [f64; 2],
}

impl Candidate {
    /// A closure with its ends as a graph has them.
    pub(super) fn new(
        number: u32,
        constraint: &Constraint,
        keyframes: &KeyframeSlab,
        problem: &Problem,
        path_variances: &[[f64; 2]],
    ) -> Option<Self> {
        let from = keyframes.get(constraint.from)?;
        let diagonal = constraint.covariance.matrix().diagonal();
        Some(Self {
            constraint: number,
            agent: from.agent,
            stamp_ns: from.stamp_ns,
            transform: constraint.transform,
            ends: [
                *problem.pose(constraint.from)?,
                *problem.pose(constraint.to)?,
            ],
            variances: [
                *path_variances.get(constraint.from as usize)?,
                *path_variances.get(constraint.to as usize)?,
            ],
            own: [diagonal.rows(0, 3).max(), diagonal.rows(3, 3).max()],
        })
    }

    /// For each of these, sorted by agent and time, with how many others of them it agrees.
    pub(super) fn count_partners(candidates: &mut [Self], gate_chi2: f64) -> Vec<usize> {
        candidates
            .sort_by_key(|candidate| (candidate.agent, candidate.stamp_ns, candidate.constraint));
        let mut partners = vec![0; candidates.len()];
        for later in 0..candidates.len() {
            for earlier in later.saturating_sub(tuning::CLOSURES_COMPARED)..later {
                if candidates[later].agrees(&candidates[earlier], gate_chi2) {
                    partners[later] += 1;
                    partners[earlier] += 1;
                }
            }
        }
        partners
    }

    /// Whether two matches agree, by the ways between their ends.
    ///
    /// ```text
    /// A now ── match ──> A then
    ///   │                  │           the ways along the chains, and both matches, close up
    /// B now ── match ──> B then
    /// ```
    fn agrees(&self, other: &Self, gate_chi2: f64) -> bool {
        if self.agent != other.agent {
            return false;
        }
        let between = |end: usize| {
            let way = other.ends[end].inv_mul(&self.ends[end]);
            let [a, b] = [self.variances[end], other.variances[end]];
            (way, [(a[0] - b[0]).abs(), (a[1] - b[1]).abs()])
        };
        let (now, now_variance) = between(0);
        let (then, then_variance) = between(1);
        let by_other = now.inverse() * other.transform * then;
        let error = by_other.inv_mul(&self.transform);
        let [mut shift, mut turn] =
            [0, 1].map(|k| self.own[k] + other.own[k] + now_variance[k] + then_variance[k]);
        // Rotation errors of odometry and of the closures move the ends.
        let lever = now.translation.vector.norm() + then.translation.vector.norm();
        shift += turn * lever * lever;
        shift += tuning::CLOSURE_SD_MIN * tuning::CLOSURE_SD_MIN;
        turn += tuning::CLOSURE_SD_MIN * tuning::CLOSURE_SD_MIN;
        let squared =
            error.translation.vector.norm_squared() / shift + error.rotation.angle().powi(2) / turn;
        // Two closures that would agree wherever they were are no evidence for each other.
        let own = self.own[0] + other.own[0] + tuning::CLOSURE_SD_MIN * tuning::CLOSURE_SD_MIN;
        let telling = (4.0 * tuning::UNCERTAINTY_RATIO_MAX * tuning::UNCERTAINTY_RATIO_MAX * own)
            .max(tuning::CERTAIN_SD_M * tuning::CERTAIN_SD_M);
        squared <= gate_chi2 && shift <= telling
    }
}

/// Whether the map is about as certain of the relative pose as a closure, and agrees.
pub(super) fn agrees_with(
    constraint: &Constraint,
    problem: &Problem,
    marginals: &Marginals<'_>,
    gate_chi2: f64,
) -> bool {
    let ends = problem
        .node(constraint.from)
        .zip(problem.node(constraint.to));
    let Some((from, to)) = ends else {
        return false;
    };
    let own = constraint.covariance.matrix();
    let least = tuning::CLOSURE_SD_MIN * tuning::CLOSURE_SD_MIN;
    let expected = problem.map.pose(from).inv_mul(problem.map.pose(to));
    let off = se3::twist(&expected.inv_mul(&constraint.transform));
    // One that is too far off in one direction is so for every map that is sure enough: its
    // covariance, which takes long to find, need not be known.
    let least_certain = tuning::UNCERTAINTY_RATIO_MAX * tuning::UNCERTAINTY_RATIO_MAX + 1.0;
    if (0..6).any(|k| off[k] * off[k] > gate_chi2 * least_certain * (own[(k, k)] + least)) {
        return false;
    }
    let Some(spread) = marginals.relative_pose(from, to) else {
        return false;
    };
    let is_known = (0..6).all(|k| {
        spread.matrix()[(k, k)]
            <= tuning::UNCERTAINTY_RATIO_MAX * tuning::UNCERTAINTY_RATIO_MAX * (own[(k, k)] + least)
    });
    let whole = spread.matrix() + own + Matrix6::from_diagonal_element(least);
    let inverse = whole.try_inverse();
    is_known && inverse.is_some_and(|inverse| off.dot(&(inverse * off)) <= gate_chi2)
}
