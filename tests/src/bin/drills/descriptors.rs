//! More silent connections than the system allows open files: the store goes on, and so do those
//! who were there before.

use std::net::TcpStream;
use std::time::{Duration, Instant};

use cogmap_tests::{Drive, LONG, Server, raise_open_files};
use serde_json::{Value, json};

/// Silent connections, half of them of HTTP and half of Zenoh.
const CONNECTIONS: usize = 1500;
/// The limit of open files, which the service cannot raise.
const LIMIT: usize = 1024;
/// How long samples come in meanwhile, and how many at once.
const LOOK: Duration = Duration::from_secs(15);
const CALL_SAMPLES: usize = 100;

pub(crate) fn run() -> Value {
    raise_open_files();
    let mut server = Server::stopped(&["engine.checkpoint_interval_s=0.5"]);
    server.set_prelude(Some(&format!("ulimit -n {LIMIT}")));
    server.run();
    let mut drive = Drive::new(1);
    let robot = server.robot("ada", 1);
    let mut send = || {
        let samples = drive.by_ref().take(CALL_SAMPLES).collect();
        robot.send_batch(samples).expect("the robot takes samples");
        robot.flush(LONG).expect("they become durable");
    };
    send();
    let zenoh = server.endpoint();
    let addresses = [server.address(), zenoh.replace("tcp/", "")];
    let mut silent = Vec::new();
    for number in 0..CONNECTIONS {
        let target = addresses[number % 2].parse().expect("an address");
        silent.extend(TcpStream::connect_timeout(&target, Duration::from_secs(2)));
    }
    let begun = Instant::now();
    let mut calls: u64 = 0;
    while begun.elapsed() < LOOK {
        send();
        calls += 1;
        let ready = server.http().get("/readyz");
        assert_eq!(ready.status, 200, "{ready:?}");
    }
    // Whoever comes now gets in, although the silent ones are still there.
    let late = server.robot("late", 1);
    let samples = Drive::new(2).take(CALL_SAMPLES).collect();
    late.send_batch(samples).expect("the robot takes samples");
    late.flush(LONG).expect("they become durable");
    let opened = silent.len();
    drop(silent);
    send();
    drop((robot, late));
    server.kill();
    server.run();
    let agent = server.api().agent("default", "ada");
    let durable = agent.expect("the agent is known").watermark.durable;
    assert_eq!(durable, (calls + 2) * CALL_SAMPLES as u64);
    server.terminate();
    json!({"connections": opened, "limit": LIMIT, "samples": durable})
}
