use cognitive_map::estimator::{Calibration, Estimator, ExternalEstimate, Parameters};
use cognitive_map::{Motion, PoseNoise, RangeBearing, Relation, StartPose};
use geometry::PoseCovariance;
use nalgebra::{Isometry3, SVector, Vector6};

use crate::hall::{label, planar};

/// An outside estimate of a pose, which does not prevail.
fn outside(pose: &Isometry3<f64>, covariance: &PoseCovariance) -> ExternalEstimate {
    ExternalEstimate {
        pose: *pose,
        covariance: *covariance,
        calibration: None,
        prevails: false,
    }
}

fn fuse(
    estimator: &mut Estimator,
    agent: u32,
    pose: &Isometry3<f64>,
    covariance: &PoseCovariance,
) -> bool {
    estimator.fuse(agent, &outside(pose, covariance), &mut Vec::new())
}

/// A robot that has driven 5 m along x from a known start, on a floor; with a post behind it if it
/// looks.
fn driven(looks: bool) -> Estimator {
    let mut estimator = Estimator::new(Parameters::default());
    let agent = estimator.enrol();
    let start = StartPose::new([0.0; 3], [0.0, 0.0, 0.0, 1.0], PoseNoise::none()).unwrap();
    estimator.start_pose(agent, &start, &mut Vec::new());
    for step in 1..=50 {
        let noise = PoseNoise::new([0.02, 0.02, 0.0], [0.0, 0.0, 0.01]).unwrap();
        let motion = Motion::from_increment([0.1, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], Some(noise));
        estimator.motion(agent, step * 100_000_000, &motion.unwrap(), &mut Vec::new());
    }
    if looks {
        let seen = RangeBearing::new(2.0, 0.0, 0.0, 0.05, 0.01).unwrap();
        estimator.landmark(
            agent,
            5_000_000_000,
            &label(0),
            &Relation::RangeBearing(seen),
            &mut Vec::new(),
        );
    }
    estimator
}

fn told(sd_m: f64, sd_rad: f64) -> PoseCovariance {
    PoseCovariance::from_sd(&Vector6::new(sd_m, sd_m, 0.01, 0.01, 0.01, sd_rad))
}

fn distance_m(estimator: &Estimator, place: &Isometry3<f64>) -> f64 {
    let pose = estimator.in_frame(0).unwrap();
    (pose.translation.vector - place.translation.vector).norm()
}

#[test]
fn a_better_pose_prevails_and_what_was_seen_follows() {
    let place = planar(5.1, 0.2, 0.05);
    for looks in [false, true] {
        let mut estimator = driven(looks);
        let before = estimator
            .landmarks()
            .next()
            .map(|(_, position, _)| position);
        assert!(fuse(&mut estimator, 0, &place, &told(0.01, 0.002)));
        assert!(distance_m(&estimator, &place) < 0.01);
        let (pose, covariance) = estimator.pose(0).unwrap();
        assert!((pose.rotation.angle() - 0.05).abs() < 0.005);
        let sd_m = covariance.matrix()[(0, 0)].sqrt();
        assert!((0.009..0.011).contains(&sd_m), "{sd_m}");
        assert!(
            covariance.matrix()[(2, 2)].abs() < 1e-12,
            "still on the floor"
        );
        let after = estimator
            .landmarks()
            .next()
            .map(|(_, position, _)| position);
        if let Some((before, after)) = before.zip(after) {
            let expected = place * planar(2.0, 0.0, 0.0);
            assert!((after.coords - expected.translation.vector).norm() < 0.05);
            assert!((after - before).norm() > 0.1);
        }
    }
}

#[test]
fn the_same_pose_twice_adds_nothing() {
    for looks in [false, true] {
        let mut estimator = driven(looks);
        let place = planar(5.05, 0.1, 0.02);
        for _ in 0..2 {
            assert!(fuse(&mut estimator, 0, &place, &told(0.05, 0.02)));
        }
        let (pose, once) = estimator.pose(0).unwrap();
        for _ in 0..20 {
            assert!(fuse(&mut estimator, 0, &place, &told(0.05, 0.02)));
        }
        let (again, twenty) = estimator.pose(0).unwrap();
        assert!((pose.translation.vector - again.translation.vector).norm() < 0.01);
        let [once, twenty] = [once, twenty].map(|covariance| covariance.matrix().determinant());
        let sd = |covariance: &PoseCovariance| covariance.matrix()[(0, 0)].sqrt();
        let (_, covariance) = estimator.pose(0).unwrap();
        assert!(sd(&covariance) > 0.048, "{}", sd(&covariance));
        assert!(twenty <= once);
    }
}

#[test]
fn its_own_estimate_told_back_changes_nothing() {
    let mut estimator = driven(true);
    let (pose, covariance) = estimator.pose(0).unwrap();
    assert!(fuse(&mut estimator, 0, &pose, &covariance));
    let (after, spread) = estimator.pose(0).unwrap();
    assert!((after.to_homogeneous() - pose.to_homogeneous()).amax() < 1e-9);
    assert!((spread.matrix() - covariance.matrix()).amax() < 1e-9);
}

#[test]
fn a_pose_too_far_off_and_a_vague_one_change_nothing() {
    let mut estimator = driven(true);
    let (before, covariance) = estimator.pose(0).unwrap();
    assert!(!fuse(
        &mut estimator,
        0,
        &planar(12.0, 4.0, 0.0),
        &told(0.01, 0.01)
    ));
    assert!(!fuse(
        &mut estimator,
        0,
        &planar(5.0, 0.0, 3.0),
        &told(0.01, 0.01)
    ));
    assert!(fuse(
        &mut estimator,
        0,
        &planar(5.3, 0.2, 0.1),
        &told(50.0, 3.0)
    ));
    assert!(!fuse(&mut estimator, 7, &before, &covariance), "nobody");
    let (after, spread) = estimator.pose(0).unwrap();
    assert!((after.to_homogeneous() - before.to_homogeneous()).amax() < 1e-9);
    assert!((spread.matrix() - covariance.matrix()).amax() < 1e-9);
}

/// What knows of more prevails: odometry was worse than it said.
#[test]
fn a_pose_that_prevails_is_taken_however_far_off_it_is() {
    for (x, y, turn) in [(12.0, 4.0, 0.0), (5.0, -30.0, 2.0), (-400.0, 0.1, -3.0)] {
        let mut estimator = driven(true);
        let pose = planar(x, y, turn);
        let estimate = ExternalEstimate {
            prevails: true,
            ..outside(&pose, &told(0.1, 0.02))
        };
        assert!(estimator.fuse(0, &estimate, &mut Vec::new()));
        let (after, spread) = estimator.pose(0).unwrap();
        let off = pose.inv_mul(&after);
        assert!(off.translation.vector.norm() < 0.3, "{off}");
        assert!(off.rotation.angle() < 0.06, "{off}");
        let sd_m = spread.position_sd_m();
        assert!(sd_m < 1.0, "{sd_m}");
    }
}

/// The lasting errors that an outside estimate states correct what odometry reads from then on.
#[test]
fn a_calibration_is_taken_over() {
    let mut estimator = driven(false);
    let (pose, covariance) = estimator.pose(0).unwrap();
    let calibration = Calibration {
        angle: 0.1,
        ..Calibration::default()
    };
    let estimate = ExternalEstimate {
        calibration: Some((calibration, SVector::repeat(1e-6))),
        ..outside(&pose, &covariance)
    };
    assert!(estimator.fuse(0, &estimate, &mut Vec::new()));
    let turn = Motion::from_increment([0.0; 3], [0.0, 0.0, 0.5_f64.sin(), 0.5_f64.cos()], None);
    estimator.motion(0, 6_000_000_000, &turn.unwrap(), &mut Vec::new());
    let (after, _) = estimator.pose(0).unwrap();
    // A reading of one radian is nine tenths of it.
    let turned = pose.inv_mul(&after).rotation.angle();
    assert!((turned - 0.9).abs() < 1e-6, "{turned}");
}
