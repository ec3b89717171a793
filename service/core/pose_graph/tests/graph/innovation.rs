//! What a map expects of a measurement.

use geometry::PoseCovariance;
use nalgebra::{Isometry3, Point3, Vector3, Vector6};
use pose_graph::{
    ExpectedPose, Freedom, Innovation, Kernel, Link, PoseId, PoseInformation, SightingTarget,
};

use crate::worlds::{Noise, Rounds, position_information};

fn noise() -> PoseCovariance {
    PoseCovariance::from_sd(&Vector6::new(0.05, 0.02, 0.03, 0.01, 0.005, 0.02))
}

/// Expecting a pose by a motion that is not in the map is expecting it in the map that has the
/// motion.
#[test]
fn a_pose_after_a_motion_is_expected_as_if_the_map_had_it() {
    let world = Rounds::new(51, Freedom::Full, 0.05);
    let (mut map, nodes) = world.map(&world.truth);
    let mut random = Noise(52);
    let (old, last) = (nodes[12], nodes[nodes.len() - 1]);
    let motion = Isometry3::translation(0.7, 0.1, 0.0) * random.motion(0.3, 0.9, Freedom::Full);
    let ahead = map.marginals().expected_pose(old, last).unwrap();
    let ahead = ahead.after(&motion, &noise());
    let point = map.add_point(map.pose(old) * Point3::new(2.0, 1.0, 0.5), Freedom::Full);
    let sight = |from: PoseId, position| Link::Sighting {
        from,
        target: SightingTarget::Point(point),
        position,
        information: position_information(0.2),
    };
    let seen = Vector3::new(2.0, 1.0, 0.5);
    map.add_link(sight(old, seen), Kernel::Gaussian).unwrap();
    let point_ahead = map.marginals().expected_position(last, point).unwrap();
    let point_ahead = point_ahead.seen_after(&motion, &noise());

    let next = map.add_pose(map.pose(last) * motion, Freedom::Full);
    let link = Link::Between {
        from: last,
        to: next,
        transform: motion,
        information: PoseInformation::of_covariance(&noise()).unwrap(),
    };
    map.add_link(link, Kernel::Gaussian).unwrap();
    let there = map.marginals();
    for (found, expected) in [
        (ahead.clone(), there.expected_pose(old, next).unwrap()),
        (ahead.reversed(), there.expected_pose(next, old).unwrap()),
    ] {
        let apart = found.transform.inv_mul(&expected.transform);
        assert!(apart.translation.vector.norm() + apart.rotation.angle() < 1e-9);
        let (found, expected) = (found.covariance, expected.covariance);
        let error = (found.matrix() - expected.matrix()).norm();
        assert!(error < 1e-6 * expected.matrix().norm(), "{error}");
    }
    let expected = there.expected_position(next, point).unwrap();
    assert!((point_ahead.position - expected.position).norm() < 1e-9);
    let error = (point_ahead.covariance - expected.covariance).norm();
    assert!(error < 1e-6 * expected.covariance.norm(), "{error}");
}

/// Along one axis the square is that of the difference over the sum of both variances, and a
/// direction without information adds nothing, whatever is found there.
#[test]
fn an_innovation_is_measured_in_the_deviations_of_both() {
    let sd = Vector6::new(0.3, 0.3, 0.3, 0.0, 0.0, 0.0);
    let expected = ExpectedPose {
        transform: Isometry3::translation(1.0, 2.0, 3.0),
        covariance: PoseCovariance::from_sd(&sd),
    };
    let mut information = nalgebra::Matrix6::zeros();
    information[(1, 1)] = 1.0 / 0.16;
    let information = PoseInformation::new(&information).unwrap();
    for (sideways, square) in [(0.5, 1.0), (-0.5, 1.0), (0.0, 0.0), (5e3, 1e8)] {
        let measured = Isometry3::translation(-7.0, 2.0 + sideways, 30.0);
        let found = expected.innovation(&measured, &information).unwrap();
        assert_eq!(found.degrees, 1);
        assert!((found.squared - square).abs() < 1e-6 * square.max(1e-6));
    }
}

/// Quantiles of χ² at 95 % and 99.865 % (1.645 and 3 deviations), from its tables.
#[test]
fn limits_are_quantiles() {
    for (degrees, deviations, quantile) in [
        (2, 1.644_854, 5.991),
        (3, 1.644_854, 7.815),
        (6, 1.644_854, 12.592),
        (3, 3.0, 15.630),
        (6, 3.0, 21.847),
    ] {
        let found = Innovation::limit(degrees, deviations);
        assert!(
            (found - quantile).abs() < 0.03 * quantile,
            "{degrees}: {found}"
        );
    }
}
