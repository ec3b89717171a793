//! Levenberg–Marquardt over a pose.
//!
//! ```text
//! (H + λ diag H + μ I) ξ = −g        T ← T exp(ξ)
//! ```
//!
//! The damping λ falls fivefold with a step that lowers the cost, and rises tenfold with one that
//! does not (Marquardt 1963).

use geometry::se3::plus;
use nalgebra::{Isometry3, Matrix6, Vector6};

/// Cost of a pose, with its gradient and its Gauss–Newton Hessian (right perturbation).
pub(crate) struct NormalEquations {
    pub(crate) hessian: Matrix6<f64>,
    pub(crate) gradient: Vector6<f64>,
    pub(crate) cost: f64,
}

/// When a descent ends.
#[derive(Clone, Copy)]
pub(crate) struct Descent {
    /// Most steps.
    pub(crate) steps: usize,
    /// A step that lowers the cost by a smaller share is the last one.
    pub(crate) tolerance: f64,
    /// μ: constant damping.
    pub(crate) floor: f64,
}

impl Descent {
    /// Descends from a pose to a minimum; answers that and its cost.
    pub(crate) fn run(
        &self,
        start: &Isometry3<f64>,
        equations: impl Fn(&Isometry3<f64>) -> NormalEquations,
    ) -> (Isometry3<f64>, f64) {
        let mut pose = *start;
        let mut here = equations(&pose);
        let mut damping = 1e-3;
        for _ in 0..self.steps {
            let mut hessian = here.hessian;
            for k in 0..6 {
                hessian[(k, k)] = hessian[(k, k)] * (1.0 + damping) + self.floor;
            }
            let Some(factor) = hessian.cholesky() else {
                break;
            };
            let next = plus(&pose, &-factor.solve(&here.gradient));
            let there = equations(&next);
            if there.cost < here.cost {
                let is_done = here.cost - there.cost < self.tolerance * here.cost;
                (pose, here) = (next, there);
                damping *= 0.2;
                if is_done {
                    break;
                }
            } else {
                damping *= 10.0;
            }
        }
        (pose, here.cost)
    }
}
