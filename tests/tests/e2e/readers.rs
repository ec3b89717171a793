//! Readers and senders at once: neither stalls the other.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use cogmap_client::RobotSettings;
use cogmap_proto::RecallQuery;
use cogmap_tests::{Drive, Http, LONG, Server, seed};
use serde_json::json;

use crate::feeding::{Outcome, assert_exactly_once};

const AGENT: &str = "ada";
const SESSION: u64 = 7;
const SAMPLES: usize = 20_000;
/// What readers ask for, each of it in a loop.
const PATHS: [&str; 8] = [
    "",
    "/agents",
    "/agents/ada",
    "/agents/ada/trajectory?limit=1000",
    "/places?limit=1000",
    "/trips",
    "/landmarks",
    "/export",
];

/// Reads everything in turn until told to stop; returns the number of rounds. Revisions never fall.
fn read_on(http: &Http, stop: &AtomicBool) -> u64 {
    let (mut rounds, mut revision) = (0, 0);
    while !stop.load(Ordering::Relaxed) {
        for path in PATHS {
            let answer = http.get(&format!("/v1/spaces/default{path}"));
            assert_eq!(answer.status, 200, "{path}: {answer:?}");
            if path.is_empty() {
                let now = answer.json(200)["map_revision"].as_u64().unwrap();
                assert!(now >= revision, "{revision} became {now}");
                revision = now;
            }
        }
        let cue = json!({"position_m": [1.0, 0.0, 0.0]});
        http.post_json("/v1/spaces/default/recall", &cue).json(200);
        rounds += 1;
    }
    rounds
}

#[test]
fn reads_answer_during_a_flood_and_take_nothing_from_it() {
    let mut server = Server::start(&["engine.checkpoint_interval_s=0.5"]);
    let samples: Vec<_> = Drive::new(seed(50)).take(SAMPLES).collect();
    let settings = RobotSettings {
        session: Some(SESSION),
        batch_samples: 256,
        ..RobotSettings::default()
    };
    let robot = server.robot_with(AGENT, settings);
    // The agent exists before anyone asks for it.
    robot.send_batch(samples[..1].to_vec()).unwrap();
    robot.flush(LONG).unwrap();
    let stop = Arc::new(AtomicBool::new(false));
    let readers: Vec<_> = (0..2)
        .map(|_| {
            let (http, stop) = (server.http(), Arc::clone(&stop));
            thread::spawn(move || read_on(&http, &stop))
        })
        .collect();
    // A flood: no pause between batches but that which a full window makes.
    for samples in samples[1..].chunks(500) {
        robot.send_batch(samples.to_vec()).unwrap();
    }
    robot.flush(LONG).unwrap();
    stop.store(true, Ordering::Relaxed);
    let rounds: u64 = readers
        .into_iter()
        .map(|reader| reader.join().unwrap())
        .sum();
    assert!(rounds > 0, "nobody read anything during the flood");
    eprintln!("{rounds} rounds of reading during {SAMPLES} samples");
    assert_exactly_once(&server, AGENT, SESSION, SAMPLES);
    let read = Outcome::read(&server.api(), AGENT);
    assert!(read == Outcome::undisturbed(AGENT, SESSION, &samples));
    server.terminate();
}

#[test]
fn what_a_reader_is_shown_does_not_change_under_its_hands() {
    let server = Server::start(&[]);
    let stop = Arc::new(AtomicBool::new(false));
    let robot = server.robot(AGENT, SESSION);
    robot
        .send_batch(Drive::new(seed(51)).take(1).collect())
        .unwrap();
    robot.flush(LONG).unwrap();
    let sender = {
        let stop = Arc::clone(&stop);
        let mut drive = Drive::new(51).skip(1);
        thread::spawn(move || {
            while !stop.load(Ordering::Relaxed) {
                robot.send_batch(drive.by_ref().take(50).collect()).unwrap();
                thread::sleep(std::time::Duration::from_millis(5));
            }
            robot.flush(LONG).unwrap();
        })
    };
    let http = server.http();
    for _ in 0..30 {
        // One answer is of one moment: its counts and its lists agree.
        let export = http.get("/v1/spaces/default/export").json(200);
        for list in ["places", "trips", "landmarks"] {
            let told = export["space"][list].as_u64().unwrap();
            assert_eq!(
                export[list].as_array().unwrap().len() as u64,
                told,
                "{list}"
            );
        }
        let cue = RecallQuery {
            limit: Some(1000),
            ..RecallQuery::default()
        };
        let answer = server.api().recall("default", &cue).unwrap();
        assert!(answer.map_revision > 0 && answer.places.len() <= 1000);
    }
    stop.store(true, Ordering::Relaxed);
    sender.join().unwrap();
}
