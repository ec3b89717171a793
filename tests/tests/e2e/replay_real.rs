//! `cogmap-lab replay real`: sets of each kind, written here, in one directory.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use cogmap_tests::lab;
use serde_json::Value;
use tempfile::TempDir;

/// Numbers of a view.
const WIDTH: usize = 16;
/// Agents of the site.
const SESSIONS: usize = 54;

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A set: its two tables without their first lines, and views of one channel.
fn write_set(directory: &Path, samples: &str, truth: &str, views: &[[f32; WIDTH]]) {
    fs::create_dir_all(directory).unwrap();
    let samples = format!("t_s,agent,kind,f1,f2,f3,f4,f5,f6,f7\n{samples}");
    fs::write(directory.join("samples.csv"), samples).unwrap();
    let truth = format!("t_s,agent,x,y,z,yaw,quality\n{truth}");
    fs::write(directory.join("truth.csv"), truth).unwrap();
    let shape = format!("'shape': ({}, {WIDTH})", views.len());
    let header = format!("{{'descr': '<f4', 'fortran_order': False, {shape}, }}\n");
    let mut matrix = b"\x93NUMPY\x01\x00".to_vec();
    matrix.extend(u16::try_from(header.len()).unwrap().to_le_bytes());
    matrix.extend(header.bytes());
    matrix.extend(views.iter().flatten().flat_map(|x| x.to_le_bytes()));
    fs::write(directory.join("camera.npy"), matrix).unwrap();
}

/// What is seen at a place: numbers that are its own.
fn view(place: usize) -> [f32; WIDTH] {
    std::array::from_fn(|k| {
        let mixed = (place * WIDTH + k + 1).wrapping_mul(2_654_435_761) >> 7;
        (mixed % 1000) as f32 / 500.0 - 1.0
    })
}

/// One robot that goes round and whose gyroscope errs.
fn write_yard(directory: &Path) {
    let (mut samples, mut truth) = (String::new(), String::new());
    for k in 1..=60 {
        let (t, angle) = (f64::from(k), f64::from(k) * TAU / 60.0);
        writeln!(samples, "{t},mower,velocity,1,0,{},1", TAU / 60.0 + 0.004).unwrap();
        let radius = 60.0 / TAU;
        let (x, y) = (radius * angle.sin(), radius * (1.0 - angle.cos()));
        writeln!(truth, "{t},mower,{x},{y},0,{angle},").unwrap();
    }
    write_set(directory, &samples, &truth, &[]);
}

/// Two trains on one line that see the same things; the second one is filmed a little later.
fn write_line(directory: &Path) {
    let (mut samples, mut truth) = (String::new(), String::new());
    for train in ["early", "late"] {
        for k in 0..40 {
            if k > 0 {
                writeln!(samples, "{k},{train},increment,5,0,0,0,0.1,0,0.001").unwrap();
            }
            writeln!(samples, "{k},{train},descriptor,camera,{k}").unwrap();
            writeln!(truth, "{k},{train},{},0,0,0,", 5 * k).unwrap();
        }
    }
    let views: Vec<_> = (0..40).map(view).collect();
    write_set(directory, &samples, &truth, &views);
}

/// Many short walks along the same bend.
fn write_site(directory: &Path) {
    let (mut samples, mut truth) = (String::new(), String::new());
    for walk in 0..SESSIONS {
        for k in 0..4 {
            let t = 100 * walk + k;
            writeln!(samples, "{t},walk-{walk},increment,1,0,0,0.1,0.05,0,0.01").unwrap();
            writeln!(samples, "{t},walk-{walk},descriptor,camera,{k}").unwrap();
            writeln!(truth, "{t},walk-{walk},{k},0,0,,").unwrap();
        }
    }
    let views: Vec<_> = (0..4).map(view).collect();
    write_set(directory, &samples, &truth, &views);
}

/// A directory with a set of each kind, and something else.
fn recordings() -> TempDir {
    let home = TempDir::new().unwrap();
    write_yard(&home.path().join("yard"));
    write_line(&home.path().join("line"));
    write_site(&home.path().join("site"));
    fs::create_dir(home.path().join("notes")).unwrap();
    fs::write(home.path().join("README.md"), "no set").unwrap();
    home
}

#[test]
fn each_set_is_measured_as_its_own_command_would() {
    let home = recordings();
    let [yard, line, site] = ["yard", "line", "site"].map(|name| home.path().join(name));
    let report = lab(&["replay", "real", text(home.path()), "--json"]).json();
    let names: Vec<_> = report["sets"].as_object().unwrap().keys().collect();
    assert_eq!(names, ["line", "site", "yard"]);

    let alone = lab(&["replay", "csv", text(&yard), "--json"]).json();
    let mower = &report["sets"]["yard"]["agents"]["mower"];
    assert!(mower["causal_aligned_ate_rmse_m"].as_f64().unwrap() > 0.0);
    for (name, error) in mower.as_object().unwrap() {
        assert_eq!(error, &alone["robots"]["mower"][name], "{name}");
    }

    let taught = ["--taught", "early", "--within-m", "15", "--json"];
    let args = ["replay", "sequences", text(&line)];
    let alone = lab(&[&args[..], &taught].concat()).json();
    let row = &report["sets"]["line"];
    assert_eq!(
        (&row["taught"], &row["within_m"]),
        (&"early".into(), &15.0.into())
    );
    for figure in [
        "agent",
        "questions",
        "right",
        "claims",
        "claims_right",
        "calibration",
    ] {
        assert_eq!(row["rows"][0][figure], alone["rows"][0][figure], "{figure}");
    }
    assert!(row["rows"][0]["right"].as_f64().unwrap() > 0.9, "{row}");

    let (teach, most) = ((SESSIONS * 2 / 3).to_string(), SESSIONS.to_string());
    let args = ["replay", "csv", text(&site), "--one-space", "--teach"];
    let more = [&teach, "--max-agents", &most, "--shuffle", "1", "--json"];
    let alone = lab(&[&args[..], &more].concat()).json();
    for (name, figure) in alone["waking"].as_object().unwrap() {
        assert_eq!(figure, &report["sets"]["site"][name], "{name}");
    }
    assert_eq!(report["sets"]["site"]["woken"], 18);
}

#[test]
fn what_was_claimed_is_counted() {
    let home = recordings();
    let report = lab(&["replay", "real", text(home.path()), "--json"]).json();
    let calibration = &report["calibration"];
    let told = &calibration["positions"][0];
    assert_eq!(
        (&told["start"], &told["agents"]),
        (&"told".into(), &37.into())
    );
    let shares: Vec<f64> = { told["came"].as_array().unwrap().iter() }
        .map(|share| share.as_f64().unwrap())
        .collect();
    assert!(shares.is_sorted() && shares[2] <= 1.0, "{shares:?}");
    let count = |bins: &Value| {
        let bins = bins.as_array().unwrap().iter();
        bins.map(|bin| bin["count"].as_u64().unwrap()).sum::<u64>()
    };
    assert_eq!(count(&calibration["answers"]), 30);
    let printed = lab(&["replay", "real", text(home.path()), "--taught", "late"]);
    let printed = printed.text();
    for word in ["dead reckoning", "woken up", "mower", "site", "99 %"] {
        assert!(printed.contains(word), "{word}: {printed}");
    }
    let row = printed
        .lines()
        .find(|line| line.starts_with("line"))
        .unwrap();
    assert!(row.contains("early  late"), "{row}");
}

#[test]
fn a_set_may_stand_alone() {
    let home = recordings();
    let yard = home.path().join("yard");
    let report = lab(&["replay", "real", text(&yard), "--json"]).json();
    let names: Vec<_> = report["sets"].as_object().unwrap().keys().collect();
    assert_eq!(names, ["yard"]);
}

#[test]
fn a_set_that_cannot_be_read_is_named_after_the_others_were_measured() {
    let home = recordings();
    fs::remove_dir_all(home.path().join("site")).unwrap();
    let broken = home.path().join("broken");
    write_set(&broken, "0,one,hop,1,2\n", "", &[]);
    write_set(&home.path().join("blind"), "0,one,level,light,2\n", "", &[]);
    let finished = lab(&["replay", "real", text(home.path())]);
    assert_eq!(finished.code(), 1, "{finished:?}");
    assert!(finished.stdout.contains("mower") && finished.stdout.contains("late"));
    for word in ["broken", "line 2", "hop", "blind", "truth"] {
        assert!(
            finished.stderr.contains(word),
            "{word}: {}",
            finished.stderr
        );
    }
    let finished = lab(&["replay", "real", text(home.path()), "--json"]);
    let report: Value = serde_json::from_str(&finished.stdout).unwrap();
    let unread: Vec<_> = report["unread"].as_object().unwrap().keys().collect();
    assert_eq!(unread, ["blind", "broken"]);
    assert_eq!(finished.code(), 1);
}

#[test]
fn what_a_set_has_not_is_named() {
    let home = TempDir::new().unwrap();
    let lines = "0,a,level,light,1\n1,a,velocity,1,0,0.1,1\n";
    write_set(home.path(), lines, "0,a,0,0,0,,\n1,a,1,0,0,,\n", &[]);
    for (command, why) in [
        (["csv", "--no", "lihgt"], "no such channel; it has light"),
        (["sequences", "--taught", "b"], "no agent b; it has a"),
        (["sequences", "--taught", "a"], "nobody is left to ask for"),
    ] {
        let [kind, flag, name] = command;
        let finished = lab(&["replay", kind, text(home.path()), flag, name]);
        assert_eq!(finished.code(), 1, "{finished:?}");
        assert!(finished.stderr.contains(why), "{}", finished.stderr);
    }
}

#[test]
fn a_directory_without_a_set_is_named() {
    let home = TempDir::new().unwrap();
    fs::create_dir(home.path().join("empty")).unwrap();
    let absent = home.path().join("absent");
    for (directory, why) in [(home.path(), "samples.csv"), (&absent, "absent")] {
        let finished = lab(&["replay", "real", text(directory)]);
        assert_eq!(
            (finished.code(), &*finished.stdout),
            (1, ""),
            "{finished:?}"
        );
        assert!(finished.stderr.contains(why), "{}", finished.stderr);
    }
}
