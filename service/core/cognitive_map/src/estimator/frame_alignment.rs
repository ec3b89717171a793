//! Alignment of two frames: the rigid motion of least squares between points known in both.

use nalgebra::{Isometry3, Matrix3, Matrix6, Point3, Vector3};

use super::tuning::{
    ALIGNMENT_AGREEING_MIN, ALIGNMENT_POINTS_MIN, ALIGNMENT_ROTATION_SD_MAX_RAD, ALIGNMENT_ROUNDS,
    ALIGNMENT_SOFT, ALIGNMENT_WIDENING,
};
use geometry::{align, centre, from_blocks, se3};

/// A point known in two frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PointPair {
    /// In the frame that stays \[m\].
    pub(super) older: Point3<f64>,
    /// In the frame that is merged into it \[m\].
    pub(super) newer: Point3<f64>,
    /// Variance of their distance along an axis \[m²\].
    pub(super) variance: f64,
}

/// A rigid motion with the covariance of its error (right perturbation).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct FrameAlignment {
    /// Pose of the newer frame in the older one.
    pub(super) pose: Isometry3<f64>,
    pub(super) covariance: Matrix6<f64>,
}

/// Finds the motion, if enough points agree on one (weighted least squares after Horn 1987, weights
/// after Cauchy). Between planar frames only a motion in the plane is sought.
pub(super) fn align_frames(pairs: &[PointPair], is_planar: bool) -> Option<FrameAlignment> {
    let points_min = if is_planar {
        ALIGNMENT_POINTS_MIN.0
    } else {
        ALIGNMENT_POINTS_MIN.1
    };
    if pairs.len() < points_min {
        return None;
    }
    let mut weights: Vec<f64> = pairs.iter().map(|pair| 1.0 / pair.variance).collect();
    let points: Vec<_> = pairs.iter().map(|pair| (pair.older, pair.newer)).collect();
    let mut pose = align(&points, &weights, is_planar)?;
    for _ in 0..ALIGNMENT_ROUNDS {
        for (weight, pair) in weights.iter_mut().zip(pairs) {
            let squared = (pose * pair.newer - pair.older).norm_squared() / pair.variance;
            *weight = 1.0 / (pair.variance * (1.0 + squared / (ALIGNMENT_SOFT * ALIGNMENT_SOFT)));
        }
        pose = align(&points, &weights, is_planar)?;
    }
    let agrees = |pair: &&PointPair| {
        let squared = (pose * pair.newer - pair.older).norm_squared() / pair.variance;
        squared <= (2.0 * ALIGNMENT_SOFT) * (2.0 * ALIGNMENT_SOFT)
    };
    let agreeing = pairs.iter().filter(agrees).count();
    if agreeing < points_min || (agreeing as f64) < ALIGNMENT_AGREEING_MIN * pairs.len() as f64 {
        return None;
    }
    let total: f64 = weights.iter().sum();
    let centre = centre(pairs.iter().map(|pair| pair.newer.coords), &weights);
    // Information about a rotation: the squared lever about its axis.
    let mut information = Matrix3::zeros();
    for (pair, &weight) in pairs.iter().zip(&weights) {
        let lever = (pair.newer.coords - centre).cross_matrix();
        information += lever.transpose() * lever * weight;
    }
    let rotation = if is_planar {
        let about_z = information[(2, 2)];
        Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, 1.0 / about_z))
    } else {
        information.try_inverse()?
    };
    let sd = rotation.diagonal().amax().sqrt();
    if sd.is_nan() || sd > ALIGNMENT_ROTATION_SD_MAX_RAD {
        return None;
    }
    // The error is stated at the origin, not at the centre: ρ₀ = ρ + c × φ.
    let across = 1.0 / total;
    let height = if is_planar { 0.0 } else { across };
    let position = Matrix3::from_diagonal(&Vector3::new(across, across, height));
    let lever = centre.cross_matrix();
    let mixed = lever * rotation;
    let position = position + mixed * lever.transpose();
    let covariance = from_blocks(&position, &mixed, &mixed.transpose(), &rotation);
    let covariance =
        (covariance + covariance.transpose()) * (0.5 * ALIGNMENT_WIDENING * ALIGNMENT_WIDENING);
    Some(FrameAlignment { pose, covariance })
}

/// Jacobian of the error of a point of the newer frame with respect to the error τ of the
/// alignment, in three rows: | I  −l× |.
pub(super) fn point_by_alignment(point: &Point3<f64>) -> Matrix6<f64> {
    let (one, zero) = (Matrix3::identity(), Matrix3::zeros());
    from_blocks(&one, &-point.coords.cross_matrix(), &zero, &zero)
}

/// Jacobian of the error of a pose of the newer frame with respect to τ: `Ad(T_b⁻¹)`.
pub(super) fn pose_by_alignment(pose: &Isometry3<f64>) -> Matrix6<f64> {
    se3::adjoint(&pose.inverse())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn pairs(pose: &Isometry3<f64>, points: &[[f64; 3]]) -> Vec<PointPair> {
        let pair = |point: &[f64; 3]| PointPair {
            older: pose * Point3::from(*point),
            newer: Point3::from(*point),
            variance: 0.01,
        };
        points.iter().map(pair).collect()
    }

    const FLOOR: [[f64; 3]; 5] = [
        [0.0, 0.0, 0.0],
        [3.0, 0.5, 0.0],
        [1.0, 4.0, 0.0],
        [-2.0, 2.0, 0.0],
        [-1.0, -3.0, 0.0],
    ];

    proptest! {
        #[test]
        fn motions_in_space_are_found(
            shift in prop::array::uniform3(-9.0..9.0_f64),
            turn in prop::array::uniform3(-1.8..1.8_f64),
        ) {
            let pose = Isometry3::new(shift.into(), turn.into());
            let mut points = FLOOR.to_vec();
            points.push([0.5, 0.5, 2.0]);
            let found = align_frames(&pairs(&pose, &points), false).unwrap();
            prop_assert!((found.pose.to_homogeneous() - pose.to_homogeneous()).amax() < 1e-9);
        }

        #[test]
        fn a_wrong_point_does_not_bend_a_motion_in_the_plane(
            x in -9.0..9.0_f64, y in -9.0..9.0_f64, heading in -3.1..3.1_f64, wrong in 0usize..5,
        ) {
            let pose = Isometry3::new(Vector3::new(x, y, 0.0), Vector3::z() * heading);
            let mut pairs = pairs(&pose, &FLOOR);
            pairs[wrong].older.x += 2.0;
            let found = align_frames(&pairs, true).unwrap();
            let rest = found.pose.inv_mul(&pose);
            prop_assert!(rest.translation.vector.norm() < 0.1 && rest.rotation.angle() < 0.05);
        }
    }

    #[test]
    fn too_little_ties_nothing() {
        let pose = Isometry3::translation(1.0, 2.0, 0.0);
        assert_eq!(align_frames(&pairs(&pose, &FLOOR[..2]), true), None);
        let line = [0.0, 1.0, 2.0, 3.0, 4.0].map(|x| [x, 2.0 * x, -x]);
        assert_eq!(
            align_frames(&pairs(&pose, &line), false),
            None,
            "it may turn about itself"
        );
        let close: Vec<_> = FLOOR.iter().map(|point| point.map(|x| 0.02 * x)).collect();
        assert_eq!(align_frames(&pairs(&pose, &close), true), None);
        let mut contradictory = pairs(&pose, &FLOOR);
        for (k, pair) in contradictory.iter_mut().enumerate() {
            pair.older.y += 3.0 * (k % 2) as f64;
            pair.older.x -= 3.0 * (k % 3) as f64;
        }
        assert_eq!(align_frames(&contradictory, true), None);
    }
}
