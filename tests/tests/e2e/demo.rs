//! What somebody sees who looks at the demo: robots that are found, one that is carried off, and an
//! object that is recognised by touch. Nothing here waits for a moment: the robots' clock decides.

use std::net::TcpListener;

use cogmap_tests::{Server, run};
use serde_json::Value;
use tempfile::TempDir;

/// Of the command line.
const FAILED: i32 = 1;
const USAGE: i32 = 2;

fn number(record: &Value, key: &str) -> f64 {
    let number = record[key].as_f64();
    number.unwrap_or_else(|| panic!("{key} is no number in {record}"))
}

#[test]
fn the_demo_loses_robots_and_finds_them_and_recognises_a_cup() {
    let demo = run(&["demo", "--seed", "4", "--speed", "2", "--json"]);
    let summary = demo.json();
    let told = &demo.stderr;
    // Where to look comes before anything else.
    let first = told.lines().position(|line| line.starts_with("look at"));
    let begins = told.lines().position(|line| line.contains(" set out "));
    assert!(first.is_some() && first < begins, "{told}");
    assert!(told.contains("/?space=demo"), "{told}");

    let searches = summary["searches"].as_array().expect("a list");
    let of = |cause: &str| {
        let found = searches.iter().find(|search| search["cause"] == cause);
        found.unwrap_or_else(|| panic!("nobody was {cause}: {summary}"))
    };
    let woken = of("woken");
    assert_eq!(woken["robot"], "robot4");
    assert!(told.contains("robot4 wakes up"), "{told}");
    let carried = of("carried");
    assert_eq!(carried["robot"], "robot5");
    assert!(told.contains("robot5 is carried off"), "{told}");
    assert!(number(carried, "carried_m") > 3.9, "{carried}");
    // The order of things is that of their causes, and the end is the truth.
    assert!(number(carried, "noticed_s") >= number(carried, "at_s"));
    assert!(number(carried, "found_s") >= number(carried, "noticed_s"));
    for search in [woken, carried] {
        assert!(
            number(search, "found_s") > number(search, "at_s"),
            "{search}"
        );
        assert!(number(search, "error_m") < 0.5, "{search}");
    }
    assert!(told.contains("robot4 is found, "), "{told}");
    assert!(told.contains("robot5 is found again, "), "{told}");

    let objects = summary["objects"].as_array().expect("a list");
    assert_eq!(objects.len(), 1, "{summary}");
    assert_eq!(objects[0]["object"], objects[0]["recognised"]);
    assert!(number(&objects[0], "contacts") >= 3.0, "{summary}");
    assert!(told.contains("is recognised after"), "{told}");

    // Dead reckoning never notices the carry; the service knows where the robot is.
    let robots = summary["robots"].as_array().expect("a list");
    assert_eq!(robots.len(), 5);
    let fifth = &robots[4];
    assert_eq!(fifth["name"], "robot5");
    let reckoned_m = number(fifth, "dead_reckoning_end_error_m");
    assert!(reckoned_m > 2.0, "{fifth}");
    assert!(
        number(fifth, "causal_end_error_m") < reckoned_m / 2.0,
        "{fifth}"
    );
}

#[test]
fn the_acts_come_again_against_a_service_that_is_there() {
    let server = Server::start(&[]);
    let (endpoint, url) = (server.endpoint(), server.url());
    let of_service = ["--connect", &endpoint, "--http", &url, "--space", "default"];
    let mut args = vec!["demo", "--duration", "90", "--speed", "3", "--json"];
    args.extend(of_service);
    let summary = run(&args).json();
    let searches = summary["searches"].as_array().expect("a list");
    let woken: Vec<_> = searches.iter().filter(|s| s["cause"] == "woken").collect();
    // The robot was removed in between, so it knows as little the second time.
    assert_eq!(woken.len(), 2, "{summary}");
    for search in woken {
        assert!(
            number(search, "lost_s") >= number(search, "at_s"),
            "{search}"
        );
        assert!(
            number(search, "found_s") > number(search, "at_s"),
            "{search}"
        );
    }
}

#[test]
fn what_does_not_fit_into_a_short_demo_does_not_happen() {
    let demo = run(&["demo", "--duration", "2", "--json", "--robots", "3"]);
    let summary = demo.json();
    assert_eq!(summary["searches"], Value::Array(Vec::new()));
    assert_eq!(summary["objects"], Value::Array(Vec::new()));
    let robots = summary["robots"].as_array().expect("a list");
    assert_eq!(robots.len(), 3);
    for robot in robots {
        assert!(number(robot, "causal_ate_rmse_m") < 1.0, "{robot}");
    }
}

#[test]
fn a_demo_tells_that_it_goes_elsewhere_where_the_usual_ports_are_taken() {
    // Whoever else has them takes them as well.
    let _http = TcpListener::bind("127.0.0.1:8080");
    let _zenoh = TcpListener::bind("127.0.0.1:7447");
    let demo = run(&["demo", "--duration", "1", "--json"]);
    demo.json();
    let says = |words: &str| {
        let line = demo.stderr.lines().find(|line| line.contains(words));
        assert!(line.is_some(), "{words}: {}", demo.stderr);
    };
    says("127.0.0.1:8080 is taken by another program, so HTTP is at 127.0.0.1:");
    says("tcp/127.0.0.1:7447 is taken by another program, so Zenoh is at tcp/127.0.0.1:");
    says("if rmw_zenohd runs there, be its client: cogmap demo --set zenoh.mode=client");
}

#[test]
fn a_port_that_was_asked_for_and_is_taken_is_refused_in_one_sentence() {
    // What the demo chooses instead of this one does not help with the other.
    let _zenoh = TcpListener::bind("127.0.0.1:7447");
    let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
    let taken = listener.local_addr().expect("an address").to_string();
    let home = TempDir::new().expect("a directory");
    let data = home.path().join("data");
    let data = data.to_str().expect("it is text");
    let (http, endpoint) = (format!("http.listen={taken}"), format!("tcp/{taken}"));
    let zenoh = format!("zenoh.listen={endpoint}");
    let free = ["--http", "127.0.0.1:0"];
    for command in ["serve", "demo"] {
        let refused = run(&[command, "--set", &http, "--data-dir", data]);
        assert_eq!(refused.code(), FAILED, "{refused:?}");
        let words = format!("cogmap: HTTP cannot listen on {taken}, since another program does");
        assert!(refused.stderr.contains(&words), "{}", refused.stderr);
        assert!(refused.stderr.contains("--set http.listen="));
        let refused = run(&[
            command,
            "--set",
            &zenoh,
            "--data-dir",
            data,
            free[0],
            free[1],
        ]);
        assert_eq!(refused.code(), FAILED, "{refused:?}");
        let words =
            format!("cogmap: Zenoh cannot listen on {endpoint}, since another program does");
        assert!(refused.stderr.contains(&words), "{}", refused.stderr);
        let client = format!(
            "be its client: cogmap serve --set zenoh.mode=client --set zenoh.connect={endpoint}"
        );
        assert!(refused.stderr.contains(&client), "{}", refused.stderr);
    }
}

#[test]
fn the_demo_takes_settings_as_the_service_does() {
    let home = TempDir::new().expect("a directory");
    let file = home.path().join("cogmap.toml");
    let settings = "[http]\nlisten = \"127.0.0.1:0\"\ntoken = \"open-sesame\"\n\
                    [spaces.other]\nfield_radius_m = 0.5\n";
    std::fs::write(&file, settings).expect("written");
    let file = file.to_str().expect("it is text");
    // The robots know the token.
    let demo = run(&["demo", "--duration", "1", "--json", "--config", file]);
    assert!(demo.json()["samples_sent"].as_u64() > Some(0));
    let refused = run(&["demo", "--set", "engine.agents=5"]);
    assert_eq!(refused.code(), USAGE, "{refused:?}");
    let refused = run(&["demo", "--set", "zenoh.enabled=false"]);
    assert_eq!(refused.code(), USAGE, "{refused:?}");
    assert!(
        refused.stderr.contains("zenoh.enabled"),
        "{}",
        refused.stderr
    );
}
