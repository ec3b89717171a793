//! Texts written as the format says.

use nalgebra::Vector3;

use super::{Victoria, VictoriaError, VictoriaReason};
use crate::mapping::{CausalRun, Measured, Refined};

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
    let information = set.odometry()[0].information.matrix();
    assert!((information[(0, 0)] - 100.0).abs() < 1e-9);
    assert!((information[(5, 5)] - 400.0).abs() < 1e-9);
    assert_eq!((information[(2, 2)], information[(3, 3)]), (0.0, 0.0));
    let seen = &set.sightings()[1];
    assert_eq!((seen.pose, seen.landmark), (3, 2));
    assert_eq!(seen.position, Vector3::new(1.0, 1.0, 0.0));
    assert!((seen.information.matrix()[(1, 1)] - 25.0).abs() < 1e-9);

    let recording = set.recording();
    // Pose 3 is the third, and the second measurement of its step is the tree.
    assert_eq!((recording.steps.len(), recording.landmarks.len()), (3, 1));
    assert_eq!(recording.steps[2].stamp_ns, 3_000_000_000);
    assert!(matches!(
        recording.steps[2].measured[1],
        Measured::Sighting {
            from: 2,
            landmark: 0,
            ..
        }
    ));
}

/// Along x the first pose is held, the motions say 1 and 1.1 and the sightings 2 and 1 before the
/// tree, so the motion between them is 1.1 by odometry (variance 0.01) and 1 by sight (0.08): at
/// the optimum 1.1 − 0.1 · 0.01/0.09.
#[test]
fn a_tree_seen_twice_corrects_the_motion_between() {
    let recording = Victoria::read(TEXT).unwrap().recording();
    let refined = Refined::of(&recording, None);
    let step = refined.poses[2].translation.x - refined.poses[1].translation.x;
    assert!((step - (1.1 - 0.1 * 0.01 / 0.09)).abs() < 1e-3, "{step}");
    assert_eq!((refined.landmarks.len(), refined.verdict.0.len()), (1, 1));
    let mut run = CausalRun::new(&recording);
    let mut last = None;
    while let Some(pose) = run.step() {
        last = Some(pose);
    }
    let apart = last.unwrap().translation.vector - refined.poses[2].translation.vector;
    assert!(apart.norm() < 1e-3, "{apart}");
    // The second sighting was 0.1 m off, with a variance of 0.09 along x and less than that of the
    // turn along y.
    let consistency = run.consistency(&run.verdict());
    assert_eq!(consistency.n, 1);
    assert!((0.0..0.2).contains(&consistency.per_degree().unwrap()));
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
        (
            "ODOMETRY 3 4 1 0 0 1 0 0 1 0 0",
            VictoriaReason::Covariance(pose_graph::InvalidInformation::Singular),
        ),
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
