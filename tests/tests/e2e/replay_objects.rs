//! `cogmap-lab replay touch` and `points`, on objects written here.

use std::fmt::Write as _;
use std::fs;

use cogmap_tests::lab;
use tempfile::TempDir;

/// Three objects of twelve touches along a helix, whose levels come in different orders.
fn touched() -> TempDir {
    let directory = tempfile::tempdir().unwrap();
    for (name, factor) in [("bolt", 1), ("nut", 5), ("screw", 7)] {
        let mut text = "x_mm,y_mm,z_mm,level\n".to_owned();
        for k in 0..12_i32 {
            let angle = f64::from(k) * 0.9;
            let (x, y, z) = (30.0 * angle.cos(), 30.0 * angle.sin(), 5.0 * f64::from(k));
            writeln!(text, "{x:.4},{y:.4},{z:.4},{}", 4 + (k * factor) % 12).unwrap();
        }
        fs::write(directory.path().join(format!("{name}.csv")), text).unwrap();
    }
    directory
}

#[test]
fn touched_objects_are_recognised_and_their_touches_written() {
    let (set, out) = (touched(), tempfile::tempdir().unwrap());
    let (set, out) = (set.path().to_str().unwrap(), out.path());
    let arguments = [
        "replay",
        "touch",
        set,
        "--trials",
        "4",
        "--max-touches",
        "6",
        "--json",
    ];
    let report = lab(&[&arguments[..], &["--out", out.to_str().unwrap()]].concat()).json();
    assert_eq!(report["objects"], 3);
    let share = |touches: &str| report["top1_after"][touches].as_f64().unwrap();
    assert!(share("6") > 0.9 && share("1") < share("6"), "{report}");
    for name in ["steps_mean", "wrong_rate", "unknown_rate", "accuracy"] {
        assert!(report[name].is_number(), "{name} in {report}");
    }
    let told = lab(&[&arguments[..], &["--told"]].concat()).json();
    assert!(told["top1_after"]["6"].as_f64().unwrap() > 0.9, "{told}");
    let trials = fs::read_to_string(out.join("trials.csv")).unwrap();
    assert_eq!(trials.lines().count(), 1 + 3 * 4 * 6);
    let refused = lab(&[&arguments[..], &["--noise-mm", "-2"]].concat());
    assert_eq!(refused.code(), 2, "{refused:?}");
}

#[test]
fn a_directory_without_objects_is_named() {
    let empty = tempfile::tempdir().unwrap();
    let directory = empty.path().to_str().unwrap();
    for kind in ["touch", "points"] {
        let refused = lab(&["replay", kind, directory]);
        assert_eq!(refused.code(), 1, "{kind}: {refused:?}");
    }
}
