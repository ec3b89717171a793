//! A copy of the keyframe graph in which closures are judged and keyframes are moved.

use std::collections::BTreeSet;

use nalgebra::Isometry3;

use super::constraint::{ClosureState, Constraint, composed};
use super::evidence::{Chance, log_evidence};
use super::graph::KeyframeGraph;
use super::problem::{Among, Calibrating, Problem};
use super::runs::{Member, Run};
use super::tuning;
use crate::estimator::ExternalEstimate;
use geometry::{is_somewhere, is_within};
use pose_graph::{Graduation, RelaxationSettings, Relaxed};
use state::{NONE, Slab};

/// What a relaxation says of an agent.
#[derive(Clone, Copy, Debug)]
pub struct Correction {
    /// Number of the agent.
    pub agent: u32,
    /// Its pose now, in the map, and its odometry.
    pub estimate: ExternalEstimate,
}

/// A copy of the keyframe graph, which shares all pages that do not change.
pub(super) struct RelaxationCopy(KeyframeGraph);

impl RelaxationCopy {
    /// Of a graph as it is.
    pub(super) fn of(graph: KeyframeGraph) -> Self {
        Self(graph)
    }

    /// Of the whole graph.
    pub(super) fn whole(graph: &KeyframeGraph) -> Self {
        Self(graph.clone())
    }

    /// Of the whole graph, as if no closure had been judged and no odometry been learned.
    pub(super) fn whole_undecided(graph: &KeyframeGraph) -> Self {
        let mut whole = Self(graph.clone());
        let accepted: Vec<u32> = whole.accepted().map(|(number, _)| number).collect();
        for number in accepted {
            whole.set_state(number, ClosureState::Pending);
        }
        for agent in (0..).take(whole.0.chains.tracks.len()) {
            if let Some(track) = whole.0.track_mut(agent) {
                track.turn_noise = 1.0;
            }
        }
        whole
    }

    /// The coarse graph, which is relaxed while samples come in: one keyframe a step, and those
    /// with sightings, at the begin of a stretch, and the latest ones. Keyframes and constraints
    /// keep their numbers.
    pub(super) fn coarse(graph: &KeyframeGraph) -> Self {
        let mut coarse = graph.clone();
        // Attachments move with the keyframes afterwards.
        coarse.attachments.slab = Slab::default();
        for track in graph.chains.tracks.iter() {
            let mut way = Isometry3::identity();
            let mut number = track.newest;
            while let Some(keyframe) = coarse.chains.keyframes.get(number) {
                let (motion, previous) = (keyframe.motion, keyframe.previous);
                // The chain is walked from its end, since removals change the neighbours.
                if number == track.newest
                    || must_stay(&coarse, number)
                    || !is_within(&way, tuning::COARSE_STEP.0, tuning::COARSE_STEP.1)
                {
                    way = motion;
                } else {
                    coarse.dissolve(number);
                    way = motion * way;
                }
                number = previous;
            }
        }
        drop_old_candidates(&mut coarse);
        Self(coarse)
    }

    /// The copy as it is now.
    pub(super) fn graph(&self) -> &KeyframeGraph {
        &self.0
    }

    /// Accepts pending closures that are evident by the map, or by one another; answers their
    /// number. Moves the keyframes to where all accepted closures have them.
    pub(super) fn accept_consistent(&mut self) -> usize {
        if self.0.constraints.first_candidate() == NONE {
            return 0;
        }
        // With kernels that begin wide, all closures together find the map that most of them agree
        // with.
        let mut all = Problem::new(&self.0, Among::All, Calibrating::Held);
        all.map.relax(&from_wide());
        let mut runs = self.pending_runs(&all);
        let mut n_accepted = 0;
        for _ in 0..tuning::ACCEPTANCE_ROUNDS_MAX {
            let mut n_new = self.accept_evident(&runs);
            if n_new == 0 {
                n_new = self.accept_together(&runs);
            }
            if n_new == 0 {
                break;
            }
            n_accepted += n_new;
            self.settle(&runs);
            let constraints = &self.0.constraints.slab;
            let is_pending = |run: &Run| {
                let middle = constraints.get(run.middle);
                middle.is_some_and(Constraint::is_candidate)
            };
            runs.retain(is_pending);
        }
        n_accepted
    }

    /// The runs of pending closures that fit a map with all closures.
    fn pending_runs(&self, all: &Problem) -> Vec<Run> {
        let gate_chi2 = self.0.settings.closure_gate_chi2;
        let chains = &self.0.chains;
        let path_variances = chains.path_variances();
        let fitting = self.closures().filter_map(|(number, constraint)| {
            let fits = constraint.is_candidate() && all.squared_error(number)? <= gate_chi2;
            let member =
                || Member::new(number, constraint, &chains.keyframes, all, &path_variances);
            fits.then(member).flatten()
        });
        Run::of(fitting.collect(), gate_chi2)
    }

    /// Accepts the runs that are evident by the map; answers the number of their closures.
    fn accept_evident(&mut self, runs: &[Run]) -> usize {
        if runs.is_empty() {
            return 0;
        }
        let evident = self.evidence(runs).into_iter();
        let evident = evident.filter(|&(index, odds)| odds >= runs[index].log_odds_needed());
        evident
            .map(|(index, _)| self.accept_run(&runs[index]))
            .sum()
    }

    /// Accepts runs of which each is no more evident than chance, but which are evident together:
    /// one of them, and those that are evident by it. Answers the number of their closures.
    fn accept_together(&mut self, runs: &[Run]) -> usize {
        let mut seeds = self.evidence(runs);
        seeds.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        for &(seed, odds) in seeds.iter().take(tuning::SEEDS_MAX) {
            let mut trial = Self(self.0.clone());
            trial.accept_run(&runs[seed]);
            trial.relax();
            let others = trial.evidence(runs).into_iter();
            let others = others
                .filter(|&(index, odds)| index != seed && odds >= runs[index].log_odds_needed());
            let others: Vec<_> = others.collect();
            let together = odds + others.iter().map(|other| other.1).sum::<f64>();
            if !others.is_empty() && together >= tuning::ACCEPTED_LOG_ODDS {
                let others = others.iter().map(|&(index, _)| &runs[index]);
                let all = std::iter::once(&runs[seed]).chain(others);
                return all.map(|run| self.accept_run(run)).sum();
            }
        }
        0
    }

    /// Relaxes the map with closures that have just been accepted, and learns how noisy the
    /// odometry of their agents is.
    fn settle(&mut self, runs: &[Run]) {
        self.relax();
        let agent = |run: &Run| {
            let constraint = self.0.constraints.slab.get(run.middle)?;
            let is_accepted = constraint.state == ClosureState::Accepted;
            let from = self.0.chains.keyframes.get(constraint.from)?;
            is_accepted.then_some(from.agent)
        };
        let agents: BTreeSet<u32> = runs.iter().filter_map(agent).collect();
        for agent in agents {
            self.learn_odometry_noise(agent);
        }
    }

    /// The log-odds of each run, by what has been accepted.
    fn evidence(&self, runs: &[Run]) -> Vec<(usize, f64)> {
        let problem = Problem::new(&self.0, Among::Accepted, Calibrating::Free);
        let marginals = problem.map.marginals();
        let chance = Chance::of(&self.0.chains, &problem);
        let constraints = &self.0.constraints.slab;
        let odds = |(index, run): (usize, &Run)| {
            let constraint = constraints.get(run.middle)?;
            let odds = log_evidence(constraint, &problem, &marginals, &chance)?;
            Some((index, odds))
        };
        runs.iter().enumerate().filter_map(odds).collect()
    }

    /// Accepts the closures of a run; answers their number.
    fn accept_run(&mut self, run: &Run) -> usize {
        for &number in &run.members {
            self.set_state(number, ClosureState::Accepted);
        }
        run.members.len()
    }

    /// The relaxed graph, after closures that do not fit into it were rejected; and their number.
    /// Moves the keyframes.
    pub(super) fn relax(&mut self) -> (Problem, Relaxed, usize) {
        let refuted_chi2 = self.0.settings.refuted_chi2();
        let mut n_rejected = 0;
        for _ in 0..tuning::RELAXATION_ROUNDS_MAX {
            let mut held = Problem::new(&self.0, Among::Accepted, Calibrating::Held);
            let mut settings = from_wide();
            if self.fits(&held) {
                settings.graduation = Graduation::None;
            }
            held.map.relax(&settings);
            let is_too_far = |number: u32| {
                let squared = held.squared_error(number);
                squared.is_some_and(|squared| squared > refuted_chi2)
            };
            let accepted = self.accepted().map(|(number, _)| number);
            let refuted: Vec<u32> = accepted.filter(|&number| is_too_far(number)).collect();
            for &number in &refuted {
                self.set_state(number, ClosureState::Refuted);
            }
            n_rejected += refuted.len();
            self.move_keyframes(&held);
            if refuted.is_empty() {
                break;
            }
        }
        let mut problem = Problem::new(&self.0, Among::Accepted, Calibrating::Free);
        let relaxed = problem.map.relax(&RelaxationSettings::default());
        (problem, relaxed, n_rejected)
    }

    /// The poses of the agents in the map in a relaxed graph.
    ///
    /// They prevail over what the agents' filters hold where closures were judged by their
    /// evidence; not where closures were accepted as they came, for a robot that recognises what
    /// it cannot see may have been carried off.
    pub(super) fn corrections(&self, problem: &Problem, prevail: bool) -> Vec<Correction> {
        let marginals = problem.map.marginals();
        let mut corrections = Vec::new();
        for (agent, track) in (0..).zip(self.0.chains.tracks.iter()) {
            let node = problem.node(track.newest);
            let Some(node) = node.filter(|_| !track.needs_keyframe) else {
                continue;
            };
            let Some(covariance) = marginals.pose(node) else {
                continue;
            };
            let since = &track.since;
            let estimate = ExternalEstimate {
                pose: problem.map.pose(node) * since.motion(),
                covariance: composed(&covariance, since.motion(), &since.covariance()),
                calibration: problem.calibration(agent, &marginals),
                prevails: prevail,
            };
            corrections.push(Correction { agent, estimate });
        }
        corrections
    }

    /// Moves the keyframes to their poses in a relaxed graph.
    pub(super) fn move_keyframes(&mut self, problem: &Problem) {
        let (keyframes, revision) = (&mut self.0.chains.keyframes, self.0.revision);
        for number in 0..keyframes.numbers() {
            let pose = problem.pose(number);
            let Some(pose) = pose.filter(|pose| is_somewhere(&pose.translation.vector)) else {
                continue;
            };
            if let Some(keyframe) = keyframes.get_mut(number, revision) {
                keyframe.pose = *pose;
                keyframe.is_in_map = true;
            }
        }
    }

    /// Whether all accepted closures are within the range of their kernels.
    fn fits(&self, problem: &Problem) -> bool {
        let refuted_chi2 = self.0.settings.refuted_chi2();
        self.accepted().all(|(number, _)| {
            let squared = problem.squared_error(number);
            squared.is_none_or(|squared| squared <= refuted_chi2)
        })
    }

    fn closures(&self) -> impl Iterator<Item = (u32, &Constraint)> {
        let all = self.0.constraints.slab.iter();
        all.filter(|(_, constraint)| constraint.is_closure())
    }

    pub(super) fn accepted(&self) -> impl Iterator<Item = (u32, &Constraint)> {
        self.closures()
            .filter(|(_, constraint)| constraint.is_accepted())
    }

    fn set_state(&mut self, number: u32, state: ClosureState) {
        let (constraints, revision) = (&mut self.0.constraints.slab, self.0.revision);
        if let Some(constraint) = constraints.get_mut(number, revision) {
            constraint.state = state;
        }
    }
}

/// Settings of a relaxation with closures.
fn from_wide() -> RelaxationSettings {
    RelaxationSettings {
        graduation: Graduation::FromWide,
        ..RelaxationSettings::default()
    }
}

/// Whether a keyframe must stay in the coarse graph.
fn must_stay(graph: &KeyframeGraph, number: u32) -> bool {
    let keyframes = &graph.chains.keyframes;
    let Some(keyframe) = keyframes.get(number) else {
        return true;
    };
    let next = keyframes.get(keyframe.next);
    let goes_on = next.is_some_and(|next| !next.begins);
    if keyframe.begins || !goes_on || keyframe.sightings != NONE || keyframe.shown != NONE {
        return true;
    }
    let mut constraints = graph.constraints.of(number, keyframe);
    constraints.any(|constraint| !constraint.is_closure())
}

/// Removes candidates but the latest ones.
fn drop_old_candidates(graph: &mut KeyframeGraph) {
    let stamped = |(number, constraint): (u32, &Constraint)| {
        let from = graph.chains.keyframes.get(constraint.from)?;
        constraint.is_candidate().then_some((from.stamp_ns, number))
    };
    let mut pending: Vec<(i64, u32)> = { graph.constraints.slab.iter() }
        .filter_map(stamped)
        .collect();
    pending.sort_unstable();
    let n_old = pending.len().saturating_sub(tuning::COARSE_PENDING_MAX);
    for &(_, number) in &pending[..n_old] {
        graph.remove_constraint(number);
    }
}
