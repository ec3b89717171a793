//! The format, and a map that false matches do not bend.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::{Match, Tuc, TucError, TucReason};
use crate::mapping::Refined;
use trajectory::format_seconds;
use trajectory::{Alignment, StampedPose, Trajectory, ate_rmse_m};

const INPUT: &str = "\
odom2 0 0 0 0 0.0025 0.0025 0.0001
odom2 0.5 2 0 0 0.0025 0.0025 0.0001
odom2 1.0 2 0 3.141592653589793 0.0025 0.0025 0.0001
loop 1.01 0.02 0.25
other 1 2 3
";
const TRUTH: &str = "point2 0 5 6 0 0 0 0\nangle 0 1 0\npoint2 2 7 8 0 0 0 0\n";

#[test]
fn the_lines_read_as_the_format_says() {
    let set = Tuc::read(INPUT, TRUTH).unwrap();
    assert_eq!(set.steps().len(), 3);
    let step = &set.steps()[1];
    assert_eq!(step.stamp_ns, 500_000_000);
    assert!((step.motion.translation.vector - Vector3::x()).norm() < 1e-12);
    assert!((step.noise_sd[0] - 0.025).abs() < 1e-12 && (step.noise_sd[5] - 0.005).abs() < 1e-12);
    // Half a second at π rad/s: a quarter of a turn to the left, along an arc.
    let turn = set.steps()[2].motion.rotation.scaled_axis();
    assert!((turn - Vector3::z() * std::f64::consts::FRAC_PI_2).norm() < 1e-12);
    let expected = Match {
        later_ns: 1_010_000_000,
        earlier_ns: 20_000_000,
        score: 0.25,
    };
    assert_eq!(set.matches(), [expected]);
    assert_eq!(
        set.truth().at(1_000_000_000),
        Some(Vector3::new(6.0, 7.0, 0.0))
    );
    assert_eq!(set.start().translation.vector, Vector3::new(5.0, 6.0, 0.0));
    assert!((set.start().rotation.scaled_axis() - Vector3::z()).norm() < 1e-12);
}

#[test]
fn a_bad_line_is_named() {
    for (line, expected) in [
        (
            "odom2 1 2 3",
            TucReason::Columns {
                expected: 8,
                found: 4,
            },
        ),
        ("odom2 0.9 0 0 0 0 0 0", TucReason::NotLater),
        ("odom2 2 x 0 0 0 0 0", TucReason::NotANumber { column: 3 }),
        ("odom2 2 0 0 0 0 -1 0", TucReason::NegativeVariance),
        (
            "loop 1 2",
            TucReason::Columns {
                expected: 4,
                found: 3,
            },
        ),
    ] {
        match Tuc::read(&format!("{INPUT}{line}\n"), TRUTH) {
            Err(TucError::Line { line: 6, reason }) => assert_eq!(reason, expected),
            other => panic!("{line}: {other:?}"),
        }
    }
    assert!(matches!(Tuc::read("", TRUTH), Err(TucError::NoOdometry)));
    assert!(matches!(Tuc::read(INPUT, ""), Err(TucError::Truth(_))));
}

/// Four rounds on a circle, with a gyroscope that drifts, matched at every fiftieth of a round.
fn rounds() -> Tuc {
    use std::fmt::Write as _;

    let (mut input, mut truth) = (String::new(), String::new());
    let n = 4 * 100;
    let turn_s = TAU / 10.0;
    for k in 0..=n {
        let t = format_seconds(i64::from(k) * 100_000_000);
        let angle = f64::from(k) * TAU / 100.0;
        let (speed, turn) = if k == 0 {
            (0.0, 0.0)
        } else {
            (10.0 * turn_s, turn_s + 0.01)
        };
        writeln!(input, "odom2 {t} {speed} 0 {turn} 0.0025 0.0025 0.0001").unwrap();
        let (x, y) = (10.0 * angle.sin(), -10.0 * angle.cos());
        writeln!(truth, "point2 {t} {x} {y} 0 0 0 0").unwrap();
    }
    for k in (100..=n).step_by(2) {
        let (later, earlier) = (f64::from(k) * 0.1, f64::from(k - 100) * 0.1);
        writeln!(input, "loop {later} {earlier} 0.5").unwrap();
    }
    Tuc::read(&input, &truth).unwrap()
}

#[test]
fn more_false_matches_than_true_ones_do_not_bend_the_map() {
    let set = rounds();
    let mut matches = set.matches().to_vec();
    set.add_false(&mut matches, 0.7, 5);
    let ate_m = |matches: &[Match]| {
        let recording = set.recording(matches);
        let refined = Refined::of(&recording, None);
        let poses = recording.steps.iter().zip(&refined.poses);
        let poses: Vec<_> = poses
            .map(|(step, &pose)| StampedPose {
                stamp_ns: step.stamp_ns,
                pose,
            })
            .collect();
        let estimate = Trajectory::from_poses(&poses).unwrap();
        ate_rmse_m(
            &estimate,
            set.truth(),
            set.truth().span(),
            Alignment::Planar,
        )
        .unwrap()
    };
    let (odometry, clean, doubted) = (ate_m(&[]), ate_m(set.matches()), ate_m(&matches));
    assert!(odometry > 0.5, "{odometry}");
    assert!(clean < 0.5 * odometry, "{clean} {odometry}");
    assert!(doubted < clean + 0.1, "{doubted} {clean}");
}

#[test]
fn false_matches_are_added_up_to_a_share_and_by_a_seed() {
    let set = rounds();
    let with = |seed| {
        let mut matches = set.matches().to_vec();
        set.add_false(&mut matches, 0.8, seed);
        matches
    };
    let matches = with(1);
    let n_false = matches.iter().filter(|found| !set.is_true(found)).count();
    assert_eq!((matches.len(), n_false), (755, 604));
    assert_eq!(with(1), matches);
    assert_ne!(with(2), matches);
    // Without a true match no share of false ones can be reached, and none is added.
    let mut none = Vec::new();
    set.add_false(&mut none, 0.5, 1);
    assert!(none.is_empty());
}
