//! `cogmap-lab replay` of pose graphs and recordings, on small ones written here.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use cogmap_tests::lab;
use serde_json::Value;
use tempfile::TempDir;

/// Poses of one round, of 10 m radius.
const ROUND: u32 = 24;

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// Position and heading of a pose: three rounds on a circle, from the origin along x.
fn truth(k: u32) -> (f64, f64, f64) {
    let angle = f64::from(k) * TAU / f64::from(ROUND);
    (10.0 * angle.sin(), 10.0 * (1.0 - angle.cos()), angle)
}

/// The second pose in the frame of the first.
fn between(from: u32, to: u32) -> (f64, f64, f64) {
    let ((x, y, heading), (to_x, to_y, to_heading)) = (truth(from), truth(to));
    let (sin, cos) = heading.sin_cos();
    let (dx, dy) = (to_x - x, to_y - y);
    (
        cos * dx + sin * dy,
        cos * dy - sin * dx,
        to_heading - heading,
    )
}

/// The rounds as a graph, in which every measurement is exact: its optimum is the truth, at a cost
/// of nothing.
fn exact_graph() -> String {
    let information = "100 0 0 100 0 2500";
    let mut graph = String::new();
    for to in 1..3 * ROUND {
        let sources = [Some(to - 1), to.checked_sub(ROUND)];
        for from in sources.into_iter().flatten() {
            let (x, y, turn) = between(from, to);
            writeln!(graph, "EDGE_SE2 {from} {to} {x} {y} {turn} {information}").unwrap();
        }
    }
    graph
}

fn reference() -> String {
    let mut reference = "# id x y\n".to_owned();
    for k in 0..3 * ROUND {
        let (x, y, _) = truth(k);
        writeln!(reference, "{k} {x} {y}").unwrap();
    }
    reference
}

fn number(report: &Value, path: &str) -> f64 {
    let value = report.pointer(path).and_then(Value::as_f64);
    value.unwrap_or_else(|| panic!("{path} is no number in {report}"))
}

#[test]
fn a_graph_is_relaxed_to_its_optimum_and_written() {
    let home = TempDir::new().unwrap();
    let (file, out) = (home.path().join("rounds.g2o"), home.path().join("out"));
    fs::write(&file, exact_graph()).unwrap();
    fs::write(home.path().join("rounds.opt_xyz.txt"), reference()).unwrap();
    let report = lab(&["replay", "g2o", text(&file), "--json"]).json();
    assert_eq!(
        (&report["poses"], &report["closures"]),
        (&72.into(), &48.into())
    );
    assert!(number(&report, "/chi2_half") < 1e-6, "{report}");
    for error in ["refined", "refined_aligned"] {
        let error = number(&report, &format!("/{error}_ate_rmse_m"));
        assert!(error < 1e-5, "{report}");
    }
    // The text says the same.
    let printed = lab(&["replay", "g2o", text(&file)]);
    assert!(printed.text().contains(report["digest"].as_str().unwrap()));
    // Sent as a robot would have, pose by pose.
    let args = [
        "replay",
        "g2o",
        text(&file),
        "--samples",
        "--json",
        "--plot",
    ];
    let report = lab(&[&args[..], &["--out", text(&out)]].concat()).json();
    assert!(
        number(&report, "/refined_aligned_ate_rmse_m") < 0.1,
        "{report}"
    );
    assert!(number(&report, "/update_ms/max") >= number(&report, "/update_ms/p50"));
    let mut files = fs::read_dir(&out).unwrap().map(|file| file.unwrap().path());
    assert!(files.any(|file| file.extension().is_some_and(|kind| kind == "svg")));
}

/// The rounds in the format of TUC, 10 Hz, with a gyroscope that turns too far.
fn write_tuc(directory: &Path) {
    let (mut input, mut truth_text) = (String::new(), String::new());
    let n = 3 * 200;
    for k in 0..=n {
        let (t, angle) = (f64::from(k) * 0.1, f64::from(k) * TAU / 200.0);
        let (speed, turn) = if k == 0 {
            (0.0, 0.0)
        } else {
            (TAU / 2.0, TAU / 20.0 + 0.003)
        };
        writeln!(input, "odom2 {t} {speed} 0 {turn} 0.0025 0.0025 0.0001").unwrap();
        let (x, y) = (10.0 * angle.sin(), 10.0 * (1.0 - angle.cos()));
        writeln!(
            truth_text,
            "point2 {t} {x} {y} 0 0 0 0\nangle {t} {angle} 0"
        )
        .unwrap();
        if k >= 200 && k % 5 == 0 {
            writeln!(input, "loop {t} {} 0.5", f64::from(k - 200) * 0.1).unwrap();
        }
    }
    fs::write(directory.join("Rounds_Input.txt"), input).unwrap();
    fs::write(directory.join("Rounds_GT.txt"), truth_text).unwrap();
}

#[test]
fn four_false_matches_for_each_true_one_do_not_bend_a_recording() {
    let home = TempDir::new().unwrap();
    write_tuc(home.path());
    let replay = |more: &[&str]| {
        let args = ["replay", "tuc", text(home.path()), "--json"];
        lab(&[&args[..], more].concat()).json()
    };
    let clean = replay(&[]);
    assert_eq!(clean["false_share"], 0.0);
    // A start pose, 600 motions and 81 matches.
    assert_eq!(
        (&clean["samples"], &clean["matches"]),
        (&682.into(), &81.into())
    );
    let error = "/refined_aligned_ate_rmse_m";
    assert!(number(&clean, error) < 0.1, "{clean}");
    let drift_m = number(&clean, "/dead_reckoning_aligned_ate_rmse_m");
    assert!(
        number(&clean, "/causal_aligned_ate_rmse_m") < 0.6 * drift_m,
        "{clean}"
    );
    let doubtful = replay(&["--add-false", "0.8", "--seed", "7"]);
    assert!((number(&doubtful, "/false_share") - 0.8).abs() < 0.01);
    assert!(
        number(&doubtful, error) < number(&clean, error) + 0.15,
        "{doubtful}"
    );
    assert_eq!(
        replay(&["--add-false", "0.8", "--seed", "7"])["digest"],
        doubtful["digest"]
    );
    let other = replay(&["--add-false", "0.8", "--seed", "8"]);
    assert_ne!(other["digest"], doubtful["digest"]);
}

#[test]
fn trees_correct_a_car() {
    let home = TempDir::new().unwrap();
    // Two rounds with a motion that is too long; tree 1000 + i stands outside the circle, and is
    // seen by what passes it.
    let mut set = String::new();
    for k in 1..2 * ROUND {
        let (x, y, turn) = between(k - 1, k);
        let x = x * 1.02;
        writeln!(
            set,
            "ODOMETRY {} {k} {x} {y} {turn} 0.01 0 0 0.01 0 0.0004",
            k - 1
        )
        .unwrap();
        writeln!(set, "LANDMARK {k} {} 1 -3 0.01 0 0.01", 1000 + k % ROUND).unwrap();
    }
    fs::write(home.path().join("victoria_park.txt"), set).unwrap();
    let report = lab(&["replay", "victoria", text(home.path()), "--json"]).json();
    // Each tree of the first round but the first is seen again in the second.
    assert_eq!(
        (&report["landmarks"], &report["accepted"]),
        (&24.into(), &23.into())
    );
    assert_eq!(
        report["refined_ate_rmse_m"],
        Value::Null,
        "there is no truth"
    );
    assert!(
        lab(&["replay", "victoria", "--help"])
            .text()
            .contains("aa3_dr.mat")
    );
}

#[test]
fn what_cannot_be_read_is_named_with_its_line() {
    let home = TempDir::new().unwrap();
    let path = |name: &str| home.path().join(name);
    fs::write(path("empty.g2o"), "# nothing\n").unwrap();
    fs::write(
        path("bad.g2o"),
        "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nEDGE_SE2 1 2 x 0 0 1 0 0 1 0 1\n",
    )
    .unwrap();
    fs::write(
        path("huge.g2o"),
        "EDGE_SE2 0 1 1e300 0 0 1e300 0 0 1e300 0 1e300\nEDGE_SE2 0 2 1e300 0 0 1e300 0 0 1 0 1\n",
    )
    .unwrap();
    fs::write(path("good.g2o"), exact_graph()).unwrap();
    fs::write(path("positions.txt"), "0 0 0\n1 one 1\n").unwrap();
    fs::create_dir(path("tuc")).unwrap();
    write_tuc(&path("tuc"));
    fs::write(path("tuc/Rounds_GT.txt"), "point2 0 0\n").unwrap();
    fs::create_dir(path("original")).unwrap();
    fs::write(path("original/aa3_dr.mat"), "MATLAB").unwrap();
    fs::write(
        path("trees.txt"),
        "ODOMETRY 0 1 1 0 0 1 0 0 1 0 1\nTREE 1 2\n",
    )
    .unwrap();
    let good = path("good.g2o");
    let wrong = path("positions.txt");
    for (args, named) in [
        (vec!["g2o", text(&path("absent.g2o"))], &["absent.g2o"][..]),
        (
            vec!["g2o", text(&path("empty.g2o"))],
            &["empty.g2o", "no edge"],
        ),
        (
            vec!["g2o", text(&path("bad.g2o"))],
            &["bad.g2o", "line 2", "column 4"],
        ),
        (
            vec!["g2o", text(&good), "--reference", text(&wrong)],
            &["positions.txt", "line 2"],
        ),
        (vec!["tuc", text(&path("original"))], &["_Input.txt"]),
        (
            vec!["tuc", text(&path("tuc"))],
            &["Rounds_GT.txt", "line 1"],
        ),
        (
            vec!["victoria", text(&path("original"))],
            &["victoria_park.txt"],
        ),
        (
            vec!["victoria", text(&path("trees.txt"))],
            &["trees.txt", "line 2", "TREE"],
        ),
    ] {
        let refused = lab(&[&["replay"][..], &args].concat());
        assert_eq!(
            (refused.code(), &*refused.stdout),
            (1, ""),
            "{args:?}: {refused:?}"
        );
        for name in named {
            assert!(refused.stderr.contains(name), "{name}: {}", refused.stderr);
        }
    }
    // Numbers that no map can hold end in an answer or an error, not in a crash.
    assert!(lab(&["replay", "g2o", text(&path("huge.g2o"))]).code() <= 1);
    for usage in [
        vec!["replay", "tuc", text(&path("tuc")), "--add-false", "1.0"],
        vec!["replay", "g2o", text(&good), "--plot"],
    ] {
        assert_eq!(lab(&usage).code(), 2, "{usage:?}");
    }
}
