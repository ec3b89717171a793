//! The interface on a socket: streams, and the end of the service.

use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

use super::*;

struct Running {
    address: std::net::SocketAddr,
    stop: oneshot::Sender<()>,
    task: JoinHandle<io::Result<()>>,
}

async fn run_on(rig: &Rig, settings: HttpSettings) -> Running {
    let listener = TcpListener::bind("127.0.0.1:0").await.expect("a free port");
    let address = listener.local_addr().expect("bound");
    let prometheus = PrometheusBuilder::new().build_recorder().handle();
    let (stop, stopped) = oneshot::channel::<()>();
    let task = tokio::spawn(run(
        listener,
        rig.engine.clone().into(),
        settings,
        prometheus,
        async {
            let _ = stopped.await;
        },
    ));
    Running {
        address,
        stop,
        task,
    }
}

async fn connect(running: &Running, path: &str) -> TcpStream {
    let mut stream = TcpStream::connect(running.address)
        .await
        .expect("it listens");
    let request = format!("GET {path} HTTP/1.1\r\nhost: localhost\r\n\r\n");
    stream.write_all(request.as_bytes()).await.expect("sent");
    stream
}

/// Reads until `text` has come.
async fn read_until(stream: &mut TcpStream, text: &str) -> String {
    let mut read = Vec::new();
    let mut buffer = [0; 4096];
    while !String::from_utf8_lossy(&read).contains(text) {
        let count = stream.read(&mut buffer).await.expect("readable");
        assert!(
            count > 0,
            "ended before {text}: {}",
            String::from_utf8_lossy(&read)
        );
        read.extend_from_slice(&buffer[..count]);
    }
    String::from_utf8_lossy(&read).into_owned()
}

#[tokio::test]
async fn events_stream_in_and_end_with_the_service() {
    let rig = rig();
    rig.samples("other", &steps(1, 0, 1)).await.good();
    let running = run_on(&rig, settings()).await;
    let mut all = connect(&running, "/v1/spaces/lab/events").await;
    let mut other = connect(&running, "/v1/spaces/lab/events?agent=other").await;
    let head = read_until(&mut all, "\r\n\r\n").await;
    assert!(head.contains("content-type: text/event-stream"), "{head}");
    read_until(&mut other, "\r\n\r\n").await;
    rig.samples("rover", &steps(1, 0, 2)).await.good();
    rig.samples("other", &steps(2, 0, 2)).await.good();
    let events = read_until(&mut all, "\"agent\":\"other\"").await;
    assert!(
        events.contains("\"agent\":\"rover\"") && events.contains("agent_enrolled"),
        "{events}"
    );
    let filtered = read_until(&mut other, "session_started").await;
    assert!(!filtered.contains("rover"), "{filtered}");

    running.stop.send(()).expect("it runs");
    // Well within the time limit for open requests: the streams end by themselves.
    let ended = tokio::time::timeout(Duration::from_secs(4), running.task).await;
    ended.expect("it ends").expect("joined").expect("no error");
    let mut rest = Vec::new();
    all.read_to_end(&mut rest)
        .await
        .expect("the stream ends well");
    assert!(rest.ends_with(b"0\r\n\r\n"), "the last chunk is missing");
}

#[tokio::test]
async fn a_client_that_stalls_does_not_hold_up_the_end() {
    let rig = rig();
    let shutdown_timeout = Duration::from_millis(200);
    let running = run_on(
        &rig,
        HttpSettings {
            shutdown_timeout,
            ..settings()
        },
    )
    .await;
    let mut stream = TcpStream::connect(running.address)
        .await
        .expect("it listens");
    let head = "POST /v1/spaces/lab/recall HTTP/1.1\r\nhost: localhost\r\n\
        content-type: application/json\r\ncontent-length: 100\r\n\r\n{";
    stream.write_all(head.as_bytes()).await.expect("sent");
    let mut probe = connect(&running, "/healthz").await;
    read_until(&mut probe, "\"ok\"").await;
    running.stop.send(()).expect("it runs");
    let ended = tokio::time::timeout(Duration::from_secs(10), running.task).await;
    ended.expect("it ends").expect("joined").expect("no error");
}

#[tokio::test]
async fn a_connection_that_says_nothing_is_closed() {
    let rig = rig();
    let idle_timeout = Duration::from_millis(100);
    let running = run_on(
        &rig,
        HttpSettings {
            idle_timeout,
            ..settings()
        },
    )
    .await;
    let mut silent = TcpStream::connect(running.address)
        .await
        .expect("it listens");
    let mut halting = TcpStream::connect(running.address)
        .await
        .expect("it listens");
    let part = b"GET /healthz HTTP/1.1\r\nhost";
    halting.write_all(part).await.expect("sent");
    for stream in [&mut silent, &mut halting] {
        let mut rest = Vec::new();
        let read = tokio::time::timeout(Duration::from_secs(10), stream.read_to_end(&mut rest));
        // Closed, perhaps after an answer that says why.
        let _ = read.await.expect("it is closed");
    }
    drop((running.stop, rig.stop.clone()));
}

/// How many connections were closed for a reason.
fn closed(handle: &PrometheusHandle, reason: &str) -> u64 {
    let name = format!("cogmap_http_closed_connections_total{{reason=\"{reason}\"}} ");
    let text = handle.render();
    let line = text.lines().find_map(|line| line.strip_prefix(&name));
    line.and_then(|count| count.parse().ok()).expect("a count")
}

/// Reads until the service closes the connection.
async fn closed_by_service(stream: &mut TcpStream) {
    let mut rest = Vec::new();
    let read = tokio::time::timeout(Duration::from_secs(10), stream.read_to_end(&mut rest));
    // Closed, perhaps after an answer that says why.
    let _ = read.await.expect("it is closed");
}

#[tokio::test]
async fn connections_that_are_closed_are_counted_by_the_reason() {
    let recorder = PrometheusBuilder::new().build_recorder();
    let (counted, _recording) = (
        recorder.handle(),
        metrics::set_default_local_recorder(&recorder),
    );
    let rig = rig();
    let running = run_on(
        &rig,
        HttpSettings {
            connections_max: 2,
            head_timeout: Duration::from_millis(200),
            idle_timeout: Duration::from_millis(1500),
            ..settings()
        },
    )
    .await;
    let mut first = connect(&running, "/healthz").await;
    read_until(&mut first, "\"ok\"").await;
    let counts = || ["room", "head", "idle"].map(|reason| closed(&counted, reason));
    assert_eq!(counts(), [0, 0, 0]);
    // After an answer a connection may wait for longer than a head may take.
    closed_by_service(&mut first).await;
    assert_eq!(counts(), [0, 0, 1]);
    let mut silent = TcpStream::connect(running.address)
        .await
        .expect("it listens");
    closed_by_service(&mut silent).await;
    assert_eq!(counts(), [0, 1, 1]);
    let mut waiting = Vec::new();
    for _ in 0..3 {
        let mut stream = connect(&running, "/healthz").await;
        read_until(&mut stream, "\"ok\"").await;
        waiting.push(stream);
    }
    closed_by_service(&mut waiting[0]).await;
    assert_eq!(counts(), [1, 1, 1]);
    // Whoever hangs up by itself is not counted.
    drop(waiting);
    let mut last = connect(&running, "/healthz").await;
    read_until(&mut last, "\"ok\"").await;
    assert_eq!(counts()[1..], [1, 1]);
    drop((running.stop, rig.stop.clone()));
}

#[tokio::test]
async fn more_streams_than_the_bound_are_told_to_come_back() {
    let rig = rig();
    let running = run_on(
        &rig,
        HttpSettings {
            streams_max: 1,
            ..settings()
        },
    )
    .await;
    let mut first = connect(&running, "/v1/spaces/lab/events").await;
    read_until(&mut first, "\r\n\r\n").await;
    let mut second = connect(&running, "/v1/spaces/lab/events").await;
    let refusal = read_until(&mut second, "/problems/busy").await;
    assert!(refusal.starts_with("HTTP/1.1 503"), "{refusal}");
    drop((running.stop, rig.stop.clone()));
}

#[tokio::test]
async fn a_connection_that_waits_makes_room_for_one_that_comes() {
    let rig = rig();
    let running = run_on(
        &rig,
        HttpSettings {
            connections_max: 2,
            ..settings()
        },
    )
    .await;
    let mut first = connect(&running, "/healthz").await;
    read_until(&mut first, "\"ok\"").await;
    // This one is under way as long as its stream is.
    let mut stream = connect(&running, "/v1/spaces/lab/events").await;
    read_until(&mut stream, "\r\n\r\n").await;
    for _ in 0..3 {
        let mut next = connect(&running, "/healthz").await;
        read_until(&mut next, "\"ok\"").await;
        let mut rest = Vec::new();
        let closed = tokio::time::timeout(Duration::from_secs(10), first.read_to_end(&mut rest));
        let _ = closed.await.expect("the one that waited is closed");
        first = next;
    }
    rig.samples("rover", &steps(1, 0, 2)).await.good();
    read_until(&mut stream, "agent_enrolled").await;
    drop((running.stop, rig.stop.clone()));
}

#[tokio::test]
async fn where_no_connection_waits_the_next_one_does() {
    let rig = rig();
    let running = run_on(
        &rig,
        HttpSettings {
            connections_max: 1,
            ..settings()
        },
    )
    .await;
    let mut stream = connect(&running, "/v1/spaces/lab/events").await;
    read_until(&mut stream, "\r\n\r\n").await;
    let mut second = connect(&running, "/healthz").await;
    let mut answer = [0; 64];
    let early = tokio::time::timeout(Duration::from_millis(200), second.read(&mut answer));
    assert!(early.await.is_err(), "there is no room for it");
    drop(stream);
    read_until(&mut second, "\"ok\"").await;
    drop((running.stop, rig.stop.clone()));
}

/// The head of a request that names no agent, and says how long a body follows.
fn misnamed(length: usize, more: &str) -> String {
    format!(
        "POST /v1/spaces/default/agents/.ada/samples HTTP/1.1\r\nhost: localhost\r\n\
        content-type: application/json\r\n{more}content-length: {length}\r\n\r\n"
    )
}

/// What comes back for a head and a body that is sent a little later, and the connection.
async fn answer_of(running: &Running, head: &str, body: &[u8]) -> (String, TcpStream) {
    let mut stream = TcpStream::connect(running.address)
        .await
        .expect("it listens");
    stream.write_all(head.as_bytes()).await.expect("sent");
    tokio::time::sleep(Duration::from_millis(50)).await;
    stream.write_all(body).await.expect("sent");
    let answer = read_until(&mut stream, "invalid-path").await;
    (answer, stream)
}

#[tokio::test]
async fn a_refused_request_does_not_end_the_connection_under_the_next_one() {
    let rig = rig();
    let running = run_on(&rig, settings()).await;
    for length in [1, 1000, 300_000] {
        let (answer, mut stream) =
            answer_of(&running, &misnamed(length, ""), &vec![b' '; length]).await;
        assert!(answer.starts_with("HTTP/1.1 400"), "{answer}");
        assert!(!answer.contains("connection: close"), "{answer}");
        let next = "GET /healthz HTTP/1.1\r\nhost: localhost\r\n\r\n";
        stream.write_all(next.as_bytes()).await.expect("sent");
        read_until(&mut stream, "HTTP/1.1 200").await;
    }
}

#[tokio::test]
async fn a_refused_request_whose_body_does_not_come_is_answered_and_ends_its_connection() {
    let rig = rig();
    let running = run_on(&rig, settings()).await;
    for more in ["", "expect: 100-continue\r\n"] {
        let (answer, mut stream) = answer_of(&running, &misnamed(1000, more), b"").await;
        assert!(answer.starts_with("HTTP/1.1 400"), "{answer}");
        assert!(answer.contains("connection: close"), "{answer}");
        let mut rest = Vec::new();
        stream.read_to_end(&mut rest).await.expect("it ends");
    }
}
