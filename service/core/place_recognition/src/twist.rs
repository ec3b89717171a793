//! Six numbers for a small motion: ξ = (ρ, φ), shift before turn.

use geometry::se3;
use nalgebra::{Isometry3, Vector6};

/// Logarithm of a motion \[m, rad\].
pub(crate) fn twist(motion: &Isometry3<f64>) -> Vector6<f64> {
    let (linear, angular) = se3::log(motion);
    Vector6::new(
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
    )
}

/// T exp(ξ): a pose after a perturbation on its right.
pub(crate) fn moved(pose: &Isometry3<f64>, twist: &Vector6<f64>) -> Isometry3<f64> {
    let (linear, angular) = (
        twist.fixed_rows::<3>(0).into_owned(),
        twist.fixed_rows::<3>(3).into_owned(),
    );
    let mut moved = pose * se3::exp(&linear, &angular);
    moved.rotation.renormalize_fast();
    moved
}
