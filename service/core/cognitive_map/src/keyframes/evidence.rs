//! Evidence: how much more probable a loop closure is by the map than by chance.

use std::f64::consts::TAU;

use nalgebra::{Matrix2, Matrix6, Vector2, Vector3};

use super::chains::Chains;
use super::constraint::Constraint;
use super::problem::Problem;
use super::tuning;
use geometry::{planar_part, se3};
use pose_graph::Marginals;

/// Where a false closure leads: to any earlier place.
///
/// The log-probability density of the displacement that a false closure states is that of the
/// displacements between places of the map, as a normal distribution, in any direction.
pub(super) struct Chance {
    log_density: f64,
}

impl Chance {
    /// Of a map.
    pub(super) fn of(chains: &Chains, problem: &Problem) -> Self {
        let numbers = 0..chains.keyframes.numbers();
        let places: Vec<Vector2<f64>> = numbers
            .filter_map(|number| Some(problem.pose(number)?.translation.vector.xy()))
            .collect();
        let n = places.len().max(1) as f64;
        let mean = places.iter().sum::<Vector2<f64>>() / n;
        let spread = |sum: Matrix2<f64>, place: &Vector2<f64>| {
            let off = place - mean;
            sum + off * off.transpose()
        };
        let least = tuning::CHANCE_SD_MIN_M * tuning::CHANCE_SD_MIN_M;
        let covariance = places.iter().fold(Matrix2::zeros(), spread) / n
            + Matrix2::from_diagonal_element(least);
        // The displacement of two places has twice the covariance of one.
        let area_m2 = TAU * (covariance * 2.0).determinant().sqrt();
        Self {
            log_density: -(area_m2 * TAU).ln(),
        }
    }

    /// Log of the ratio between the probability density of a closure that fits exactly and that by
    /// chance.
    pub(super) fn log_gain(&self, closure: &Constraint) -> f64 {
        let least = tuning::CLOSURE_SD_MIN * tuning::CLOSURE_SD_MIN;
        let own = closure.covariance.matrix() + Matrix6::from_diagonal_element(least);
        let volume = (TAU.powi(3) * planar_part(&own).determinant()).sqrt();
        -volume.ln() - self.log_density
    }
}

/// Log of the ratio between the probability density of a closure by the map and that by chance; and
/// `None` if the map does not know one of its ends.
///
/// ```text
/// ln N(d; 0, S + R) − ln p₀        d = log(T_expected⁻¹ T_stated)
/// ```
///
/// with the covariance S of what the map expects, which lasting errors of odometry are part of, and
/// that of the closure, R: only in the plane, where nearly all motion is.
pub(super) fn log_evidence(
    constraint: &Constraint,
    problem: &Problem,
    marginals: &Marginals<'_>,
    chance: &Chance,
) -> Option<f64> {
    let from = problem.node(constraint.from)?;
    let to = problem.node(constraint.to)?;
    let expected = problem.map.pose(from).inv_mul(problem.map.pose(to));
    let off = se3::twist(&expected.inv_mul(&constraint.transform));
    let spread = marginals.relative_pose(from, to)?;
    let least = tuning::CLOSURE_SD_MIN * tuning::CLOSURE_SD_MIN;
    let whole: Matrix6<f64> =
        spread.matrix() + constraint.covariance.matrix() + Matrix6::from_diagonal_element(least);
    let planar = planar_part(&whole);
    let off = Vector3::new(off[0], off[1], off[5]);
    let squared = off.dot(&(planar.try_inverse()? * off));
    let volume = (TAU.powi(3) * planar.determinant()).sqrt();
    Some(-0.5 * squared - volume.ln() - chance.log_density)
}
