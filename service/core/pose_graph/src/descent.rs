//! Shorter steps, where the full one leads too far.

use nalgebra::Vector6;

use super::elimination::{dot, slot};
use super::equations::NormalEquations;

/// The step along the steepest descent, and the scale in which steps are measured.
///
/// With the gradient g and the curvatures D² = diag H, the step is −τ D⁻² g with the τ at which the
/// cost's second-order model is least. Lengths are |D δ|: so metres and radians compare by what
/// they cost.
#[derive(Debug)]
pub(super) struct SteepestDescent {
    gradient: Vec<f64>,
    /// D².
    curvature: Vec<f64>,
    step: Vec<f64>,
    /// sᵀ H s of that step.
    step_curved: f64,
}

impl SteepestDescent {
    /// At the poses of the equations.
    pub(super) fn new(equations: &NormalEquations<'_>) -> Self {
        equations.keep();
        let n = slot(equations.map.nodes.len(), 0, 1);
        let (mut gradient, mut curvature) = (vec![0.0; n], vec![0.0; n]);
        equations.for_each_link(|[from, to], calibration, blocks| {
            equations.gather(to, &blocks.to_gradient, &mut gradient);
            equations.gather(to, &blocks.to_to.diagonal(), &mut curvature);
            equations.gather(from, &blocks.from_gradient, &mut gradient);
            equations.gather(from, &blocks.from_from.diagonal(), &mut curvature);
            if let Some((node, blocks)) = calibration.zip(blocks.by_calibration.as_ref()) {
                equations.gather(node, &blocks.gradient, &mut gradient);
                equations.gather(node, &blocks.own.diagonal(), &mut curvature);
            }
        });
        let direction: Vec<f64> = gradient
            .iter()
            .zip(&curvature)
            .map(|(g, c)| if *c > 0.0 { -g / c } else { 0.0 })
            .collect();
        let slope: f64 = -dot(&gradient, &direction);
        let curved = quadratic_form(equations, &direction);
        let stride = if curved > 0.0 { slope / curved } else { 0.0 };
        let step = direction.into_iter().map(|along| along * stride).collect();
        Self {
            gradient,
            curvature,
            step,
            step_curved: stride * stride * curved,
        }
    }

    /// |D δ|.
    pub(super) fn length(&self, step: &[f64]) -> f64 {
        step.iter()
            .zip(&self.curvature)
            .map(|(x, c)| x * x * c)
            .sum::<f64>()
            .sqrt()
    }

    /// The step within `radius` on the way along the steepest descent and then on to the `newton`
    /// step, and by how much it is expected to lower the cost.
    ///
    /// Both are combinations δ = α s + β n. The `newton` step solves H n = −g, so what it is
    /// expected to bring, −2 gᵀδ − δᵀ H δ, needs no product with H:
    ///
    /// ```text
    /// −2 (α gᵀs + β gᵀn) − α² sᵀ H s + 2 α β gᵀs + β² gᵀn
    /// ```
    pub(super) fn dogleg(&self, newton: &[f64], radius: f64) -> (Vec<f64>, f64) {
        let (alpha, beta) = self.shares(newton, radius);
        let step = self.step.iter().zip(newton);
        let step: Vec<f64> = step.map(|(s, n)| alpha * s + beta * n).collect();
        let (along, along_newton) = (dot(&self.gradient, &self.step), dot(&self.gradient, newton));
        let linear = alpha * along + beta * along_newton;
        let curved = alpha * alpha * self.step_curved
            - 2.0 * alpha * beta * along
            - beta * beta * along_newton;
        (step, -2.0 * linear - curved)
    }

    /// The shares α of the steepest descent and β of the `newton` step in a step of at most this
    /// length.
    fn shares(&self, newton: &[f64], radius: f64) -> (f64, f64) {
        let steepest_length = self.length(&self.step);
        if self.length(newton) <= radius {
            return (0.0, 1.0);
        }
        if steepest_length >= radius {
            return (radius / steepest_length, 0.0);
        }
        // |D (s + β (n − s))|² = r², a quadratic equation for β in [0, 1].
        let (mut square, mut mixed) = (0.0, 0.0);
        for ((s, n), c) in self.step.iter().zip(newton).zip(&self.curvature) {
            let rest = n - s;
            square += rest * rest * c;
            mixed += s * rest * c;
        }
        let missing = radius * radius - steepest_length * steepest_length;
        let beta = missing / (mixed + (mixed * mixed + square * missing).sqrt());
        (1.0 - beta, beta)
    }
}

/// δᵀ H δ.
fn quadratic_form(equations: &NormalEquations<'_>, step: &[f64]) -> f64 {
    let mut sum = 0.0;
    equations.for_each_link(|[from, to], calibration, blocks| {
        let (from_step, to_step) = (equations.twist(from, step), equations.twist(to, step));
        sum += to_step.dot(&(blocks.to_to * to_step));
        sum += 2.0 * to_step.dot(&(blocks.to_from * from_step));
        sum += from_step.dot(&(blocks.from_from * from_step));
        if let Some((node, blocks)) = calibration.zip(blocks.by_calibration.as_ref()) {
            let step = equations.twist(node, step);
            sum += step.dot(&(blocks.own * step));
            sum += 2.0 * from_step.dot(&(blocks.from * step));
            sum += 2.0 * to_step.dot(&(blocks.to * step));
        }
    });
    sum
}

impl NormalEquations<'_> {
    /// The unknowns of a node in their places in a twist.
    fn twist(&self, node: u32, step: &[f64]) -> Vector6<f64> {
        self.map.nodes[node as usize].twist(&step[slot(node as usize, 0, 1)..])
    }

    /// Adds the components that are unknowns of a node to those of all nodes.
    fn gather(&self, node: u32, twist: &Vector6<f64>, sums: &mut [f64]) {
        let axes = self.map.nodes[node as usize].axes();
        for (&axis, sum) in axes.iter().zip(&mut sums[slot(node as usize, 0, 1)..]) {
            *sum += twist[axis];
        }
    }
}

#[cfg(test)]
mod tests;
