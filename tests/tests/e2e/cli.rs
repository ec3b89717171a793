//! The commands: exit codes, what they print, and that they agree with the service.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::net::TcpListener;
use std::path::Path;

use cogmap_proto::SeqRange;
use cogmap_tests::{Drive, Server, lab, run, seed};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use tempfile::TempDir;

use crate::feeding::{journaled, post_all};

const USAGE: i32 = 2;
const FAILED: i32 = 1;

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn check_config_prints_what_holds_and_refuses_what_is_unknown() {
    let home = TempDir::new().unwrap();
    let file = home.path().join("cogmap.toml");
    fs::write(
        &file,
        "[engine]\nagents_max = 7\n[http]\ntoken = \"s3cret\"\n",
    )
    .unwrap();
    let check = |more: &[&str]| {
        let args = ["check-config", "--config", text(&file)];
        run(&args.iter().chain(more).copied().collect::<Vec<_>>())
    };
    let plain = check(&["--set", "engine.spaces_max=9", "--http", "127.0.0.1:81"]);
    let printed = plain.text();
    for line in [
        "agents_max = 7",
        "spaces_max = 9",
        "listen = \"127.0.0.1:81\"",
        "[spaces.default]",
    ] {
        assert!(printed.contains(line), "{line} is not in\n{printed}");
    }
    assert!(!printed.contains("s3cret"), "the secret is printed");
    // What is printed is a file of settings itself.
    fs::write(&file, printed).unwrap();
    assert_eq!(check(&[]).text(), printed);

    for (bad, named) in [
        ("engine.agent_max=7", "agent_max"),
        ("engine.agents_max=many", "agents_max"),
        ("engine.agents_max=0", "engine.agents_max"),
        ("nonsense", "key=value"),
        ("zenoh.listen=[\"udp/127.0.0.1:1\"]", "zenoh.listen"),
        ("spaces.lab.grid_modules=99", "grid_modules"),
    ] {
        let refused = check(&["--set", bad]);
        assert_eq!(
            (refused.code(), &*refused.stdout),
            (USAGE, ""),
            "{bad}: {refused:?}"
        );
        assert!(refused.stderr.contains(named), "{bad}: {}", refused.stderr);
    }
    fs::write(&file, "[engine]\nagents_maximum = 7\n").unwrap();
    let refused = check(&[]);
    assert_eq!(refused.code(), USAGE);
    assert!(
        refused.stderr.contains("agents_maximum"),
        "{}",
        refused.stderr
    );
    let absent = run(&["check-config", "--config", "/nowhere/cogmap.toml"]);
    assert_eq!(absent.code(), USAGE);
    assert!(
        absent.stderr.contains("/nowhere/cogmap.toml"),
        "{}",
        absent.stderr
    );
}

#[test]
fn wrong_usage_is_two_and_a_failure_is_one() {
    for args in [
        &[][..],
        &["fly"],
        &["serve", "--fast"],
        &["demo", "--robots", "0"],
    ] {
        let refused = run(args);
        assert_eq!(refused.code(), USAGE, "{args:?}: {refused:?}");
        assert!(
            refused.stderr.contains("--help"),
            "{args:?}: {}",
            refused.stderr
        );
    }
    assert_eq!(lab(&["replay"]).code(), USAGE);
    for (failed, name) in [
        (
            run(&["export", "journal", "--data-dir", "/nowhere"]),
            "cogmap: ",
        ),
        (lab(&["replay", "mrclam", "/nowhere"]), "cogmap-lab: "),
    ] {
        assert_eq!((failed.code(), &*failed.stdout), (FAILED, ""), "{name}");
        assert!(failed.stderr.starts_with(name), "{}", failed.stderr);
    }
    assert!(run(&["--version"]).text().starts_with("cogmap "));
    assert!(run(&["serve", "--help"]).text().contains("--data-dir"));
}

#[test]
fn a_second_service_on_one_store_or_one_port_says_what_is_taken() {
    let server = Server::start(&[]);
    let other = Server::stopped(&[]).with_data_in(server.data());
    let refused = run(&other
        .arguments()
        .iter()
        .map(String::as_str)
        .collect::<Vec<_>>());
    assert_eq!(refused.code(), FAILED);
    assert!(
        refused.stderr.contains("in use by another process"),
        "{}",
        refused.stderr
    );
    assert!(
        refused.stderr.contains(text(server.data())),
        "{}",
        refused.stderr
    );
    let refused = run(&["export", "journal", "--data-dir", text(server.data())]);
    assert_eq!(refused.code(), FAILED);
    assert!(
        refused.stderr.contains("in use by another process"),
        "{}",
        refused.stderr
    );

    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = listener.local_addr().unwrap().to_string();
    let home = TempDir::new().unwrap();
    let data = home.path().join("data");
    let refused = run(&["serve", "--http", &taken, "--data-dir", text(&data)]);
    assert_eq!(refused.code(), FAILED);
    assert!(refused.stderr.contains(&taken), "{}", refused.stderr);
    let fourth = Server::stopped(&[]);
    let zenoh = format!("tcp/{taken}");
    let mut args = fourth.arguments();
    args.extend(["--zenoh".to_owned(), zenoh.clone()]);
    // A flag twice is wrong usage, so the endpoint comes as a setting.
    args.retain(|arg| *arg != zenoh && *arg != fourth.endpoint() && arg != "--zenoh");
    args.extend(["--set".to_owned(), format!("zenoh.listen=[\"{zenoh}\"]")]);
    let refused = run(&args.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(refused.code(), FAILED);
    assert!(refused.stderr.contains(&taken), "{}", refused.stderr);
    // The first one has noticed nothing.
    assert_eq!(server.http().get("/readyz").status, 200);
}

#[test]
fn exports_hold_all_that_was_sent() {
    let mut server = Server::start(&[]);
    let samples: Vec<_> = Drive::new(seed(60)).take(1200).collect();
    post_all(&server, "ada", 7, &samples);
    let tum = server
        .http()
        .get("/v1/spaces/default/agents/ada/trajectory?format=tum&limit=1000");
    let rows = server
        .api()
        .trajectory("default", "ada")
        .unwrap()
        .poses
        .len();
    server.terminate();
    let data = text(server.data()).to_owned();
    let journal = run(&["export", "journal", "--data-dir", &data]);
    assert_eq!(
        journaled(journal.text(), 7),
        [SeqRange { from: 0, to: 1200 }]
    );
    let enrolled: Vec<Value> = journal
        .text()
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap())
        .filter(|entry| entry.get("Enrol").is_some())
        .collect();
    assert_eq!(enrolled.len(), 1);
    assert_eq!(enrolled[0]["Enrol"]["name"], "ada");
    // Folded anew from the journal, the trajectory has the numbers that were served.
    let exported = run(&[
        "export",
        "trajectory",
        "--data-dir",
        &data,
        "--agent",
        "ada",
    ]);
    let numbers = |text: &str| -> Vec<Vec<f64>> {
        let lines = text.lines();
        lines
            .map(|line| {
                line.split(' ')
                    .map(|number| number.parse().unwrap())
                    .collect()
            })
            .collect()
    };
    let (exported, served) = (numbers(exported.text()), numbers(&tum.body));
    // A page has at most a thousand.
    assert_eq!((exported.len(), served.len()), (rows, rows.min(1000)));
    for (exported, served) in exported.iter().zip(&served) {
        let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-8;
        assert!(
            exported.iter().zip(served).all(near),
            "{exported:?} {served:?}"
        );
    }
    let unknown = run(&[
        "export",
        "trajectory",
        "--data-dir",
        &data,
        "--agent",
        "bea",
    ]);
    assert_eq!(unknown.code(), FAILED);
    assert!(unknown.stderr.contains("bea"), "{}", unknown.stderr);
}

/// A data set of three robots in the format of UTIAS MRCLAM: arcs with different speeds, noisy
/// odometry, and sightings of four landmarks and of one another.
fn write_data_set(directory: &Path, seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let landmarks = [[2.0, 2.0], [-2.0, 2.0], [-2.0, -2.0], [2.0, -2.0]];
    let barcode = |subject: usize| 10 * subject + 5;
    let mut barcodes = String::from("# Subject Barcode\n");
    let subjects = [1, 2, 3, 6, 7, 8, 9];
    for subject in subjects {
        writeln!(barcodes, "{subject} {}", barcode(subject)).unwrap();
    }
    fs::write(directory.join("Barcodes.dat"), barcodes).unwrap();
    let mut surveyed = String::new();
    for (subject, [x, y]) in (6..).zip(landmarks) {
        writeln!(surveyed, "{subject} {x} {y} 0.001 0.001").unwrap();
    }
    fs::write(directory.join("Landmark_Groundtruth.dat"), surveyed).unwrap();
    for robot in 1..=3_usize {
        let (speed_m_s, turn_rad_s) = (0.1 + 0.05 * robot as f64, 0.2 - 0.05 * robot as f64);
        let [mut x, mut y, mut heading] = [robot as f64 - 2.0, 0.0, 0.3 * robot as f64];
        let [mut odometry, mut truth, mut seen] = [const { String::new() }; 3];
        for step in 0..600_u32 {
            let time_s = 100.0 + 0.1 * f64::from(step) + 0.01 * robot as f64;
            let noise: f64 = random.random_range(-0.02..0.02);
            writeln!(
                odometry,
                "{time_s:.3} {:.4} {:.4}",
                speed_m_s + noise,
                turn_rad_s + noise
            )
            .unwrap();
            writeln!(truth, "{time_s:.3} {x:.5} {y:.5} {heading:.5}").unwrap();
            if step as usize % 15 == robot {
                let number = random.random_range(0..landmarks.len());
                let (dx, dy) = (landmarks[number][0] - x, landmarks[number][1] - y);
                let azimuth = dy.atan2(dx) - heading;
                let azimuth = azimuth.sin().atan2(azimuth.cos());
                let code = barcode(6 + number);
                writeln!(seen, "{time_s:.3} {code} {:.4} {azimuth:.4}", dx.hypot(dy)).unwrap();
            }
            x += 0.1 * speed_m_s * heading.cos();
            y += 0.1 * speed_m_s * heading.sin();
            heading += 0.1 * turn_rad_s;
            heading = heading.sin().atan2(heading.cos());
        }
        for (table, text) in [
            ("Odometry", odometry),
            ("Groundtruth", truth),
            ("Measurement", seen),
        ] {
            let file = format!("Robot{robot}_{table}.dat");
            fs::write(directory.join(file), text).unwrap();
        }
    }
}

fn files(directory: &Path) -> BTreeMap<String, String> {
    let entries = fs::read_dir(directory).unwrap().map(Result::unwrap);
    entries
        .map(|entry| {
            let name = entry.file_name().into_string().unwrap();
            (name, fs::read_to_string(entry.path()).unwrap())
        })
        .collect()
}

/// Takes out of a replay's report what is measured in the core only; answers whether it was there.
fn timeless(report: &mut Value) -> bool {
    let report = report.as_object_mut().unwrap();
    let update_ms = report.remove("update_ms").unwrap();
    report.remove("relaxation_ms").unwrap();
    let factor = report.remove("real_time_factor").unwrap();
    report.remove("closures"); // a service does not tell their number
    assert_eq!(update_ms["p99"].is_number(), factor.is_number());
    let robots = report["robots"].as_object_mut().unwrap();
    for robot in robots.values_mut() {
        robot["consistency"]["nees_mean"].take();
        robot["consistency"]["nees"].take();
    }
    report["consistency"]["nees_mean"].take();
    report["consistency"]["nees"].take();
    factor.is_number()
}

#[test]
fn a_replay_gives_the_same_map_offline_and_through_the_service_in_any_batches() {
    let home = TempDir::new().unwrap();
    let set = home.path().join("set");
    fs::create_dir(&set).unwrap();
    write_data_set(&set, seed(61));
    let server = Server::start(&[]);
    let (endpoint, url) = (server.endpoint(), server.url());
    let online = ["--connect", &*endpoint, "--http", &*url];
    let ways: [(&str, &[&str]); 4] = [
        ("offline", &[]),
        ("offline-1", &["--batch", "1"]),
        ("online", &online),
        (
            "online-7",
            &[
                "--batch",
                "7",
                "--space",
                "again",
                "--connect",
                &endpoint,
                "--http",
                &url,
            ],
        ),
    ];
    let results = ways.map(|(name, more)| {
        let out = home.path().join(name);
        let args = [
            "replay",
            "mrclam",
            text(&set),
            "--json",
            "--out",
            text(&out),
        ];
        let mut report = lab(&args.iter().chain(more).copied().collect::<Vec<_>>()).json();
        let times = timeless(&mut report);
        assert_eq!(
            times,
            name.starts_with("offline"),
            "{name}: only the core is timed"
        );
        (name, report, files(&out))
    });
    let (_, report, trajectories) = &results[0];
    let names: Vec<_> = trajectories.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        [
            "robot1.causal.tum",
            "robot1.refined.tum",
            "robot2.causal.tum",
            "robot2.refined.tum",
            "robot3.causal.tum",
            "robot3.refined.tum"
        ]
    );
    let rows = |kind: &str| {
        let of_kind = trajectories
            .iter()
            .filter(move |(name, _)| name.contains(kind));
        of_kind.map(|(_, text)| text.lines().count()).min().unwrap()
    };
    assert!(rows("causal") > 500 && rows("refined") > 20);
    assert_eq!(report["landmarks"], 4);
    assert!(report["samples"].as_u64().unwrap() > 1800, "{report}");
    let error_m = report["causal_ate_rmse_m"].as_f64().unwrap();
    assert!(error_m < 1.0, "{error_m} m off");
    for (name, other, others) in &results[1..] {
        assert!(others == trajectories, "{name}: other trajectories");
        assert_eq!(other, report, "{name}");
    }
    // The digest is of the map, and the map is the service's.
    let served = server.api().space("mrclam").unwrap();
    assert_eq!(results[2].1["digest"], served.digest);
    // A space that exists is not mixed up with the replay.
    let again = [
        "replay",
        "mrclam",
        text(&set),
        online[0],
        online[1],
        online[2],
        online[3],
    ];
    let refused = lab(&again);
    assert_eq!(refused.code(), FAILED);
    assert!(refused.stderr.contains("exists"), "{}", refused.stderr);
    // Another set is another map.
    write_data_set(&set, seed(61) + 1);
    let other = lab(&["replay", "mrclam", text(&set), "--json"]).json();
    assert_ne!(other["digest"], results[0].1["digest"]);
}

#[test]
fn the_demo_sums_up_what_its_robots_did() {
    let home = TempDir::new().unwrap();
    let data = home.path().join("data");
    let demo = run(&[
        "demo",
        "--duration",
        "3",
        "--json",
        "--data-dir",
        text(&data),
    ]);
    let summary = demo.json();
    let robots = summary["robots"].as_array().unwrap();
    assert_eq!(robots.len(), 5);
    let number = |key: &str| summary[key].as_u64().unwrap();
    assert!(number("samples_sent") > 0);
    assert_eq!(number("samples_durable"), number("samples_sent"));
    assert_eq!(number("samples_applied"), number("samples_sent"));
    assert!(number("places") > 0);
    for robot in robots.iter().chain([&summary]) {
        for key in ["dead_reckoning_ate_rmse_m", "causal_ate_rmse_m"] {
            let error_m = robot[key].as_f64();
            assert!(
                error_m.is_some_and(|e| e.is_finite() && e < 10.0),
                "{key}: {robot}"
            );
        }
    }
    // What it kept is what it said.
    let journal = run(&[
        "export",
        "journal",
        "--data-dir",
        text(&data),
        "--space",
        "demo",
    ]);
    let kept: u64 = journal
        .text()
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap())
        .filter_map(|entry| entry["Samples"]["batch"]["samples"].as_array().cloned())
        .flatten()
        // Each robot ends its session by a last sample of the client's own.
        .filter(|sample| !sample["body"].to_string().contains("session_end"))
        .count() as u64;
    assert_eq!(kept, number("samples_sent"));
}
