//! Candidates: the places where an agent may be that does not know it.

use nalgebra::{Isometry3, Matrix6, Point3};

use super::alignment::alignment;
use super::positions::Positions;
use super::problem::Problem;
use super::search::Search;
use super::seeding::{is_same, minima, turns};
use crate::appearance::{
    AlignedPose, BatchPose, Evidence, ReferenceViews, ViewAlignment, mixture, weighted,
};
use crate::keyframes::Keyframes;
use crate::sequences::ViewMemory;
use crate::tuning::candidates as tuning;
use geometry::PoseCovariance;

/// Steps of batch alignment: of all poses, and of those about as likely as the best one.
const WHOLE_STEPS: [usize; 2] = [2, 6];

/// A place where the agent may be: poses that differ by little.
pub(crate) struct Candidate {
    pub(crate) evidence: Evidence,
    /// Mean pose, by batch alignment for the best candidate.
    pub(crate) mean: Isometry3<f64>,
    pub(crate) covariance: Matrix6<f64>,
    /// Standard deviation of the position, query by query \[m\].
    pub(crate) rough_sd_m: f64,
    /// Factor of the covariance by which all queries at once are farther off than expected; at
    /// least 1.
    pub(crate) inflation: f64,
}

/// The candidates of a search, the best first.
pub(crate) fn candidates(
    search: &Search,
    memory: &ViewMemory,
    keyframes: &dyn Keyframes,
) -> Vec<Candidate> {
    let positions = Positions::of(keyframes);
    let Some(problem) = Problem::of(search, memory, keyframes, &positions) else {
        return Vec::new();
    };
    let alignment = alignment(&problem, search, memory, &positions);
    let prior = problem.prior();
    let mut found: Vec<AlignedPose> = minima(&problem)
        .iter()
        .filter_map(|start| alignment.align(start, &prior))
        .filter(|aligned| aligned.evidence.total() > 0.0)
        .collect();
    found.sort_by(|a, b| b.evidence.total().total_cmp(&a.evidence.total()));
    let mut places: Vec<Vec<(AlignedPose, f64)>> = Vec::new();
    for aligned in found {
        let known = places.iter_mut().find(|poses| {
            let best = &poses[0].0.pose;
            let apart = best.translation.vector - aligned.pose.translation.vector;
            apart.norm() < tuning::PLACE * problem.reach_m
        });
        match known {
            Some(poses) => {
                let above = poses[0].0.evidence.against(&aligned.evidence).max(0.0);
                poses.push((aligned, (-above).exp()));
            }
            None => places.push(vec![(aligned, 1.0)]),
        }
    }
    places.sort_by(|a, b| b[0].0.evidence.total().total_cmp(&a[0].0.evidence.total()));
    let places = places.into_iter().enumerate().map(|(rank, poses)| {
        let rough = mixture(&weighted(&poses));
        // An agent that was found knows its heading.
        let is_turn_open =
            search.found_m.is_none() && turn_sd_rad(&rough.1) > tuning::TURN_OPEN_RAD;
        let fine = (rank == 0)
            .then(|| whole(&problem, &alignment, &poses, is_turn_open))
            .flatten();
        let is_there = |fine: &(Isometry3<f64>, Matrix6<f64>, f64)| {
            let apart = rough.0.translation.vector - fine.0.translation.vector;
            apart.norm() < tuning::PLACE * problem.reach_m
        };
        let (mean, covariance, inflation) =
            fine.filter(is_there).unwrap_or((rough.0, rough.1, 1.0));
        Candidate {
            evidence: poses[0].0.evidence.clone(),
            mean,
            covariance,
            rough_sd_m: PoseCovariance::from_matrix(&rough.1).position_sd_m(),
            inflation,
        }
    });
    places.collect()
}

/// A candidate by all queries at once: the mixture of its poses, weighted by likelihood.
fn whole<'a, About: Fn(&[Point3<f64>]) -> ReferenceViews<'a>>(
    problem: &Problem,
    alignment: &ViewAlignment<'a, About>,
    poses: &[(AlignedPose, f64)],
    is_turn_open: bool,
) -> Option<(Isometry3<f64>, Matrix6<f64>, f64)> {
    let prior = problem.prior();
    let best = &poses.first()?.0;
    let whole = alignment.whole(&best.pose)?;
    let others = poses.iter().map(|(aligned, _)| aligned.pose);
    let mut starts: Vec<Isometry3<f64>> = others.take(tuning::WHOLE_MAX).collect();
    if is_turn_open {
        starts.extend(turns(problem, &best.pose));
    }
    let mut aligned: Vec<BatchPose> = Vec::new();
    for steps in WHOLE_STEPS {
        aligned = starts
            .iter()
            .filter_map(|start| whole.align(start, &prior, steps))
            .collect();
        aligned.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let (least, inflation) = (aligned.first()?.cost, aligned.first()?.inflation);
        aligned.retain(|each| each.cost - least < tuning::RIVAL * inflation);
        starts.clear();
        aligned.retain(|each| {
            let is_new = !starts
                .iter()
                .any(|known| is_same(problem, known, &each.pose));
            let is_kept = is_new && starts.len() < tuning::WHOLE_MAX;
            if is_kept {
                starts.push(each.pose);
            }
            is_kept
        });
    }
    let best = *aligned.first()?;
    let each = aligned.iter().map(|each| {
        let weight = ((best.cost - each.cost) / best.inflation).exp();
        (each.pose, each.covariance, weight)
    });
    let (mean, covariance) = mixture(&each.collect::<Vec<_>>());
    Some((mean, covariance, best.inflation))
}

/// Largest standard deviation of the rotation in a covariance \[rad\].
pub(crate) fn turn_sd_rad(covariance: &Matrix6<f64>) -> f64 {
    covariance.diagonal().rows(3, 3).max().max(0.0).sqrt()
}
