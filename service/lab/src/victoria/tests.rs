//! Texts written as the format says.

use std::f64::consts::{FRAC_PI_4, SQRT_2};

use cogmap_proto::{Relation, SampleBody, Target};
use nalgebra::{Matrix2, Vector2};

use super::{Victoria, VictoriaError, VictoriaReason};

const TEXT: &str = "
ODOMETRY 0 1 1.0 0 0 0.01 0 0 0.01 0 0.0025
LANDMARK 1 2 2.0 1.0 0.04 0 0.04 # a tree
ODOMETRY 1 3 1.1 0 0 0.01 0 0 0.01 0 0.0025
LANDMARK 3 2 1.0 1.0 0.04 0 0.04
";

#[test]
fn motion_and_sightings_read_as_the_format_says() {
    let set = Victoria::read(TEXT).unwrap();
    assert_eq!((set.odometry().len(), set.sightings().len()), (2, 2));
    assert!((set.odometry()[0].covariance[(2, 2)] - 0.0025).abs() < 1e-12);
    let seen = &set.sightings()[1];
    assert_eq!((seen.pose, seen.landmark), (3, 2));
    assert_eq!(seen.position, Vector2::new(1.0, 1.0));
    assert_eq!(seen.covariance, Matrix2::new(0.04, 0.0, 0.0, 0.04));
}

/// A motion with its deviations, and behind it the tree, seen half left at √2 m: 0.2 m of deviation
/// across are 0.2/√2 rad.
#[test]
fn a_tree_is_sighted_by_range_and_bearing_behind_the_motion() {
    let set = Victoria::read(TEXT).unwrap();
    let stream = set.stream();
    assert_eq!(set.poses().collect::<Vec<_>>(), [0, 1, 3]);
    assert!((stream.reckoned()[2].pose.translation.x - 2.1).abs() < 1e-12);
    let stamps: Vec<i64> = stream
        .samples()
        .iter()
        .map(|sample| sample.stamp_ns)
        .collect();
    assert_eq!(
        stamps,
        [1_000_000_000, 1_000_000_000, 2_000_000_000, 2_000_000_000]
    );
    let SampleBody::Increment(motion) = &stream.samples()[2].body else {
        panic!("{stream:?}")
    };
    let noise = motion.noise.unwrap();
    assert!((noise.translation_sd_m[0] - 0.1).abs() < 1e-12);
    assert!((noise.rotation_sd_rad[2] - 0.05).abs() < 1e-12);
    let SampleBody::Sighting(seen) = &stream.samples()[3].body else {
        panic!("{stream:?}")
    };
    assert_eq!(seen.target, Target::Landmark("2".to_owned()));
    let Relation::RangeBearing {
        range_m,
        azimuth_rad,
        range_sd_m,
        bearing_sd_rad,
        ..
    } = seen.relation
    else {
        panic!("{seen:?}")
    };
    assert!((range_m - SQRT_2).abs() < 1e-12 && (azimuth_rad - FRAC_PI_4).abs() < 1e-12);
    assert!((range_sd_m - 0.2).abs() < 1e-12 && (bearing_sd_rad - 0.2 / SQRT_2).abs() < 1e-12);
}

#[test]
fn a_way_with_a_hole_is_refused() {
    for (line, reason) in [
        ("ODOMETRY 1 4 1 0 0 1 0 0 1 0 1", "from 1 to 4"),
        ("ODOMETRY 3 1 1 0 0 1 0 0 1 0 1", "from 3 to 1"),
        ("LANDMARK 9 2 1 1 1 0 1", "pose 9"),
    ] {
        let refused = Victoria::read(&format!("{TEXT}{line}\n"))
            .unwrap_err()
            .to_string();
        assert!(refused.contains(reason), "{refused}");
    }
}

#[test]
fn a_bad_line_is_named() {
    for (line, reason) in [
        ("EDGE 1 2", VictoriaReason::Kind("EDGE".to_owned())),
        (
            "LANDMARK 1 2 3 4 5",
            VictoriaReason::Columns {
                expected: 8,
                found: 6,
            },
        ),
        (
            "LANDMARK 1 2 x 1 1 0 1",
            VictoriaReason::NotANumber { column: 4 },
        ),
        ("LANDMARK 1 3 1 1 1 0 1", VictoriaReason::PoseAndLandmark(3)),
        (
            "LANDMARK -1 2 1 1 1 0 1",
            VictoriaReason::NotAnId { column: 2 },
        ),
        ("ODOMETRY 3 3 1 0 0 1 0 0 1 0 1", VictoriaReason::Loop),
        ("ODOMETRY 3 4 1 0 0 1 0 0 1 0 0", VictoriaReason::Covariance),
    ] {
        match Victoria::read(&format!("{TEXT}{line}\n")) {
            Err(VictoriaError::Line {
                line: 6,
                reason: found,
            }) => assert_eq!(found, reason),
            other => panic!("{line}: {other:?}"),
        }
    }
    assert!(matches!(
        Victoria::read("# nothing"),
        Err(VictoriaError::NoOdometry)
    ));
}

#[test]
fn the_original_form_is_refused_by_name() {
    let directory = std::env::temp_dir().join(format!("victoria-{}", std::process::id()));
    std::fs::create_dir_all(&directory).unwrap();
    std::fs::write(directory.join("aa3_dr.mat"), "MATLAB").unwrap();
    let refused = Victoria::load(&directory).unwrap_err().to_string();
    std::fs::remove_dir_all(&directory).unwrap();
    assert!(refused.contains("victoria_park.txt"), "{refused}");
}
