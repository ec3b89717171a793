//! Thousands of connections that never finish the head of a request: health is answered.

use std::io::{ErrorKind, Read, Write};
use std::net::TcpStream;
use std::thread;
use std::time::{Duration, Instant};

use cogmap_tests::{Server, Slow};
use serde_json::{Value, json};

use crate::quantile::quantile;

/// Connections.
const CONNECTIONS: usize = 5000;
/// How long the attack lasts.
const ATTACK: Duration = Duration::from_secs(20);
/// Pause between two looks at the health.
const PAUSE: Duration = Duration::from_millis(100);
/// Longest time for the health.
const HEALTH_MAX: Duration = Duration::from_secs(1);

pub(crate) fn run() -> Value {
    let mut server = Server::start(&[]);
    let attack = Slow::start(&server.address(), CONNECTIONS);
    let deadline = Instant::now() + ATTACK;
    let mut times = Vec::new();
    while Instant::now() < deadline {
        let began = Instant::now();
        let answer = health(&server.address());
        times.push(began.elapsed());
        assert!(answer.starts_with("HTTP/1.1 200"), "{answer:?}");
        thread::sleep(PAUSE);
    }
    let opened = attack.stop();
    let closed = |reason| {
        let labels = [("reason", reason)];
        { server.metrics() }.sum("cogmap_http_closed_connections_total", &labels)
    };
    let (for_room, for_head) = (closed("room"), closed("head"));
    let (p50, longest) = (quantile(&mut times, 0.5), quantile(&mut times, 1.0));
    eprintln!("{opened} connections; health: {p50:?}, at most {longest:?}");
    assert!(opened >= CONNECTIONS, "only {opened} connections were made");
    assert!(longest <= HEALTH_MAX, "health took {longest:?}");
    server.terminate();
    json!({
        "connections": opened,
        "closed_for_room": for_room,
        "closed_for_head": for_head,
        "health_p50_s": p50.as_secs_f64(),
        "health_max_s": longest.as_secs_f64(),
    })
}

/// The answer of `/healthz` on a connection of its own.
fn health(address: &str) -> String {
    let mut stream = TcpStream::connect(address).expect("the service listens");
    let patience = Some(Duration::from_secs(30));
    stream.set_read_timeout(patience).expect("a timeout");
    let request = "GET /healthz HTTP/1.1\r\nhost: localhost\r\nconnection: close\r\n\r\n";
    stream.write_all(request.as_bytes()).expect("sent");
    let mut answer = String::new();
    match stream.read_to_string(&mut answer) {
        Ok(_) => answer,
        Err(error) if error.kind() == ErrorKind::WouldBlock => String::new(),
        Err(error) => panic!("{error}"),
    }
}
