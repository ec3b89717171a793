//! A copy of the keyframe graph in which closures are judged and keyframes are moved.

use std::collections::BTreeSet;
use std::sync::Arc;

use nalgebra::Isometry3;
use place_recognition::{LearnedChannel, ViewMap};

use super::agent_track::AgentTrack;
use super::constraint::{ClosureState, Constraint, composed};
use super::evidence::{Chance, log_evidence};
use super::graph::KeyframeGraph;
use super::live_estimates::LiveEstimates;
use super::matching::ViewMatches;
use super::problem::{Among, Calibrating, Problem};
use super::runs::{Member, Run};
use super::tuning;
use crate::estimator::ExternalEstimate;
use geometry::is_somewhere;
use pose_graph::{Graduation, RelaxationSettings, Relaxed};
use state::NONE;

/// What a relaxation says of an agent.
#[derive(Clone, Copy, Debug)]
pub struct Correction {
    /// Number of the agent.
    pub agent: u32,
    /// Its pose now, in the map, and its odometry.
    pub estimate: ExternalEstimate,
}

/// A copy of the keyframe graph, which shares all pages that do not change.
#[derive(Clone)]
pub(super) struct RelaxationCopy {
    graph: KeyframeGraph,
    /// Whether only runs count that are long enough to be no mistake: where the noise of odometry
    /// is supposed, single closures agree with some supposition.
    only_long_runs: bool,
    /// What it is held by.
    live: Arc<LiveEstimates>,
}

impl RelaxationCopy {
    /// Of a graph as it is.
    pub(super) fn of(graph: KeyframeGraph) -> Self {
        Self {
            graph,
            only_long_runs: false,
            live: Arc::default(),
        }
    }

    /// Of the whole graph.
    pub(super) fn whole(graph: &KeyframeGraph) -> Self {
        Self::of(graph.clone())
    }

    /// The same, held by the live estimates.
    pub(super) fn held(&self, live: &LiveEstimates) -> Self {
        Self {
            live: Arc::new(live.clone()),
            ..self.clone()
        }
    }

    /// As if no closure had been judged, and the noise of rotations that nobody states were so many
    /// times what is assumed.
    pub(super) fn undecided(&self, turn_noise: f64) -> Self {
        let mut undecided = self.clone();
        let accepted: Vec<u32> = self.accepted().map(|(number, _)| number).collect();
        for number in accepted {
            undecided.set_state(number, ClosureState::Pending);
        }
        undecided.set_turn_noise(turn_noise);
        undecided
    }

    /// Supposes that the noise of rotations that nobody states is so many times what is assumed.
    pub(super) fn set_turn_noise(&mut self, turn_noise: f64) {
        for agent in (0..).take(self.graph.chains.tracks.len()) {
            if let Some(track) = self.graph.track_mut(agent)
                && !track.states_noise
            {
                track.turn_noise = turn_noise;
            }
        }
    }

    /// Whether there are loop closures that were stated and were not accepted yet.
    pub(super) fn has_pending(&self) -> bool {
        self.closures()
            .any(|(_, closure)| closure.state == ClosureState::Pending)
    }

    /// Whether an agent has closures, and odometry whose noise nobody states.
    pub(super) fn is_noise_open(&self) -> bool {
        let agents = self.closures().filter_map(|(_, closure)| {
            let from = self.graph.chains.keyframes.get(closure.from)?;
            Some(from.agent)
        });
        let agents: BTreeSet<u32> = agents.collect();
        let tracks = &self.graph.chains;
        { agents.into_iter() }
            .filter_map(|agent| tracks.track(agent))
            .any(|track| !track.states_noise)
    }

    /// Judges all closures anew, once for each noise that odometry may have where nobody states it;
    /// answers the judged copies.
    pub(super) fn judged_anew(&self) -> Vec<Self> {
        let factors = if self.is_noise_open() {
            tuning::TURN_NOISES_TRIED
        } else {
            &[1.0]
        };
        let judged = |&factor: &f64| {
            let mut anew = self.undecided(factor);
            anew.only_long_runs = factor < 1.0;
            anew.accept_consistent();
            anew
        };
        factors.iter().map(judged).collect()
    }

    /// The copy as it is now.
    pub(super) fn graph(&self) -> &KeyframeGraph {
        &self.graph
    }

    /// Replaces what was learned of the channels of views.
    pub(super) fn set_learned(&mut self, learned: Arc<[LearnedChannel]>) {
        self.graph.learned = learned;
    }

    /// Replaces what later views are compared with.
    pub(super) fn set_view_maps(&mut self, view_maps: Vec<ViewMap>) {
        self.graph.set_view_maps(view_maps);
    }

    /// Replaces the matches of views.
    pub(super) fn set_matches(&mut self, matches: ViewMatches) {
        self.graph.matches = matches;
    }

    /// Moves the keyframes as in a thinned copy, and adopts its matches.
    pub(super) fn adopt_thinned(&mut self, thinned: &Self) {
        let graph = &mut self.graph;
        graph.matches = Arc::clone(&thinned.graph.matches);
        for agent in (0..).take(graph.chains.tracks.len()) {
            graph
                .chains
                .adopt(agent, &thinned.graph.chains, graph.revision);
        }
    }

    /// Puts a keyframe somewhere else.
    pub(super) fn put(&mut self, keyframe: u32, pose: &Isometry3<f64>) {
        let revision = self.graph.revision;
        self.graph.chains.put(keyframe, pose, revision);
    }

    /// Accepts pending closures that are evident by the map, or by one another; answers their
    /// number. Moves the keyframes to where all accepted closures have them.
    pub(super) fn accept_consistent(&mut self) -> usize {
        if self.graph.constraints.first_candidate() == NONE {
            return 0;
        }
        // With kernels that begin wide, all closures together find the map that most of them agree
        // with.
        let is_other = |track: &AgentTrack| track.turn_noise.to_bits() != 1.0_f64.to_bits();
        let is_by_closures = self.only_long_runs || self.accepted().next().is_some();
        let calibrating = if is_by_closures && self.graph.chains.tracks.iter().any(is_other) {
            // Noise that was learned, or is supposed, is what there is beside lasting errors.
            Calibrating::Free
        } else {
            Calibrating::Held
        };
        let mut all = Problem::new(&self.graph, Among::All, calibrating);
        all.map.relax(&from_wide());
        let mut runs = self.pending_runs(&all);
        let mut n_accepted = 0;
        let (fewest, most) = tuning::ACCEPTANCE_ROUNDS.into_inner();
        let n_rounds = tuning::ACCEPTANCE_KEYFRAMES / self.graph.n_keyframes().max(1);
        for _ in 0..n_rounds.clamp(fewest, most) {
            let mut n_new = self.accept_evident(&runs);
            if n_new == 0 {
                n_new = self.accept_together(&runs);
            }
            if n_new == 0 {
                break;
            }
            n_accepted += n_new;
            self.settle(&runs);
            let constraints = &self.graph.constraints.slab;
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
        let gate_chi2 = self.graph.settings.closure_gate_chi2;
        let fits = |number| {
            all.squared_error(number)
                .is_some_and(|squared| squared <= gate_chi2)
        };
        let mut runs = self.runs(all, |number, closure| {
            closure.is_candidate() && fits(number)
        });
        runs.retain(|run| !self.only_long_runs || run.is_long());
        runs
    }

    /// The runs of some of the closures.
    fn runs(&self, problem: &Problem, are: impl Fn(u32, &Constraint) -> bool) -> Vec<Run> {
        let chains = &self.graph.chains;
        let variances = chains.path_variances();
        let member = |(number, closure): (u32, &Constraint)| {
            Member::new(number, closure, &chains.keyframes, problem, &variances)
        };
        let closures = self
            .closures()
            .filter(|&(number, closure)| are(number, closure));
        Run::of(
            closures.filter_map(member).collect(),
            self.graph.settings.closure_gate_chi2,
        )
    }

    /// A copy in which of each run of accepted closures only the one in the middle is accepted.
    pub(super) fn of_middles(&self, problem: &Problem) -> Self {
        let runs = self.runs(problem, |_, closure| closure.is_accepted());
        let mut copy = self.clone();
        for run in &runs {
            for &number in run.members.iter().filter(|number| **number != run.middle) {
                copy.set_state(number, ClosureState::Pending);
            }
        }
        copy
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
        if runs.len() < 2 {
            return 0;
        }
        let mut seeds = self.evidence(runs);
        seeds.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let n_candidates = { self.closures() }
            .filter(|(_, closure)| closure.is_candidate())
            .count();
        for &(seed, odds) in seeds.iter().take(tuning::SEEDS_MAX) {
            let mut trial = self.clone();
            trial.accept_run(&runs[seed]);
            trial.relax();
            let others = trial.evidence(runs).into_iter();
            let others = others
                .filter(|&(index, odds)| index != seed && odds >= runs[index].log_odds_needed());
            let others: Vec<_> = others.collect();
            let together = odds + others.iter().map(|other| other.1).sum::<f64>();
            if !others.is_empty() && together >= runs[seed].log_odds_needed_together(n_candidates) {
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
            let constraint = self.graph.constraints.slab.get(run.middle)?;
            let is_accepted = constraint.state == ClosureState::Accepted;
            let from = self.graph.chains.keyframes.get(constraint.from)?;
            is_accepted.then_some(from.agent)
        };
        let agents: BTreeSet<u32> = runs.iter().filter_map(agent).collect();
        for agent in agents {
            self.learn_odometry_noise(agent);
        }
    }

    /// The log-odds of each run, by what has been accepted.
    fn evidence(&self, runs: &[Run]) -> Vec<(usize, f64)> {
        let problem = Problem::new(&self.graph, Among::Accepted, Calibrating::Free);
        let marginals = problem.map.marginals();
        let chance = Chance::of(&self.graph.chains, &problem);
        let constraints = &self.graph.constraints.slab;
        let odds = |(index, run): (usize, &Run)| {
            let constraint = constraints.get(run.middle)?;
            let is_planar = self.graph.is_planar(constraint);
            let odds = log_evidence(constraint, is_planar, &problem, &marginals, &chance)?;
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

    /// Of copies whose closures were judged in different ways, the one by which the measurements
    /// are most probable, relaxed; of equal ones the first.
    pub(super) fn most_probable(first: Self, others: Vec<Self>) -> RelaxedCopy {
        let mut best = RelaxedCopy::of(first);
        if others.is_empty() {
            return best;
        }
        let mut most = best.copy.log_probability(&best.problem);
        for other in others {
            let other = RelaxedCopy::of(other);
            let log_probability = other.copy.log_probability(&other.problem);
            if log_probability > most {
                (best, most) = (other, log_probability);
            }
        }
        best
    }

    /// The relaxed graph, after closures that do not fit into it were rejected. Moves the
    /// keyframes.
    fn relax(&mut self) -> (Problem, Relaxed) {
        let refuted_chi2 = self.graph.settings.refuted_chi2();
        let mut rounds_left = tuning::RELAXATION_ROUNDS_MAX;
        loop {
            let mut problem = Problem::new(&self.graph, Among::Accepted, Calibrating::Free);
            problem.hold_by(&self.graph, &self.live);
            let mut settings = from_wide();
            if self.fits(&problem) {
                settings.graduation = Graduation::None;
            }
            let relaxed = problem.map.relax(&settings);
            self.move_keyframes(&problem);
            let is_too_far = |number: u32| {
                let squared = problem.squared_error(number);
                squared.is_some_and(|squared| squared > refuted_chi2)
            };
            let numbers = self.accepted().map(|(number, _)| number);
            let refuted: Vec<u32> = numbers.filter(|&number| is_too_far(number)).collect();
            if refuted.is_empty() || rounds_left == 0 {
                return (problem, relaxed);
            }
            for &number in &refuted {
                self.set_state(number, ClosureState::Refuted);
            }
            rounds_left -= 1;
        }
    }

    /// Moves the keyframes to their poses in a relaxed graph.
    pub(super) fn move_keyframes(&mut self, problem: &Problem) {
        let (keyframes, revision) = (&mut self.graph.chains.keyframes, self.graph.revision);
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
        let refuted_chi2 = self.graph.settings.refuted_chi2();
        self.accepted().all(|(number, _)| {
            let squared = problem.squared_error(number);
            squared.is_none_or(|squared| squared <= refuted_chi2)
        })
    }

    fn closures(&self) -> impl Iterator<Item = (u32, &Constraint)> {
        let all = self.graph.constraints.slab.iter();
        all.filter(|(_, constraint)| constraint.is_closure())
    }

    pub(super) fn accepted(&self) -> impl Iterator<Item = (u32, &Constraint)> {
        self.closures()
            .filter(|(_, constraint)| constraint.is_accepted())
    }

    fn set_state(&mut self, number: u32, state: ClosureState) {
        let (constraints, revision) = (&mut self.graph.constraints.slab, self.graph.revision);
        if let Some(constraint) = constraints.get_mut(number, revision) {
            constraint.state = state;
        }
    }
}

/// A copy whose closures were judged, relaxed.
pub(super) struct RelaxedCopy {
    pub(super) copy: RelaxationCopy,
    pub(super) problem: Problem,
    pub(super) statistics: Relaxed,
}

impl RelaxedCopy {
    fn of(mut copy: RelaxationCopy) -> Self {
        let (problem, statistics) = copy.relax();
        Self {
            copy,
            problem,
            statistics,
        }
    }

    /// The poses of the agents in the map in a relaxed graph.
    ///
    /// They prevail over what the agents' filters hold where closures were judged by their
    /// evidence; not where closures were accepted as they came, for a robot that recognises what
    /// it cannot see may have been carried off.
    pub(super) fn corrections(&self, prevail: bool) -> Vec<Correction> {
        let problem = &self.problem;
        let marginals = problem.map.marginals();
        let mut corrections = Vec::new();
        for (agent, track) in (0..).zip(self.copy.graph.chains.tracks.iter()) {
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
}

/// Settings of a relaxation with closures.
fn from_wide() -> RelaxationSettings {
    RelaxationSettings {
        graduation: Graduation::FromWide,
        ..RelaxationSettings::default()
    }
}
