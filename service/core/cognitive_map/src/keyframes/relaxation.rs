//! A copy of the keyframe graph in which closures are judged and keyframes are moved.

use nalgebra::Isometry3;

use super::constraint::{ClosureState, Constraint, composed};
use super::graph::KeyframeGraph;
use super::evidence::{Chance, log_evidence};
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
            let n_new = self.accept_evident(&mut runs);
            n_accepted += n_new;
            if n_new == 0 || runs.is_empty() {
                break;
            }
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

    /// Accepts the runs that are evident by the map; or, where there is none, some that are evident
    /// together. Takes them out of the list; answers the number of their closures.
    fn accept_evident(&mut self, runs: &mut Vec<Run>) -> usize {
        let evidence = self.evidence(runs);
        let evident = |&(_, odds): &(usize, f64)| odds >= tuning::ACCEPTED_LOG_ODDS;
        let mut chosen: Vec<usize> = evidence.iter().filter(|e| evident(e)).map(|e| e.0).collect();
        if chosen.is_empty() {
            let mut seeds = evidence;
            seeds.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
            for &(seed, odds) in seeds.iter().take(tuning::SEEDS_MAX) {
                let mut trial = Self(self.0.clone());
                trial.accept_run(&runs[seed]);
                trial.relax();
                let mut odds = odds;
                let others = trial.evidence(runs).into_iter();
                let others = others.filter(|other| other.0 != seed && evident(other));
                let mut together = vec![seed];
                for (other, more) in others {
                    together.push(other);
                    odds += more;
                }
                if together.len() > 1 && odds >= tuning::ACCEPTED_LOG_ODDS {
                    chosen = together;
                    break;
                }
            }
        }
        let mut n_accepted = 0;
        let mut agents = std::collections::BTreeSet::new();
        for &index in &chosen {
            if let Some(c)=self.0.constraints.slab.get(runs[index].middle) && let Some(k)=self.0.chains.keyframes.get(c.from) { agents.insert(k.agent); }
            n_accepted += self.accept_run(&runs[index]);
        }
        let mut index = 0;
        runs.retain(|_| {
            index += 1;
            !chosen.contains(&(index - 1))
        });
        if n_accepted > 0 {
            self.relax();
            for agent in agents {
                self.learn_odometry_noise(agent);
                if std::env::var("DBG").is_ok() { eprintln!("turn noise {:?} acc {}", self.0.chains.track(agent).map(|t| t.turn_noise), self.accepted().count()); }
            }
        }
        n_accepted
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
    pub(super) fn corrections(&self, problem: &Problem) -> Vec<Correction> {
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
                prevails: true,
            };
            if std::env::var("DBG").is_ok() { if let Some((c,v)) = &estimate.calibration { eprintln!("t {:.0} kf {} acc {} c {:.4} {:.4} {:.5} sd {:.4} {:.4} {:.5}", track.stamp_ns as f64/1e9, self.0.n_keyframes(), self.accepted().count(), c.length, c.angle, c.bias_rad_s.z, v[0].sqrt(), v[1].sqrt(), v[4].sqrt()); } }
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

    fn accepted(&self) -> impl Iterator<Item = (u32, &Constraint)> {
        self.closures()
            .filter(|(_, constraint)| constraint.state == ClosureState::Accepted)
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
