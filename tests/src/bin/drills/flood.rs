//! One robot sends all it can: another one does not wait for it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use cogmap_client::RobotSettings;
use cogmap_proto::{Codec, samples_key};
use cogmap_tests::{Drive, LONG, RawPublisher, Server, batch};
use serde_json::{Value, json};

use crate::quantile::quantile;
use crate::watermarks::Watermarks;

/// The flood: messages of so many samples, all within this time.
const MESSAGES: usize = 2756;
const MESSAGE_SAMPLES: usize = 200;
const FLOOD: Duration = Duration::from_secs(3);
/// Time between two samples of the other robot.
const STEP: Duration = Duration::from_millis(20);
/// How long the other robot is looked at, from before the flood until after it.
const LOOK: Duration = Duration::from_secs(30);
const BEFORE: Duration = Duration::from_secs(2);
/// Longest time until a sample is acknowledged, but for one in a hundred.
const ACKNOWLEDGED_MAX: Duration = Duration::from_millis(250);

pub(crate) fn run() -> Value {
    let mut server = Server::start(&[]);
    let watermarks = Watermarks::listen(&server.endpoint());
    let stop = Arc::new(AtomicBool::new(false));
    let honest = {
        let settings = RobotSettings {
            session: Some(1),
            batch_samples: 1,
            ..RobotSettings::default()
        };
        let (robot, stop) = (server.robot_with("honest", settings), Arc::clone(&stop));
        thread::spawn(move || {
            let mut sent = Vec::new();
            let mut next = Instant::now();
            for sample in Drive::new(1) {
                if stop.load(Ordering::Relaxed) {
                    break;
                }
                sent.push(Instant::now());
                robot.send(sample).expect("the robot takes samples");
                next += STEP;
                thread::sleep(next.saturating_duration_since(Instant::now()));
            }
            robot.flush(LONG).expect("everything becomes durable");
            sent
        })
    };
    let mut samples = Drive::new(2);
    let messages: Vec<_> = (0..MESSAGES)
        .map(|number| {
            let samples: Vec<_> = samples.by_ref().take(MESSAGE_SAMPLES).collect();
            let first = (number * MESSAGE_SAMPLES) as u64;
            Codec::Postcard.encode(&batch(1, first, samples))
        })
        .collect();
    thread::sleep(BEFORE);
    let mut flooder = RawPublisher::connect(&server.endpoint());
    let key = samples_key("default", "flooder");
    let begun = Instant::now();
    for (number, message) in (1_u32..).zip(messages) {
        flooder.put(&key, Codec::Postcard.encoding(), message);
        let due = FLOOD * number / u32::try_from(MESSAGES).expect("a small number");
        thread::sleep(due.saturating_sub(begun.elapsed()));
    }
    let flooded = begun.elapsed();
    thread::sleep(LOOK.saturating_sub(begun.elapsed()));
    stop.store(true, Ordering::Relaxed);
    let sent = honest.join().expect("the robot ends");

    let heard = watermarks.of("honest");
    let mut waits: Vec<_> = (0..)
        .zip(&sent)
        .filter(|(_, at)| **at >= begun)
        .map(|(seq, at)| {
            let covered = heard.iter().find(|(_, mark)| mark.durable > seq);
            covered.expect("every sample is acknowledged").0 - *at
        })
        .collect();
    let (p50, p99) = (quantile(&mut waits, 0.5), quantile(&mut waits, 0.99));
    let longest = quantile(&mut waits, 1.0);
    let told = watermarks.of("flooder");
    let durable = told.last().map_or(0, |(_, mark)| mark.durable);
    let all = (MESSAGES * MESSAGE_SAMPLES) as u64;
    let dropped = server.metrics().sum(
        "cogmap_dropped_messages_total",
        &[("reason", "agent_queue_full")],
    );
    eprintln!("{p50:?} {p99:?} {longest:?}; flood: {flooded:?}, {durable} of {all} durable");
    // The flooder's samples are taken, or it is told which ones are missing.
    let gap = told.iter().any(|(_, mark)| mark.gap.is_some());
    assert!(durable == all || gap, "the flooder was told of nothing");
    assert!(p99 <= ACKNOWLEDGED_MAX, "acknowledged after {p99:?}");
    server.terminate();
    json!({
        "flood_s": flooded.as_secs_f64(),
        "acknowledged_p50_s": p50.as_secs_f64(),
        "acknowledged_p99_s": p99.as_secs_f64(),
        "acknowledged_max_s": longest.as_secs_f64(),
        "flood_durable": durable,
        "flood_messages_dropped": dropped,
    })
}
