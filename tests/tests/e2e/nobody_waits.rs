//! Nobody holds up anybody else. What takes longer is among the drills.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::thread;
use std::time::{Duration, Instant};

use cogmap_tests::{Drive, Server, Slow, batch};

/// Time for an answer that waits for nobody, on a busy machine.
const SOON: Duration = Duration::from_secs(20);

#[test]
fn health_is_answered_while_others_hold_every_connection() {
    let server = Server::start(&["http.connections_max=64", "http.requests_max=32"]);
    let attack = Slow::start(&server.address(), 400);
    for _ in 0..20 {
        let began = Instant::now();
        let answer = server.http().get("/healthz");
        assert_eq!(answer.status, 200, "{answer:?}");
        assert!(began.elapsed() < SOON, "after {:?}", began.elapsed());
        thread::sleep(Duration::from_millis(50));
    }
    assert!(attack.stop() >= 400);
}

#[test]
fn a_head_that_never_ends_is_given_up() {
    let server = Server::start(&["http.head_timeout_s=1"]);
    let mut stream = TcpStream::connect(server.address()).unwrap();
    stream.write_all(b"GET /healthz HTTP/1.1\r\nx: ").unwrap();
    // A byte now and then does not keep it open.
    let began = Instant::now();
    while stream.write_all(b"x").is_ok() {
        assert!(began.elapsed() < SOON, "it is still open");
        thread::sleep(Duration::from_millis(100));
    }
}

#[test]
fn a_connection_is_kept_between_requests_for_longer_than_a_head_may_take() {
    let server = Server::start(&["http.head_timeout_s=0.5"]);
    let mut stream = TcpStream::connect(server.address()).unwrap();
    for _ in 0..3 {
        let request = b"GET /healthz HTTP/1.1\r\nhost: localhost\r\n\r\n";
        stream.write_all(request).unwrap();
        let mut answer = [0; 4096];
        let read = stream.read(&mut answer).unwrap();
        assert!(answer[..read].starts_with(b"HTTP/1.1 200"));
        thread::sleep(Duration::from_millis(1200));
    }
}

#[test]
fn silent_connections_take_no_open_files_from_the_store() {
    let mut server = Server::stopped(&["engine.checkpoint_interval_s=0.1"]);
    server.set_prelude(Some("ulimit -n 640"));
    server.run();
    let zenoh = server.endpoint().replace("tcp/", "");
    let addresses = [server.address(), zenoh];
    let silent: Vec<_> = (0..800)
        .filter_map(|number: usize| TcpStream::connect(&addresses[number % 2]).ok())
        .collect();
    let mut drive = Drive::new(1);
    for call in 0..20_u64 {
        let samples = batch(1, 100 * call, drive.by_ref().take(100).collect());
        let answer = server.api().post_samples("default", "ada", &samples);
        assert_eq!(answer.unwrap().watermark.durable, 100 * (call + 1));
        thread::sleep(Duration::from_millis(50));
    }
    drop(silent);
    let log = server.log();
    assert!(log.contains("lowered"), "the log names what was lowered");
    assert!(!log.contains("Too many open files"));
    server.terminate();
}
