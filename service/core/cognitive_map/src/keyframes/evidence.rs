//! Evidence: how much more probable a loop closure is by the map than by chance.

use std::f64::consts::TAU;

use nalgebra::{Cholesky, Const, Isometry3, Matrix3, Matrix6, SMatrix, UnitQuaternion, Vector3};

use super::chains::Chains;
use super::constraint::Constraint;
use super::problem::Problem;
use super::tuning;
use geometry::{planar_part, se3, symmetric};
use pose_graph::Marginals;

/// Where a false closure leads: to any earlier place.
///
/// The log-probability density of the displacement that a false closure states is that of the
/// displacements between places of the map, as a normal distribution, in any direction.
pub(super) struct Chance {
    log_density: f64,
    /// Covariance of displacements in space \[m²\].
    displacements: Matrix3<f64>,
    /// Variance of how two places are tilted to one another, about each of two axes \[rad²\].
    tilts: f64,
}

impl Chance {
    /// Of a map.
    pub(super) fn of(chains: &Chains, problem: &Problem) -> Self {
        let numbers = 0..chains.keyframes.numbers();
        let poses = || { numbers.clone() }.filter_map(|number| problem.pose(number));
        let n = poses().count().max(1) as f64;
        let mean = { poses() }
            .map(|pose| pose.translation.vector)
            .sum::<Vector3<f64>>()
            / n;
        let spread = |sum: Matrix3<f64>, pose: &Isometry3<f64>| {
            let off = pose.translation.vector - mean;
            sum + off * off.transpose()
        };
        let least = tuning::CHANCE_SD_MIN_M * tuning::CHANCE_SD_MIN_M;
        let covariance = poses().fold(Matrix3::zeros(), spread) / n
            + Matrix3::from_diagonal(&Vector3::new(least, least, 0.0));
        // The displacement of two places has twice the covariance of one.
        let displacements = covariance * 2.0;
        let area_m2 = TAU * displacements.fixed_view::<2, 2>(0, 0).determinant().sqrt();
        // The mean direction of the vertical axes is as long as they are alike.
        let up = { poses() }.map(|pose| pose.rotation * Vector3::z());
        let alike = (up.sum::<Vector3<f64>>() / n).norm();
        Self {
            log_density: -(area_m2 * TAU).ln(),
            displacements,
            tilts: 2.0 * (1.0 - alike).max(0.0),
        }
    }

    /// Log of the ratio between the probability density of a closure that fits exactly and that by
    /// chance.
    pub(super) fn log_gain(&self, closure: &Constraint, is_planar: bool, problem: &Problem) -> f64 {
        let least = tuning::CLOSURE_SD_MIN * tuning::CLOSURE_SD_MIN;
        let own = closure.covariance.matrix() + Matrix6::from_diagonal_element(least);
        let gain = if is_planar {
            root(&planar_part(&own)).map(|root| peak_log(&root) - self.log_density)
        } else {
            let to = problem.pose(closure.to);
            let to = to.map_or_else(UnitQuaternion::identity, |to| to.rotation);
            let by_chance = self.log_density_in_space(&own, &to);
            by_chance.and_then(|by_chance| Some(peak_log(&root(&own)?) - by_chance))
        };
        // Of no covariance nothing is gained.
        gain.unwrap_or_default()
    }

    /// The log-density in space where a closure leads, where it is known but for a covariance about
    /// the body axes there what lies where: any heading, and no more tilted than places of the map.
    /// `None` if that is no covariance.
    ///
    /// Displacements are about the axes of the map, with z and the tilts first: those across a map
    /// may be ten orders of magnitude larger.
    fn log_density_in_space(&self, whole: &Matrix6<f64>, to: &UnitQuaternion<f64>) -> Option<f64> {
        let mut turn = Matrix6::identity();
        let axes = to.to_rotation_matrix().into_inner();
        turn.fixed_view_mut::<3, 3>(0, 0).copy_from(&axes);
        let mut known = turn * whole * turn.transpose();
        let mut displacements = known.fixed_view_mut::<3, 3>(0, 0);
        displacements += self.displacements;
        for k in 3..5 {
            known[(k, k)] += self.tilts;
        }
        let order = [2, 3, 4, 0, 1];
        let known = SMatrix::<f64, 5, 5>::from_fn(|row, column| known[(order[row], order[column])]);
        Some(peak_log(&root(&known)?) - TAU.ln())
    }
}

/// The Cholesky root of a covariance; `None` if it is none.
fn root<const N: usize>(covariance: &SMatrix<f64, N, N>) -> Option<Cholesky<f64, Const<N>>> {
    symmetric(covariance).cholesky()
}

/// Log of a normal distribution's density at its mean. A determinant may be rounded to a negative
/// one where a covariance is wide along some axes and narrow along others.
fn peak_log<const N: usize>(root: &Cholesky<f64, Const<N>>) -> f64 {
    -0.5 * N as f64 * TAU.ln() - root.l_dirty().diagonal().map(f64::ln).sum()
}

/// Log of the ratio between the probability density of a closure by the map and that by chance; and
/// `None` if the map does not know one of its ends, or what is known is no covariance.
///
/// ```text
/// ln N(d; 0, S + R) − ln p₀        d = log(T_expected⁻¹ T_stated)
/// ```
///
/// with the covariance S of what the map expects, which lasting errors of odometry are part of, and
/// that of the closure, R: of robots in the plane, only there.
pub(super) fn log_evidence(
    constraint: &Constraint,
    is_planar: bool,
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
    if is_planar {
        let root = root(&planar_part(&whole))?;
        let off = Vector3::new(off[0], off[1], off[5]);
        let squared = off.dot(&root.solve(&off));
        return Some(peak_log(&root) - 0.5 * squared - chance.log_density);
    }
    let root = root(&whole)?;
    let squared = off.dot(&root.solve(&off));
    let by_chance = chance.log_density_in_space(&whole, &problem.map.pose(to).rotation)?;
    Some(peak_log(&root) - 0.5 * squared - by_chance)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A map of this extent \[m\], of which the places are tilted by a tenth of a radian.
    fn chance(extent_m: f64) -> Chance {
        let displacements = Vector3::new(extent_m, 0.5 * extent_m, 2.0).map(|sd| sd * sd);
        Chance {
            log_density: 0.0,
            displacements: Matrix3::from_diagonal(&displacements),
            tilts: 0.01,
        }
    }

    fn known() -> Matrix6<f64> {
        let sd = [0.1, 0.2, 0.05, 0.02, 0.03, 0.04];
        let root = Matrix6::from_fn(|row, column| {
            if row == column {
                sd[row]
            } else {
                0.3 * sd[row] * (1.7 * row as f64 + 0.9 * column as f64).sin()
            }
        });
        root * root.transpose()
    }

    #[test]
    fn the_density_in_space_is_that_of_the_whole_covariance() {
        let (chance, known) = (chance(30.0), known());
        for to in [
            UnitQuaternion::identity(),
            UnitQuaternion::from_euler_angles(0.4, -0.3, 2.0),
            UnitQuaternion::from_euler_angles(3.0, 0.1, -1.0),
        ] {
            // About the axes of the body, where the displacements of the map are turned.
            let axes = to.inverse().to_rotation_matrix().into_inner();
            let mut whole = known.fixed_view::<5, 5>(0, 0).into_owned();
            let mut place = whole.fixed_view_mut::<3, 3>(0, 0);
            place += axes * chance.displacements * axes.transpose();
            whole[(3, 3)] += chance.tilts;
            whole[(4, 4)] += chance.tilts;
            let expected = -0.5 * (whole * TAU).determinant().ln() - TAU.ln();
            let found = chance.log_density_in_space(&known, &to).unwrap();
            assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        }
    }

    #[test]
    fn maps_as_wide_as_a_continent_have_one() {
        let to = UnitQuaternion::from_euler_angles(0.4, -0.3, 2.0);
        let density = |extent_m| {
            chance(extent_m)
                .log_density_in_space(&known(), &to)
                .unwrap()
        };
        // Ten times as wide and as long: a hundredth.
        for extent_m in [1e3, 1e5, 1e7] {
            let less = density(extent_m) - density(10.0 * extent_m);
            assert!((less - 100.0_f64.ln()).abs() < 1e-6, "{less}");
        }
    }

    #[test]
    fn a_density_is_as_high_as_its_covariance_is_narrow() {
        // Up to ten kilometres along a line that is askew, and a millimetre in all directions.
        let along = nalgebra::Vector6::from_fn(|axis, _| (1.3 * axis as f64 + 0.4).sin());
        let mut before = f64::INFINITY;
        for wide_m2 in [1e-6, 1.0, 1e4, 1e6, 1e8] {
            let own = along * along.transpose() * wide_m2 + Matrix6::from_diagonal_element(1e-6);
            let found = peak_log(&root(&own).expect("it is a covariance"));
            let eigenvalues = 5.0 * 1e-6_f64.ln() + (along.norm_squared() * wide_m2 + 1e-6).ln();
            let expected = -3.0 * TAU.ln() - 0.5 * eigenvalues;
            assert!((found - expected).abs() < 0.1, "{found} {expected}");
            assert!(found < before, "{found}");
            before = found;
        }
    }

    #[test]
    fn what_is_no_covariance_has_none() {
        let nobody = Matrix6::from_diagonal_element(f64::NAN);
        let to = UnitQuaternion::identity();
        assert_eq!(chance(30.0).log_density_in_space(&nobody, &to), None);
    }
}
