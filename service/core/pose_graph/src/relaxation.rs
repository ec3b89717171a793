//! Moving all nodes to where the links cost least.

use nalgebra::Isometry3;

use super::descent::SteepestDescent;
use super::elimination::{CliqueTree, slot};
use super::equations::NormalEquations;
use super::graph::PoseGraph;
use super::rotation_first;

/// From where a relaxation starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// From the nodes' places.
    Here,
    /// From the rotations and then the positions that the links agree on to first order, whatever
    /// the nodes' places are. Every link counts there as if it were right.
    RotationFirst,
}

/// How the kernels of doubtful links are treated on the way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Graduation {
    /// They are what they are from the first step on: for graphs that nearly fit.
    None,
    /// Geman–McClure kernels begin so wide that χ² has hardly more than one minimum, and are
    /// narrowed by a factor of 1.4 in each step (Yang et al. 2020, "Graduated non-convexity for
    /// robust spatial perception"): for graphs of whose links many may be false.
    FromWide,
}

/// How a graph is relaxed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelaxationSettings {
    /// From where.
    pub start: Start,
    /// With which kernels.
    pub graduation: Graduation,
    /// Steps at most.
    pub steps_max: usize,
    /// The relaxation ends with a step that was expected to lower χ² by less than this share of it.
    pub tolerance: f64,
}

impl Default for RelaxationSettings {
    fn default() -> Self {
        Self {
            start: Start::Here,
            graduation: Graduation::None,
            steps_max: 100,
            tolerance: 1e-5,
        }
    }
}

/// Outcome of a relaxation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxed {
    /// Times the normal equations were solved.
    pub n_steps: usize,
    /// χ² at the start.
    pub chi_squared_at_start: f64,
    /// χ² now.
    pub chi_squared: f64,
    /// Whether the last step was expected to be of no account.
    pub has_converged: bool,
    /// Directions in which the links leave the graph free, and in which it was not moved.
    pub n_undetermined: usize,
}

/// By how much the kernels are narrowed in each step.
const NARROWING: f64 = 1.4;

/// A decrease of χ² that is none: where everything fits, χ² itself is rounding.
const NEGLIGIBLE: f64 = 1e-12;

/// Shorter steps tried in place of one that made things worse.
const TRIALS_MAX: usize = 16;

/// Share of the expected decrease from which on a step counts as good, and the region of trust
/// grows.
const GOOD_GAIN: f64 = 0.75;

/// … and below which the region shrinks.
const POOR_GAIN: f64 = 0.25;

impl PoseGraph {
    /// Moves all nodes to the nearest places at which χ² is least: Gauss–Newton steps inside a
    /// region of trust (Powell's dogleg; Nocedal & Wright 2006, Sec. 4.1).
    ///
    /// Of a part that nothing connects with `map` the directions that no link determines are not
    /// moved.
    pub fn relax(&mut self, settings: &RelaxationSettings) -> Relaxed {
        let structure = NormalEquations::new(self, &[], 1.0);
        let mut tree = CliqueTree::structured(&structure, self.nodes.len());
        let poses = match settings.start {
            Start::Here => self.nodes.iter().map(|node| node.pose).collect(),
            Start::RotationFirst => rotation_first::start(self, &tree),
        };
        let widening = match settings.graduation {
            Graduation::None => 1.0,
            Graduation::FromWide => self.widening(&poses),
        };
        let chi_squared = self.cost(|node| &poses[node as usize], 1.0);
        let mut report = Relaxed {
            n_steps: 0,
            chi_squared_at_start: chi_squared,
            chi_squared,
            has_converged: false,
            n_undetermined: 0,
        };
        let mut descent = Descent {
            map: self,
            tree: &mut tree,
            cost: self.cost(|node| &poses[node as usize], widening),
            poses,
            widening,
            radius: f64::INFINITY,
        };
        while report.n_steps < settings.steps_max && !report.has_converged {
            report.n_steps += 1;
            let is_final = descent.widening <= 1.0;
            let step = descent.step();
            report.n_undetermined = step.n_undetermined;
            let negligible = NEGLIGIBLE.max(settings.tolerance * step.cost);
            report.has_converged = is_final && step.expected <= negligible;
            if is_final && step.decrease <= 0.0 {
                break;
            }
            descent.narrow();
        }
        let poses = descent.poses;
        report.chi_squared = self.cost(|node| &poses[node as usize], 1.0);
        for (node, pose) in self.nodes.iter_mut().zip(poses) {
            node.pose = pose;
        }
        report
    }

    /// How wide Geman–McClure kernels have to be for the costs of all their links to be convex:
    /// k²/3 is where a cost stops being so.
    fn widening(&self, poses: &[Isometry3<f64>]) -> f64 {
        let mut widening = 1.0_f64;
        for slot in self.links.iter().filter(|slot| slot.is_on) {
            let s = slot.link.squared_error(|node| &poses[node as usize]);
            if let Some(square) = slot.kernel.graduated_square() {
                widening = widening.max(3.0 * s / square);
            }
        }
        widening
    }
}

/// A relaxation under way.
struct Descent<'a> {
    map: &'a PoseGraph,
    tree: &'a mut CliqueTree,
    poses: Vec<Isometry3<f64>>,
    widening: f64,
    /// At these poses, with kernels so wide.
    cost: f64,
    /// Of the region of trust, in units in which every unknown alone has the same curvature.
    radius: f64,
}

/// Outcome of a step.
struct Step {
    /// Cost before.
    cost: f64,
    /// By how much a full step was expected to lower it.
    expected: f64,
    /// By how much the step that was taken did; 0 if none was.
    decrease: f64,
    n_undetermined: usize,
}

impl Descent<'_> {
    /// Narrows kernels that are wide.
    fn narrow(&mut self) {
        if self.widening > 1.0 {
            self.widening = (self.widening / NARROWING).max(1.0);
            let pose = |node: u32| &self.poses[node as usize];
            self.cost = self.map.cost(pose, self.widening);
        }
    }

    /// Solves the normal equations once, and goes as far as the cost sinks.
    fn step(&mut self) -> Step {
        let equations = NormalEquations::new(self.map, &self.poses, self.widening);
        if self.radius.is_finite() {
            equations.keep();
        }
        let n_undetermined = self.tree.refactor(&equations, &self.tree.all());
        let newton = self.tree.solve();
        let mut step = Step {
            cost: self.cost,
            expected: self.tree.explained(),
            decrease: 0.0,
            n_undetermined,
        };
        // Nearly every full step is good; the region of trust costs something only once one was
        // not.
        let mut descent = None;
        if self.radius.is_finite() {
            descent = Some(SteepestDescent::new(&equations));
        }
        for _ in 0..TRIALS_MAX {
            let (tried, expected) = match &descent {
                None => (newton.clone(), step.expected),
                Some(descent) => descent.dogleg(&newton, self.radius),
            };
            let next = self.moved(&tried);
            let cost = self.map.cost(|node| &next[node as usize], self.widening);
            let decrease = self.cost - cost;
            let length = descent
                .as_ref()
                .map(|descent: &SteepestDescent| descent.length(&tried));
            if let Some(length) = length {
                if decrease < POOR_GAIN * expected {
                    self.radius = 0.25 * length;
                } else if decrease > GOOD_GAIN * expected && length > 0.99 * self.radius {
                    self.radius *= 2.0;
                }
            }
            if decrease > 0.0 {
                step.decrease = decrease;
                (self.poses, self.cost) = (next, cost);
                break;
            }
            if descent.is_none() {
                let steepest = SteepestDescent::new(&equations);
                self.radius = 0.25 * steepest.length(&newton);
                descent = Some(steepest);
            }
        }
        step
    }

    /// The poses after a step of all nodes.
    fn moved(&self, step: &[f64]) -> Vec<Isometry3<f64>> {
        let nodes = self.map.nodes.iter().zip(&self.poses).enumerate();
        nodes
            .map(|(index, (node, pose))| node.moved(pose, &step[slot(index, 0, 1)..]))
            .collect()
    }
}
