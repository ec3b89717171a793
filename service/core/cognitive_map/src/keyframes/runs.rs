//! Runs: loop closures one after the other that say the same, as a place recogniser makes them
//! while a robot goes along a way that looks like another one.

use nalgebra::Isometry3;

use super::constraint::Constraint;
use super::keyframe::KeyframeSlab;
use super::problem::Problem;
use super::tuning;
use geometry::se3;

/// Loop closures that agree with one another and lie close together at both ends: one and the same
/// claim, true or false as a whole.
#[derive(Clone, Debug)]
pub(super) struct Run {
    /// The numbers of the closures, in the order of time.
    pub(super) members: Vec<u32>,
    /// The one in the middle.
    pub(super) middle: u32,
}

/// A closure with what it is compared by.
pub(super) struct Member {
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

impl Member {
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

    /// Whether two closures agree, by the ways between their ends, and both ways are short.
    ///
    /// ```text
    /// A now ── match ──> A then
    ///   │                  │           the ways along the chains, and both matches, close up
    /// B now ── match ──> B then
    /// ```
    fn continues(&self, other: &Self, gate_chi2: f64) -> bool {
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
        let lever = now.translation.vector.norm() + then.translation.vector.norm();
        if lever > 2.0 * tuning::RUN_STEP_MAX_M {
            return false;
        }
        let by_other = now.inverse() * other.transform * then;
        let error = by_other.inv_mul(&self.transform);
        let [mut shift, mut turn] =
            [0, 1].map(|k| self.own[k] + other.own[k] + now_variance[k] + then_variance[k]);
        // Rotation errors of odometry and of the closures move the ends.
        shift += turn * lever * lever;
        shift += tuning::CLOSURE_SD_MIN * tuning::CLOSURE_SD_MIN;
        turn += tuning::CLOSURE_SD_MIN * tuning::CLOSURE_SD_MIN;
        let squared =
            error.translation.vector.norm_squared() / shift + error.rotation.angle().powi(2) / turn;
        squared <= gate_chi2
    }
}

impl Run {
    /// Whether it is of so many closures that they are no single mistake.
    pub(super) fn is_long(&self) -> bool {
        self.members.len() >= tuning::RUN_CLOSURES_MIN
    }

    /// Log of the odds at which it is accepted.
    pub(super) fn log_odds_needed(&self) -> f64 {
        if self.is_long() {
            tuning::ACCEPTED_LOG_ODDS
        } else {
            tuning::ACCEPTED_ALONE_LOG_ODDS
        }
    }

    /// Log of the odds at which it is accepted with others that are evident by it. Of so many
    /// candidates there are as many pairs as their square, and where closures are single some pairs
    /// agree by chance.
    pub(super) fn log_odds_needed_together(&self, n_candidates: usize) -> f64 {
        if self.is_long() {
            tuning::ACCEPTED_LOG_ODDS
        } else {
            2.0 * tuning::ACCEPTED_ALONE_LOG_ODDS + 2.0 * (n_candidates as f64).ln()
        }
    }

    /// The runs that closures form.
    pub(super) fn of(mut members: Vec<Member>, gate_chi2: f64) -> Vec<Self> {
        members.sort_by_key(|member| (member.agent, member.stamp_ns, member.constraint));
        let mut open: Vec<Vec<usize>> = Vec::new();
        for index in 0..members.len() {
            let joins = |run: &&mut Vec<usize>| {
                let last = run[run.len() - 1];
                let first = run[0];
                let along = members[first].ends[0].inv_mul(&members[index].ends[0]);
                let (linear, angular) = se3::log(&along);
                linear.norm() <= tuning::RUN_LENGTH_MAX_M
                    && angular.norm() <= tuning::RUN_TURN_MAX_RAD
                    && members[index].continues(&members[last], gate_chi2)
            };
            let n_old = open.len().saturating_sub(tuning::CLOSURES_COMPARED);
            match open[n_old..].iter_mut().rev().find(joins) {
                Some(run) => run.push(index),
                None => open.push(vec![index]),
            }
        }
        let run = |run: Vec<usize>| {
            let members: Vec<u32> = run.iter().map(|&index| members[index].constraint).collect();
            let middle = members[members.len() / 2];
            Self { members, middle }
        };
        open.into_iter().map(run).collect()
    }
}
