//! Reading touches, and touching again.

use std::num::NonZeroUsize;

use nalgebra::{Point3, UnitQuaternion, Vector3};
use rand::RngExt;

use super::{
    Episode, InvalidTouchProtocol, Touch, TouchError, TouchExperiment, TouchNoise, TouchProtocol,
    TouchReason, TouchReport, TouchSet, TouchedObject, episode_random,
};
use crate::eval::object::Rotate;

const TEXT: &str =
    "x_mm,y_mm,z_mm,level\n68.1235,-9.7628,0.7851,10\n17.0706,-60.6489,0.9098,20\n0,0,0,4\n";

#[test]
fn millimetres_become_metres() {
    let object = TouchedObject::read("can", TEXT).unwrap();
    assert_eq!((object.name.as_str(), object.touches.len()), ("can", 3));
    let touch = &object.touches[1];
    assert!((touch.position_m.x - 0.017_070_6).abs() < 1e-12);
    assert!((touch.position_m.y + 0.060_648_9).abs() < 1e-12);
    assert!((touch.level - 20.0).abs() < 1e-12);
}

#[test]
fn a_bad_line_is_named() {
    for (text, line, reason) in [
        ("", 1, TouchReason::Header),
        ("x,y,z,level\n1,2,3,4", 1, TouchReason::Header),
        ("x_mm,y_mm,z_mm,level\n", 1, TouchReason::NoTouch),
        (
            "x_mm,y_mm,z_mm,level\n1,2,3,4\n1,2,3",
            3,
            TouchReason::Columns(3),
        ),
        (
            "x_mm,y_mm,z_mm,level\n1,2,inf,4",
            2,
            TouchReason::NotANumber(3),
        ),
    ] {
        match TouchedObject::read("can", text) {
            Err(TouchError::Line {
                line: found_line,
                reason: found,
                ..
            }) => assert_eq!((found_line, found), (line, reason)),
            other => panic!("{text}: {other:?}"),
        }
    }
}

#[test]
fn a_directory_is_read_by_name_and_an_empty_one_refused() {
    let directory = std::env::temp_dir().join(format!("touch-{}", std::process::id()));
    std::fs::create_dir_all(&directory).unwrap();
    let empty = TouchSet::load(&directory);
    for name in ["b.csv", "a.csv", "notes.txt"] {
        std::fs::write(directory.join(name), TEXT).unwrap();
    }
    std::fs::write(directory.join("summary.csv"), "name,area\n").unwrap();
    let set = TouchSet::load(&directory);
    std::fs::remove_dir_all(&directory).unwrap();
    assert!(matches!(empty, Err(TouchError::Empty(_))));
    let set = set.unwrap();
    let names: Vec<&str> = set
        .objects()
        .iter()
        .map(|object| object.name.as_str())
        .collect();
    assert_eq!(names, ["a", "b"]);
}

#[test]
fn without_noise_an_episode_is_the_object_moved() {
    let object = TouchedObject::read("can", TEXT).unwrap();
    let exact = TouchNoise {
        position_sd_m: 0.0,
        level_sd: 0.0,
    };
    let turn = UnitQuaternion::from_euler_angles(0.1, -0.7, 2.0);
    let episode = Episode::draw(&object, turn, &exact, 10, &mut episode_random(1, 0));
    assert_eq!(episode.touches.len(), 3);
    for touch in &object.touches {
        let moved = episode.episode_from_object * touch.position_m;
        let felt = episode.touches.iter().filter(|felt| {
            (felt.position_m - moved).norm() < 1e-12 && (felt.level - touch.level).abs() < 1e-12
        });
        assert_eq!(felt.count(), 1);
    }
}

#[test]
fn episodes_are_functions_of_seed_and_stream() {
    let object = TouchedObject::read("can", TEXT).unwrap();
    let noise = TouchNoise {
        position_sd_m: 2e-3,
        level_sd: 0.5,
    };
    let draw = |seed, stream| {
        let turn = UnitQuaternion::identity();
        Episode::draw(&object, turn, &noise, 2, &mut episode_random(seed, stream))
    };
    assert_eq!(draw(1, 2), draw(1, 2));
    assert_ne!(draw(1, 2), draw(1, 3));
    assert_ne!(draw(1, 2), draw(2, 2));
    assert_eq!(draw(1, 2).touches.len(), 2);
}

/// Objects of twenty touches each, with three levels between them.
fn set() -> TouchSet {
    let mut random = episode_random(7, 0);
    let mut object = |name: &str| {
        let touches = (0..20).map(|_| Touch {
            position_m: Point3::from(Vector3::from_fn(|_, _| random.random_range(-0.05..0.05))),
            level: f64::from(random.random_range(0..3)),
        });
        TouchedObject {
            name: name.to_owned(),
            touches: touches.collect(),
        }
    };
    TouchSet::of(["a", "b", "c", "d"].map(&mut object).into())
}

fn protocol(position_sd_m: f64, rotate: Rotate) -> TouchProtocol {
    TouchProtocol {
        noise: TouchNoise {
            position_sd_m,
            level_sd: 0.2,
        },
        rotate,
        is_reach_told: false,
        trials: 5,
        touches_max: 8,
        sure: 0.99,
        seed: 1,
    }
}

fn run(protocol: &TouchProtocol, threads: usize) -> TouchExperiment {
    let threads = NonZeroUsize::new(threads).unwrap();
    TouchExperiment::run(&set(), protocol, threads, &|_| {}, &|| 0.0).unwrap()
}

/// Touches that are learned to a tenth of a millimetre are found again by a hand that errs by many.
#[test]
fn objects_are_known_again_however_noisy_the_touch() {
    for (position_sd_m, rotate, least) in [
        (0.0005, Rotate::None, 1.0),
        (0.005, Rotate::None, 0.9),
        (0.0005, Rotate::Cube, 1.0),
    ] {
        let report = TouchReport::of(&run(&protocol(position_sd_m, rotate), 2));
        let shares = &report.top1_after;
        assert_eq!(shares.len(), 8);
        assert!(shares[&8] >= least, "{position_sd_m} m: {shares:?}");
        assert!(shares[&1] < 0.9, "one touch tells little: {shares:?}");
        assert!(report.outcomes.unwrap().wrong_rate < f64::MIN_POSITIVE);
    }
}

#[test]
fn touches_are_written_for_other_programs() {
    let experiment = run(&protocol(0.002, Rotate::None), 1);
    assert_eq!(
        experiment.csv(),
        run(&protocol(0.002, Rotate::None), 3).csv()
    );
    let csv = experiment.csv();
    let mut lines = csv.lines();
    assert_eq!(
        lines.next(),
        Some("trial,object,touch,x_mm,y_mm,z_mm,level,right")
    );
    assert_eq!(lines.count(), 4 * 5 * 8);
    let last = csv.lines().last().unwrap();
    assert!(last.starts_with("19,d,8,"), "{last}");
}

#[test]
fn a_protocol_without_sense_is_refused_by_name() {
    let good = protocol(0.002, Rotate::None);
    for (bad, reason) in [
        (
            protocol(f64::NAN, Rotate::None),
            InvalidTouchProtocol::Noise,
        ),
        (protocol(-1e-3, Rotate::None), InvalidTouchProtocol::Noise),
        (
            TouchProtocol { trials: 0, ..good },
            InvalidTouchProtocol::Trials,
        ),
        (
            TouchProtocol { sure: 0.5, ..good },
            InvalidTouchProtocol::Sure,
        ),
    ] {
        assert_eq!(bad.check(), Err(reason));
    }
}
