//! How noisy an agent's odometry is, as its loop closures show.

use super::chains::Chains;
use super::constraint::Constraint;
use super::evidence::Chance;
use super::problem::{Among, Calibrating, Problem};
use super::relaxation::RelaxationCopy;
use super::tuning;
use pose_graph::RelaxationSettings;

impl RelaxationCopy {
    /// Lets an agent's noise of rotations become half or twice what it is taken for, where that
    /// makes all measurements together more probable (the evidence of the model: `MacKay` 1992).
    pub(super) fn learn_odometry_noise(&mut self, agent: u32) {
        let track = self.graph().chains.track(agent);
        if track.is_none_or(|track| track.states_noise) {
            return;
        }
        let now = self.log_evidence(agent);
        for factor in [0.5, 2.0] {
            let mut other = self.graph().clone();
            let revision = other.revision;
            let Some(track) = other.chains.track_mut(agent, revision) else {
                return;
            };
            track.turn_noise *= factor;
            if !tuning::TURN_NOISE_BOUNDS.contains(&track.turn_noise) {
                continue;
            }
            let other = Self::of(other);
            if other.log_evidence(agent) > now {
                *self = other;
                return;
            }
        }
    }

    /// Log of the probability density of all measurements, up to a constant, by Laplace's
    /// approximation about the most probable map: with its χ², the matrix H of its normal
    /// equations, and the factor s of an agent's noise in n rotations
    ///
    /// ```text
    /// ln p = −½ χ² − ½ ln |H| − n ln s − ½ (ln s / ln 10)²
    /// ```
    fn log_evidence(&self, agent: u32) -> f64 {
        let mut problem = Problem::new(self.graph(), Among::Accepted, Calibrating::Free);
        problem.map.relax(&RelaxationSettings::default());
        let chains = &self.graph().chains;
        let Some(track) = chains.track(agent) else {
            return f64::NEG_INFINITY;
        };
        let ln_scale = track.turn_noise.ln();
        let n_turns = turns(chains, agent, track.is_planar);
        let prior = (ln_scale / tuning::TURN_NOISE_PRIOR_SD.ln()).powi(2);
        -0.5 * (problem.map.chi_squared() + problem.map.marginals().log_determinant() + prior)
            - n_turns * ln_scale
    }
}

impl RelaxationCopy {
    /// Log of the probability density of all measurements, up to a constant that is that of the
    /// graph: as [`learn_odometry_noise`](Self::learn_odometry_noise) compares it, and of each
    /// run of accepted closures how much more probable it is by the map than by chance.
    ///
    /// A run is one claim, so the one in its middle counts: else a false run that odometry can be
    /// bent to would outweigh many true ones.
    pub(super) fn log_probability(&self, problem: &Problem) -> f64 {
        let copy = self.of_middles(problem);
        let mut problem = Problem::new(copy.graph(), Among::Accepted, Calibrating::Free);
        problem.map.relax(&RelaxationSettings::default());
        let chance = Chance::of(&self.graph().chains, &problem);
        let gain = |(_, closure): (u32, &Constraint)| {
            chance.log_gain(closure, self.graph().is_planar(closure), &problem)
        };
        let closures = copy.accepted().map(gain);
        let chains = &self.graph().chains;
        let noise = { (0..).zip(chains.tracks.iter()) }
            .filter(|(_, track)| track.is_in_map())
            .map(|(agent, track)| turns(chains, agent, track.is_planar) * track.turn_noise.ln());
        let misfit = problem.map.chi_squared() + problem.map.marginals().log_determinant();
        closures.sum::<f64>() - 0.5 * misfit - noise.sum::<f64>()
    }

    /// Log of the share that matches of views leave of the maps that were possible without them, by
    /// Laplace's approximation about a relaxed map: with the matrices H and H₀ of the normal
    /// equations with and without them
    ///
    /// ```text
    /// ln v = −½ ln |H| + ½ ln |H₀|
    /// ```
    pub(super) fn log_volume_matched(&self) -> f64 {
        if self.graph().matches.is_empty() {
            return 0.0;
        }
        let mut problem = Problem::new(self.graph(), Among::Accepted, Calibrating::Free);
        problem.map.relax(&RelaxationSettings::default());
        let matched = problem.map.marginals().log_determinant();
        problem.switch_off_matches();
        0.5 * (problem.map.marginals().log_determinant() - matched)
    }
}

/// Number of rotations about an axis that odometry of an agent measured.
fn turns(chains: &Chains, agent: u32, is_planar: bool) -> f64 {
    let motions = chains
        .of_agent(agent)
        .filter(|(_, keyframe)| !keyframe.begins);
    let axes = if is_planar { 1.0 } else { 3.0 };
    motions.count() as f64 * axes
}
