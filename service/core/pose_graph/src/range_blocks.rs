//! What a distance adds to the normal equations.

use nalgebra::{Isometry3, Vector3, Vector6};

use super::link::SightingTarget;
use super::normal_blocks::NormalBlocks;
use geometry::se3;

/// Distance below which it has no direction \[m\].
const DIRECTION_DISTANCE_MIN_M: f64 = 1e-9;

/// The distance d = |p − a| of a target p from an antenna a, and its derivatives by the motions of
/// their nodes.
///
/// With the direction u from the antenna to the target, the antenna at l in the frame R of its pose
/// and the target at m in the frame S of its own:
///
/// ```text
/// ∂d/∂(ρ, φ)_from = −(Rᵀu, l × Rᵀu)      ∂d/∂(ρ, φ)_to = (Sᵀu, m × Sᵀu)
/// ```
///
/// A point moves along the axes of the map: S = 1, m = 0. Where both coincide, no direction is
/// better than another, and the derivatives are zero.
#[derive(Clone, Copy, Debug)]
pub(super) struct RangeError {
    pub(super) distance_m: f64,
    by_from: Vector6<f64>,
    by_to: Vector6<f64>,
}

impl RangeError {
    pub(super) fn new(
        (from, to): (&Isometry3<f64>, &Isometry3<f64>),
        antenna: &Vector3<f64>,
        target: SightingTarget,
    ) -> Self {
        let lever = target.lever();
        let antenna_at = from.translation.vector + from.rotation * antenna;
        let apart = to.translation.vector + to.rotation * lever - antenna_at;
        let distance_m = apart.norm();
        let direction = if distance_m > DIRECTION_DISTANCE_MIN_M {
            apart / distance_m
        } else {
            Vector3::zeros()
        };
        let seen = from.rotation.inverse_transform_vector(&direction);
        let by_to = match target {
            SightingTarget::Point(_) => se3::join(&direction, &Vector3::zeros()),
            SightingTarget::Pose(_) | SightingTarget::PointOf(..) => {
                let seen = to.rotation.inverse_transform_vector(&direction);
                se3::join(&seen, &lever.cross(&seen))
            }
        };
        Self {
            distance_m,
            by_from: -se3::join(&seen, &antenna.cross(&seen)),
            by_to,
        }
    }
}

/// The blocks of a distance that was measured to be `range_m`.
pub(super) fn range_blocks(
    error: &RangeError,
    range_m: f64,
    information: f64,
    weigh: impl Fn(f64) -> f64,
) -> NormalBlocks {
    let residual = error.distance_m - range_m;
    let weighted = information * weigh(residual * residual * information);
    let RangeError { by_from, by_to, .. } = error;
    NormalBlocks {
        from_from: by_from * by_from.transpose() * weighted,
        to_from: by_to * by_from.transpose() * weighted,
        to_to: by_to * by_to.transpose() * weighted,
        from_gradient: by_from * (residual * weighted),
        to_gradient: by_to * (residual * weighted),
        by_calibration: None,
    }
}
