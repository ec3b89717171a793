//! Requests that are sent again: while a space moves, and at another address.

use std::net::TcpListener;
use std::time::{Duration, Instant};

use cogmap_proto::{Problem, RecallQuery, SampleBatch};

use super::super::{Api, ApiError};
use super::{Seen, serve_with};

const SPACES: &str = r#"{"spaces":[]}"#;
const TAKEN: &str = r#"{"watermark":{"session":5,"durable":0,"applied":0,"gap":null,
    "rejected":[]},"duplicates":0}"#;
const BATCH: SampleBatch = SampleBatch {
    session: 5,
    first_seq: 0,
    samples: Vec::new(),
};
/// Longer than any test waits.
const LONG: Duration = Duration::from_secs(20);

fn problem(kind: &str, status: u16, retry_after: &'static str) -> (u16, &'static str, String) {
    let problem = Problem {
        kind: format!("/problems/{kind}"),
        title: kind.to_owned(),
        status,
        detail: String::new(),
    };
    let json = serde_json::to_string(&problem).unwrap();
    (status, retry_after, json)
}

fn moving(retry_after: &'static str) -> (u16, &'static str, String) {
    problem("moving", 503, retry_after)
}

fn owner_lost() -> (u16, &'static str, String) {
    problem("owner-lost", 502, "retry-after: 0\r\n")
}

fn ok(answer: &str) -> (u16, &'static str, String) {
    (200, "", answer.to_owned())
}

fn lines(seen: impl Iterator<Item = Seen>) -> Vec<String> {
    seen.map(|seen| seen.head[0].clone()).collect()
}

fn kind<T: std::fmt::Debug>(answer: Result<T, ApiError>) -> String {
    match answer {
        Err(ApiError::Problem(problem)) => problem.kind,
        other => panic!("{other:?}"),
    }
}

#[test]
fn another_address_is_asked_where_a_space_stays_away() {
    let (first, seen_first) = serve_with(vec![moving("retry-after: 0\r\n")]);
    let (second, seen_second) = serve_with(vec![ok(SPACES), ok(SPACES)]);
    let api = Api::new(&first, None).or_at(&second);
    assert!(api.spaces().unwrap().is_empty());
    assert!(api.spaces().unwrap().is_empty());
    assert_eq!(lines(seen_first.iter()).len(), 1);
    assert_eq!(lines(seen_second.iter()).len(), 2);
}

#[test]
fn every_request_is_sent_again_while_its_space_moves() {
    let at_once = || moving("retry-after: 0\r\n");
    let recalled = r#"{"space":"demo","frame":"map","map_revision":1,"places":[],"rivals":null}"#;
    let (base, seen) = serve_with(vec![
        at_once(),
        at_once(),
        ok(SPACES),
        at_once(),
        ok(recalled),
        at_once(),
        ok(TAKEN),
        at_once(),
        (204, "", String::new()),
    ]);
    let api = Api::new(&base, None);
    assert!(api.spaces().unwrap().is_empty());
    api.recall("demo", &RecallQuery::default()).unwrap();
    api.post_samples("demo", "ada", &BATCH).unwrap();
    api.delete_space("demo").unwrap();
    let asked = lines(seen.iter());
    assert_eq!(asked.len(), 9);
    assert!(asked[7].starts_with("DELETE ") && asked[8] == asked[7]);
}

#[test]
fn the_pause_is_the_one_that_the_service_names() {
    let (base, _seen) = serve_with(vec![moving("retry-after: 1\r\n"), ok(SPACES)]);
    let asked = Instant::now();
    Api::new(&base, None).spaces().unwrap();
    assert!((Duration::from_secs(1)..LONG).contains(&asked.elapsed()));
}

#[test]
fn a_space_that_moves_for_too_long_is_told() {
    let far = || moving("retry-after: 3600\r\n");
    let (base, seen) = serve_with(vec![far(), far(), far()]);
    let asked = Instant::now();
    let api = Api::new(&base, None).retry_timeout(Duration::from_millis(50));
    assert_eq!(kind(api.spaces()), "/problems/moving");
    assert!((Duration::from_millis(50)..LONG).contains(&asked.elapsed()));
    // A last time when the time is over.
    assert_eq!(lines(seen.try_iter()).len(), 2);
    let api = api.retry_timeout(Duration::ZERO);
    assert_eq!(kind(api.spaces()), "/problems/moving");
    assert_eq!(lines(seen.try_iter()).len(), 1);
}

#[test]
fn what_a_lost_owner_may_have_done_is_asked_again_only_where_that_is_harmless() {
    let (base, seen) = serve_with(vec![
        owner_lost(),
        ok(SPACES),
        owner_lost(),
        ok(TAKEN),
        owner_lost(),
        owner_lost(),
    ]);
    let api = Api::new(&base, None);
    api.spaces().unwrap();
    api.post_samples("demo", "ada", &BATCH).unwrap();
    assert_eq!(kind(api.unblock("demo", 3)), "/problems/owner-lost");
    let created = api.create_space("demo", &cogmap_proto::SpaceSettings::default());
    assert_eq!(kind(created), "/problems/owner-lost");
    assert_eq!(lines(seen.iter()).len(), 6);
}

#[test]
fn other_problems_are_told_at_once() {
    let busy = problem("busy", 503, "retry-after: 0\r\n");
    let (base, seen) = serve_with(vec![busy]);
    let api = Api::new(&base, None);
    assert_eq!(kind(api.spaces()), "/problems/busy");
    assert_eq!(lines(seen.iter()).len(), 1);
}

#[test]
fn another_address_is_asked_when_nothing_listens_at_the_one_before() {
    let free = TcpListener::bind("127.0.0.1:0").unwrap();
    let dead = format!("http://{}", free.local_addr().unwrap());
    drop(free);
    let (base, seen) = serve_with(vec![(204, "", String::new()), ok(SPACES)]);
    let api = Api::new(&dead, None).or_at(&base);
    api.delete_space("demo").unwrap();
    api.clone().spaces().unwrap();
    assert_eq!(lines(seen.iter()).len(), 2);
    // And round to the first, until all have been tried.
    assert!(matches!(api.spaces(), Err(ApiError::Transport(_))));
}

#[test]
fn a_connection_that_breaks_lets_another_address_answer_where_that_is_harmless() {
    let breaking = TcpListener::bind("127.0.0.1:0").unwrap();
    let broken = format!("http://{}", breaking.local_addr().unwrap());
    std::thread::spawn(move || {
        for stream in breaking.incoming() {
            drop(stream);
        }
    });
    let (base, seen) = serve_with(vec![ok(SPACES)]);
    let api = Api::new(&broken, None).or_at(&base);
    assert!(matches!(
        api.delete_space("demo"),
        Err(ApiError::Transport(_))
    ));
    api.spaces().unwrap();
    assert_eq!(lines(seen.iter()), ["GET /v1/spaces HTTP/1.1"]);
}
