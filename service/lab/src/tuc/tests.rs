//! The format, and what a robot would have sent of it.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use super::{Match, Motion, Tuc, TucError, TucReason};
use cogmap_proto::{SampleBody, Sighting, Target};
use trajectory::format_seconds;

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

/// The samples of a robot on a circle: the start, a motion at each step, and each match behind the
/// motion of its later moment, naming the sample of the earlier one.
#[test]
fn matches_are_sightings_of_what_the_robot_was() {
    let set = rounds();
    let stream = set.stream(set.matches(), Motion::StatedNoise);
    let samples = stream.samples();
    assert_eq!(samples.len(), 401 + set.matches().len());
    assert!(matches!(samples[0].body, SampleBody::StartPose(_)));
    let sighted = samples
        .iter()
        .enumerate()
        .filter_map(|(number, sample)| match &sample.body {
            SampleBody::Sighting(Sighting {
                target: Target::OwnSample(earlier),
                ..
            }) => Some((number, *earlier)),
            _ => None,
        });
    let mut n = 0;
    for (number, earlier) in sighted {
        let now_ns = samples[number].stamp_ns;
        let then = &samples[usize::try_from(earlier).unwrap()];
        assert_eq!(now_ns - then.stamp_ns, 10_000_000_000);
        assert!(!matches!(then.body, SampleBody::Sighting(_)));
        n += 1;
    }
    assert_eq!(n, set.matches().len());
    let SampleBody::Increment(first) = &samples[1].body else {
        panic!("{:?}", samples[1])
    };
    assert!((first.noise.unwrap().translation_sd_m[0] - 0.005).abs() < 1e-12);
}

/// The motion is the same however it is told; without noise of its own it is a velocity.
#[test]
fn unstated_noise_leaves_the_motion_as_it_is() {
    let set = rounds();
    let stated = set.stream(&[], Motion::StatedNoise);
    let unstated = set.stream(&[], Motion::UnstatedNoise);
    assert_eq!(stated.reckoned().len(), 401);
    for (one, other) in stated.reckoned().iter().zip(unstated.reckoned()) {
        assert_eq!(one, other);
    }
    for sample in &unstated.samples()[1..] {
        let SampleBody::Velocity(velocity) = &sample.body else {
            panic!("{sample:?}")
        };
        assert_eq!(velocity.noise, None);
    }
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
