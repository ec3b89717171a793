//! Moving all nodes to where the links cost least.

use nalgebra::Isometry3;

use super::elimination::{CliqueTree, slot};
use super::equations::NormalEquations;
use super::map::ExperienceMap;
use super::rotation_first;

/// From where a relaxation starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// From the nodes' places.
    Here,
    /// From the rotations and then the positions that the links agree on to first order, whatever the nodes'
    /// places are. Every link counts there as if it were right.
    RotationFirst,
}

/// How a map is relaxed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelaxationSettings {
    /// From where.
    pub start: Start,
    /// Steps at most.
    pub steps_max: usize,
    /// The relaxation ends with a step that was expected to lower χ² by less than this share of it.
    pub tolerance: f64,
}

impl Default for RelaxationSettings {
    fn default() -> Self {
        Self {
            start: Start::Here,
            steps_max: 100,
            tolerance: 1e-5,
        }
    }
}

/// What a relaxation did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxed {
    /// Steps taken or tried.
    pub n_steps: usize,
    /// χ² at the start.
    pub chi_squared_at_start: f64,
    /// χ² now.
    pub chi_squared: f64,
    /// Whether the last step was expected to be of no account.
    pub has_converged: bool,
    /// Directions in which the links leave the map free, and in which it was not moved.
    pub n_undetermined: usize,
}

impl ExperienceMap {
    /// Moves all nodes to the nearest places at which χ² is least: Gauss–Newton steps inside a trust region (Powell's
    /// dogleg; Nocedal & Wright 2006, Sec. 4.1).
    ///
    /// Of a part that nothing ties to `map` the directions that no link determines are not moved.
    pub fn relax(&mut self, settings: &RelaxationSettings) -> Relaxed {
        let here = || self.nodes.iter().map(|node| node.pose).collect();
        let mut tree = CliqueTree::structured(
            &NormalEquations {
                map: self,
                poses: &[],
                widening: 1.0,
            },
            self.nodes.len(),
        );
        let order = tree.all();
        let poses = match settings.start {
            Start::Here => here(),
            Start::RotationFirst => rotation_first::start(self, &tree),
        };
        let cost = |poses: &[Isometry3<f64>]| self.cost(|node| &poses[node as usize], 1.0);
        let mut now = poses;
        let chi_squared_at_start = cost(&now);
        let mut report = Relaxed {
            n_steps: 0,
            chi_squared_at_start,
            chi_squared: chi_squared_at_start,
            has_converged: false,
            n_undetermined: 0,
        };
        while report.n_steps < settings.steps_max && !report.has_converged {
            report.n_steps += 1;
            let equations = NormalEquations {
                map: self,
                poses: &now,
                widening: 1.0,
            };
            report.n_undetermined = tree.refactor(&equations, &order);
            let step = tree.solve();
            let next = self.moved(&now, &step);
            let chi_squared = cost(&next);
            let expected = tree.explained();
            report.has_converged = expected <= settings.tolerance * report.chi_squared;
            if chi_squared < report.chi_squared {
                report.chi_squared = chi_squared;
                now = next;
            } else {
                break;
            }
        }
        for (node, pose) in self.nodes.iter_mut().zip(now) {
            node.pose = pose;
        }
        report
    }

    /// The poses after a step of all nodes.
    fn moved(&self, poses: &[Isometry3<f64>], step: &[f64]) -> Vec<Isometry3<f64>> {
        let nodes = self.nodes.iter().zip(poses).enumerate();
        let moved = nodes.map(|(index, (node, pose))| node.moved(pose, &step[slot(index, 0, 1)..]));
        moved.collect()
    }
}
