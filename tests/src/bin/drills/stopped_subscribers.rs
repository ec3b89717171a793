//! Subscribers to everything that stop reading: nobody else notices.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use cogmap_client::RobotSettings;
use cogmap_tests::{Drive, LONG, Server};
use serde_json::{Value, json};

use crate::subscriber::Subscriber;
use crate::watermarks::Watermarks;

/// Subscribers that stop.
const STOPPED: usize = 5;
/// Robots, samples in one call of each, and the pause between calls: 10,000 samples a second.
const ROBOTS: u32 = 10;
const CALL_SAMPLES: usize = 20;
const CALL_PAUSE: Duration = Duration::from_millis(20);
/// How long is looked before and after they stop. Zenoh gives up silent sessions after ten seconds.
const BEFORE: Duration = Duration::from_secs(5);
const AFTER: Duration = Duration::from_secs(20);
/// Longest time between two watermarks of a robot.
const GAP_MAX: Duration = Duration::from_millis(500);

pub(crate) fn run() -> Value {
    let mut server = Server::start(&[]);
    let watermarks = Watermarks::listen(&server.endpoint());
    let stop = Arc::new(AtomicBool::new(false));
    let robots: Vec<_> = (0..ROBOTS)
        .map(|number| {
            let settings = RobotSettings {
                session: Some(1),
                window_samples: 200_000,
                ..RobotSettings::default()
            };
            let robot = server.robot_with(&format!("robot-{number}"), settings);
            let stop = Arc::clone(&stop);
            thread::spawn(move || {
                let (mut drive, mut sent) = (Drive::new(number.into()), 0);
                let mut next = Instant::now();
                while !stop.load(Ordering::Relaxed) {
                    let samples: Vec<_> = drive.by_ref().take(CALL_SAMPLES).collect();
                    sent += samples.len() as u64;
                    robot.send_batch(samples).expect("the robot takes samples");
                    next += CALL_PAUSE;
                    thread::sleep(next.saturating_duration_since(Instant::now()));
                }
                robot.flush(LONG).expect("everything becomes durable");
                sent
            })
        })
        .collect();
    let subscribers: Vec<_> = (0..STOPPED)
        .map(|_| Subscriber::start(&server.endpoint(), "cogmap/**"))
        .collect();
    thread::sleep(Duration::from_secs(2));
    let begun = Instant::now();
    thread::sleep(BEFORE);
    subscribers.iter().for_each(Subscriber::stop);
    let stopped = Instant::now();
    thread::sleep(AFTER);
    let ended = Instant::now();
    stop.store(true, Ordering::Relaxed);
    let mut sent = 0;
    for (number, robot) in robots.into_iter().enumerate() {
        let of_robot = robot.join().expect("the robot ends");
        let agent = server.api().agent("default", &format!("robot-{number}"));
        let durable = agent.expect("the agent is known").watermark.durable;
        assert_eq!(durable, of_robot, "robot {number} has lost samples");
        let heard = watermarks.of(&format!("robot-{number}"));
        assert!(!heard.is_empty(), "robot {number} was never heard of");
        sent += of_robot;
    }
    let before = watermarks.longest_gap(begun, stopped);
    let after = watermarks.longest_gap(stopped, ended);
    let rate = sent as f64 / (ended - begun + Duration::from_secs(2)).as_secs_f64();
    eprintln!("{rate:.0} samples/s; longest gap {before:?} before, {after:?} after");
    assert!(after <= GAP_MAX, "watermarks were {after:?} apart");
    drop(subscribers);
    server.terminate();
    json!({
        "samples_per_s": rate.round(),
        "gap_before_s": before.as_secs_f64(),
        "gap_s": after.as_secs_f64(),
    })
}
