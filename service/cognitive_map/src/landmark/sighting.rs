//! What a single sighting says about where its target is.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::PositionEstimate;
use super::estimate::symmetric;
use crate::geometry::PoseCovariance;
use crate::sample::{RangeBearing, Relation};

/// Variance that every sighting has at least \[m²\], i.e. a micrometre squared: without it two
/// sightings said to be free of error could contradict one another.
const VARIANCE_MIN_M2: f64 = 1e-12;

/// What a sighting from a pose says about the target's position in `map`.
///
/// With the pose T = (x, R), its right-perturbation covariance P, and the target at z with covariance
/// D in the body frame:
///
/// ```text
/// p = x + R z      Σ = R (D + J P Jᵀ) Rᵀ      J = | I  −z× |
/// ```
///
/// to first order.
pub(crate) fn seen(
    relation: &Relation,
    in_map: &Isometry3<f64>,
    pose_covariance: &PoseCovariance,
) -> PositionEstimate {
    let (target, noise) = in_body(relation);
    let pose = pose_covariance.matrix();
    let lever = target.cross_matrix();
    let position: Matrix3<f64> = pose.fixed_view::<3, 3>(0, 0).into_owned();
    let cross: Matrix3<f64> = pose.fixed_view::<3, 3>(0, 3).into_owned();
    let turn: Matrix3<f64> = pose.fixed_view::<3, 3>(3, 3).into_owned();
    // (−z×)ᵀ = z×
    let mixed = cross * lever;
    let from_pose = position + mixed + mixed.transpose() - lever * turn * lever;
    let rotation = in_map.rotation.to_rotation_matrix().into_inner();
    let covariance = rotation * (noise + from_pose) * rotation.transpose();
    PositionEstimate {
        position: in_map * Point3::from(target),
        covariance: symmetric(&covariance) + Matrix3::identity() * VARIANCE_MIN_M2,
    }
}

/// Position of a target in the body frame, with its covariance there.
fn in_body(relation: &Relation) -> (Vector3<f64>, Matrix3<f64>) {
    match relation {
        Relation::Position(seen) => (*seen.translation_m(), variances(seen.sd_m())),
        Relation::RangeBearing(seen) => by_range_and_bearing(seen),
        Relation::Pose(seen) => {
            // The noise is given along the target's axes.
            let rotation = seen.pose().rotation.to_rotation_matrix().into_inner();
            let noise = variances(&seen.noise().sd().fixed_rows::<3>(0).into_owned());
            (
                seen.pose().translation.vector,
                rotation * noise * rotation.transpose(),
            )
        }
    }
}

/// Position by distance r, azimuth α and elevation ε.
///
/// ```text
/// z = r e_r      D = σ_r² e_r e_rᵀ + (r σ_b)² (cos² ε · e_α e_αᵀ + e_ε e_εᵀ)
/// ```
///
/// with the unit vectors along growing r, α and ε, to first order.
fn by_range_and_bearing(seen: &RangeBearing) -> (Vector3<f64>, Matrix3<f64>) {
    let (sin_azimuth, cos_azimuth) = seen.azimuth_rad().sin_cos();
    let (sin_elevation, cos_elevation) = seen.elevation_rad().sin_cos();
    let forward = Vector3::new(
        cos_elevation * cos_azimuth,
        cos_elevation * sin_azimuth,
        sin_elevation,
    );
    let left = Vector3::new(-sin_azimuth, cos_azimuth, 0.0);
    let up = Vector3::new(
        -sin_elevation * cos_azimuth,
        -sin_elevation * sin_azimuth,
        cos_elevation,
    );
    let across = seen.range_m() * seen.bearing_sd_rad();
    let covariance = forward * forward.transpose() * seen.range_sd_m().powi(2)
        + left * left.transpose() * (across * cos_elevation).powi(2)
        + up * up.transpose() * across.powi(2);
    (forward * seen.range_m(), covariance)
}

/// Covariance of independent errors.
fn variances(sd: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::from_diagonal(&sd.component_mul(sd))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{PoseNoise, RelativePose};
    use nalgebra::{Translation3, UnitQuaternion, Vector6};
    use proptest::prelude::*;

    proptest! {
        /// First-order covariance against the spread of sigma points, which knows no Jacobian.
        #[test]
        fn covariance_equals_the_spread_of_perturbed_sightings(
            position in prop::array::uniform3(-5.0..5.0),
            turn in prop::array::uniform3(-2.0..2.0),
            range_m in 0.5..20.0f64, azimuth in -3.0..3.0f64, elevation in -1.4..1.4f64,
        ) {
            let pose = Isometry3::from_parts(
                Translation3::from(Vector3::from(position)),
                UnitQuaternion::from_scaled_axis(Vector3::from(turn)),
            );
            let sd = Vector6::new(1e-4, 2e-4, 3e-4, 1e-4, 3e-4, 2e-4);
            let seen_at = |pose: &Isometry3<f64>, range, azimuth, elevation| {
                let seen = RangeBearing::new(range, azimuth, elevation, 5e-4, 1e-4).unwrap();
                (Relation::RangeBearing(seen), *pose)
            };
            let target = |(relation, pose): (Relation, Isometry3<f64>)| {
                seen(&relation, &pose, &PoseCovariance::zero()).position
            };
            let (relation, _) = seen_at(&pose, range_m, azimuth, elevation);
            let estimate = seen(&relation, &pose, &PoseCovariance::from_sd(&sd));

            let mut spread = Matrix3::zeros();
            let mut add = |plus: Point3<f64>, minus: Point3<f64>| {
                let half = (plus - minus) * 0.5;
                spread += half * half.transpose();
            };
            for k in 0..6 {
                let perturbed = |sign: f64| {
                    let mut twist = Vector6::zeros();
                    twist[k] = sign * sd[k];
                    let (linear, angular) = (twist.fixed_rows::<3>(0), twist.fixed_rows::<3>(3));
                    pose * Isometry3::new(linear.into_owned(), angular.into_owned())
                };
                add(
                    target(seen_at(&perturbed(1.0), range_m, azimuth, elevation)),
                    target(seen_at(&perturbed(-1.0), range_m, azimuth, elevation)),
                );
            }
            let along = |range, azimuth, elevation| target(seen_at(&pose, range, azimuth, elevation));
            add(along(range_m + 5e-4, azimuth, elevation), along(range_m - 5e-4, azimuth, elevation));
            add(along(range_m, azimuth + 1e-4, elevation), along(range_m, azimuth - 1e-4, elevation));
            add(along(range_m, azimuth, elevation + 1e-4), along(range_m, azimuth, elevation - 1e-4));
            let error = (estimate.covariance - spread).abs().max();
            prop_assert!(error < 1e-5 * spread.trace() + 2e-12, "{error}");
        }
    }

    #[test]
    fn azimuth_is_left_and_elevation_up() {
        let sighting = |azimuth, elevation| {
            let relation = RangeBearing::new(2.0, azimuth, elevation, 0.0, 0.0).unwrap();
            in_body(&Relation::RangeBearing(relation)).0
        };
        let right_angle = std::f64::consts::FRAC_PI_2;
        assert!((sighting(0.0, 0.0) - Vector3::x() * 2.0).norm() < 1e-12);
        assert!((sighting(right_angle, 0.0) - Vector3::y() * 2.0).norm() < 1e-12);
        assert!((sighting(-right_angle, 0.0) + Vector3::y() * 2.0).norm() < 1e-12);
        assert!((sighting(0.3, right_angle) - Vector3::z() * 2.0).norm() < 1e-12);
    }

    #[test]
    fn noise_of_a_pose_lies_along_the_targets_axes() {
        let noise = PoseNoise::new([0.1, 0.2, 0.3], [0.0; 3]).unwrap();
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let turned = RelativePose::new([1.0, 0.0, 0.0], [0.0, 0.0, half, half], noise).unwrap();
        let (_, covariance) = in_body(&Relation::Pose(turned));
        let expected = Matrix3::from_diagonal(&Vector3::new(0.04, 0.01, 0.09));
        assert!((covariance - expected).abs().max() < 1e-12);
    }
}
