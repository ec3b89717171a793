//! Clients that ask for much, over and over: health is answered at once, and each of them in its
//! turn.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use cogmap_client::RobotSettings;
use cogmap_proto::{Codec, LocalizeQuery};
use cogmap_tests::{Drive, Http, LONG, Server};
use serde_json::{Value, json};

use crate::quantile::quantile;

/// Clients, each with one of the questions.
const CLIENTS: usize = 16;
/// Samples of the map that they ask about.
const SAMPLES: usize = 60_000;
/// Samples of each question where they were taken.
const LOST_SAMPLES: usize = 300;
/// How long they ask.
const LOOK: Duration = Duration::from_secs(20);
/// Pause between two looks at the health.
const PAUSE: Duration = Duration::from_millis(10);
/// Longest time for the health, but for one in a hundred.
const HEALTH_MAX: Duration = Duration::from_millis(20);
/// What is asked for.
const QUESTIONS: [&str; 8] = [
    "/export",
    "/export?format=g2o",
    "/agents/ada/trajectory?kind=refined&limit=1000",
    "/localize",
    "/export?format=ply",
    "/places?limit=1000&since_ns=1",
    "/export?format=tum&agent=ada",
    "/trips?limit=1000",
];

/// Asks until it is told to stop; returns how many answers of each status came.
fn ask(http: &Http, question: &str, body: &[u8], stop: &AtomicBool) -> BTreeMap<u16, u64> {
    let mut statuses = BTreeMap::new();
    let path = format!("/v1/spaces/default{question}");
    while !stop.load(Ordering::Relaxed) {
        let answer = match question {
            "/localize" => http.post(&path, "application/json", body),
            _ => http.get(&path),
        };
        *statuses.entry(answer.status).or_default() += 1;
        if answer.status == 503 {
            thread::sleep(Duration::from_secs(1)); // as Retry-After says
        }
    }
    statuses
}

pub(crate) fn run() -> Value {
    let mut server = Server::start(&[]);
    let settings = RobotSettings {
        session: Some(1),
        batch_samples: 256,
        ..RobotSettings::default()
    };
    let robot = server.robot_with("ada", settings);
    for samples in Drive::new(1).take(SAMPLES).collect::<Vec<_>>().chunks(500) {
        robot
            .send_batch(samples.to_vec())
            .expect("the robot takes samples");
    }
    robot.flush(LONG).expect("everything becomes durable");
    let query = LocalizeQuery {
        samples: Drive::new(1).skip(500).take(LOST_SAMPLES).collect(),
    };
    let body = Arc::new(Codec::Json.encode(&query));
    let stop = Arc::new(AtomicBool::new(false));
    let clients: Vec<_> = (0..CLIENTS)
        .map(|number| {
            let (http, stop, body) = (server.http(), Arc::clone(&stop), Arc::clone(&body));
            let question = QUESTIONS[number % QUESTIONS.len()];
            thread::spawn(move || (question, ask(&http, question, &body, &stop)))
        })
        .collect();
    let (http, begun) = (server.http(), Instant::now());
    let mut times = Vec::new();
    while begun.elapsed() < LOOK {
        let asked = Instant::now();
        let answer = http.get("/healthz");
        times.push(asked.elapsed());
        assert_eq!(answer.status, 200, "{answer:?}");
        thread::sleep(PAUSE);
    }
    stop.store(true, Ordering::Relaxed);
    let mut answers: BTreeMap<&str, BTreeMap<u16, u64>> = BTreeMap::new();
    for client in clients {
        let (question, statuses) = client.join().expect("the client ends");
        for (status, count) in statuses {
            *answers
                .entry(question)
                .or_default()
                .entry(status)
                .or_default() += count;
        }
    }
    let (p50, p99) = (quantile(&mut times, 0.5), quantile(&mut times, 0.99));
    eprintln!("health: {p50:?}, {p99:?}; answers: {answers:?}");
    for (question, statuses) in &answers {
        assert!(
            statuses.get(&200).is_some_and(|count| *count > 0),
            "{question} has no answer"
        );
        let known = statuses.keys().all(|status| [200, 503].contains(status));
        assert!(known, "{question}: {statuses:?}");
    }
    assert!(p99 <= HEALTH_MAX, "health took {p99:?}");
    server.terminate();
    json!({
        "health_p50_s": p50.as_secs_f64(),
        "health_p99_s": p99.as_secs_f64(),
        "answers": answers.into_iter().map(|(question, statuses)| {
            (question, statuses.get(&200).copied().unwrap_or_default())
        }).collect::<BTreeMap<_, _>>(),
    })
}
