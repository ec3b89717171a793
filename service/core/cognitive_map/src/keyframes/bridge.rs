//! The poses on a way between two that are known.

use nalgebra::{Isometry3, Matrix6};

use super::tuning;
use geometry::{PoseCovariance, se3};

/// A motion and the covariance of the error on its right.
pub(super) type Motion = (Isometry3<f64>, PoseCovariance);

/// Where a way most likely leads past that begins at one pose and ends at another: one pose after
/// each motion but the last.
///
/// The motions m₁ … mₙ miss the end by ε, in its frame. An error ηⱼ of one moves the end by Aⱼ ηⱼ,
/// with the adjoint Aⱼ of the way back from there; the likeliest errors that add up to ε are
/// ηⱼ = Qⱼ Aⱼᵀ (Σ Aₖ Qₖ Aₖᵀ)⁻¹ ε. What is left, since that is first order, is shared in the same
/// way once more.
pub(super) fn bridge(
    from: &Isometry3<f64>,
    motions: &[Motion],
    to: &Isometry3<f64>,
) -> Vec<Isometry3<f64>> {
    let mut likeliest: Vec<_> = motions.iter().map(|(motion, _)| *motion).collect();
    if likeliest.len() > 1 {
        for _ in 0..tuning::BRIDGE_ROUNDS {
            share(from, &mut likeliest, motions, to);
        }
    }
    likeliest.pop();
    let mut pose = *from;
    let along = likeliest.iter().map(|motion| {
        pose *= motion;
        pose.rotation.renormalize_fast();
        pose
    });
    along.collect()
}

/// Shares what motions miss the end by among them, by their covariances.
fn share(
    from: &Isometry3<f64>,
    likeliest: &mut [Isometry3<f64>],
    motions: &[Motion],
    to: &Isometry3<f64>,
) {
    let floor = Matrix6::from_diagonal_element(tuning::MOTION_SD_MIN * tuning::MOTION_SD_MIN);
    let mut to_end = Isometry3::identity();
    let mut all = Matrix6::zeros();
    // Aⱼ Qⱼ, the last one first.
    let mut moved = Vec::with_capacity(motions.len());
    for (motion, (_, covariance)) in likeliest.iter().zip(motions).rev() {
        let adjoint = se3::adjoint(&to_end.inverse());
        let one = adjoint * (covariance.matrix() + floor);
        all += one * adjoint.transpose();
        moved.push(one);
        to_end = motion * to_end;
    }
    let missed = se3::twist(&(from * to_end).inv_mul(to));
    let Some(weight) = all.cholesky().map(|all| all.solve(&missed)) else {
        return; // covariances too far from positive: the motions stay
    };
    for (motion, one) in likeliest.iter_mut().zip(moved.iter().rev()) {
        *motion = se3::plus(motion, &one.tr_mul(&weight));
    }
}

#[cfg(test)]
mod tests;
