//! HTTP and Zenoh say the same: one problem for one mistake, one id for one event, JSON for whoever
//! asks for it, and the end of a trip when a robot closes.

use std::sync::mpsc::{Receiver, channel};
use std::time::Instant;

use cogmap_client::{Robot, RobotSettings};
use cogmap_proto::{
    Codec, Estimate, Event, EventPage, Level, Problem, RecallQuery, Sample, SampleBody, TripEnd,
    Watermark, durable_key, estimate_key, events_key, json_key, query_key,
};
use cogmap_tests::{Drive, LONG, RawPublisher, Server, eventually, lab, run, seed};
use serde_json::{Value, json};
use zenoh::Wait;

use crate::feeding::post_all;

const AGENT: &str = "ada";
const SESSION: u64 = 7;

fn samples(count: usize) -> Vec<Sample> {
    Drive::new(seed(60)).take(count).collect()
}

/// The problem over HTTP: type, title, status and detail.
fn over_http(server: &Server, verb: &str, body: &Value) -> Problem {
    let answer = server
        .http()
        .post_json(&format!("/v1/spaces/default/{verb}"), body);
    assert_eq!(
        answer.content_type, "application/problem+json",
        "{answer:?}"
    );
    serde_json::from_str(&answer.body).unwrap()
}

/// The same over Zenoh.
fn over_zenoh(raw: &RawPublisher, verb: &str, body: &Value, codec: Codec) -> Problem {
    let key = query_key("default", verb);
    let refused = raw.ask(&key, codec.encoding(), codec.encode(body));
    codec.decode(&refused.unwrap_err()).unwrap()
}

#[test]
fn one_mistake_is_one_problem_over_http_and_zenoh() {
    let server = Server::start(&[]);
    post_all(&server, AGENT, SESSION, &samples(50));
    let raw = RawPublisher::connect(&server.endpoint());
    let step =
        json!({ "increment": { "translation_m": [0, 0, 0], "rotation_xyzw": [0, 0, 0, 1] } });
    let cases = [
        ("recall", json!({ "agent": "nobody" }), "unknown-agent"),
        ("recall", json!({ "agent": "a b" }), "invalid-query"),
        ("recall", json!({ "limit": 0 }), "invalid-query"),
        ("recall", json!({ "limit": "all" }), "malformed-body"),
        (
            "recall",
            json!({ "percept": { "level": { "channel": "nothing", "value": 1 } } }),
            "unknown-channel",
        ),
        ("localize", json!({ "samples": [] }), "invalid-query"),
        (
            "localize",
            json!({ "samples": [{ "stamp_ns": 0, "body": { "start_pose": {
                "translation_m": [0, 0, 0], "rotation_xyzw": [0, 0, 0, 1] } } }] }),
            "invalid-query",
        ),
    ];
    for (verb, body, kind) in &cases {
        let http = over_http(&server, verb, body);
        assert_eq!(http.kind, format!("/problems/{kind}"), "{body}: {http:?}");
        for codec in [Codec::Json, Codec::Cbor] {
            let zenoh = over_zenoh(&raw, verb, body, codec);
            let same = |problem: &Problem| {
                let Problem {
                    kind,
                    title,
                    status,
                    ..
                } = problem;
                (kind.clone(), title.clone(), *status)
            };
            assert_eq!(same(&zenoh), same(&http), "{verb} {body}");
            if *kind != "malformed-body" {
                assert_eq!(zenoh.detail, http.detail, "{verb} {body}");
            }
            let field = zenoh.detail.contains("limit");
            assert!(*kind != "malformed-body" || field, "{zenoh:?}");
        }
    }
    // An agent in the path over HTTP is one in the body over Zenoh.
    let body = json!({ "agent": "nobody", "motion": step });
    let http = over_http(&server, "agents/nobody/predict", &body);
    let zenoh = over_zenoh(&raw, "predict", &body, Codec::Json);
    assert_eq!((zenoh.kind, zenoh.detail), (http.kind, http.detail));
    // An encoding that nobody reads.
    let refused = raw.ask(
        &query_key("default", "recall"),
        "text/plain",
        b"{}".to_vec(),
    );
    let refused: Problem = Codec::Json.decode(&refused.unwrap_err()).unwrap();
    assert_eq!(
        (&*refused.kind, refused.status),
        ("/problems/unsupported-media-type", 415)
    );
    // A question without an encoding means JSON, as a body without a type does over HTTP.
    let body = Codec::Json.encode(&RecallQuery::default());
    let replies = raw.session().get(query_key("default", "recall"));
    let replies = replies.payload(body).timeout(LONG).wait().unwrap();
    assert!(replies.recv().unwrap().result().is_ok());
}

/// What is published under a key: encoding, bytes and attachment.
fn listen(raw: &RawPublisher, key: &str) -> Receiver<(String, Vec<u8>, Option<String>)> {
    let (heard, hear) = channel();
    raw.session()
        .declare_subscriber(key.to_owned())
        .callback(move |sample| {
            let bytes = sample.payload().to_bytes().into_owned();
            let attachment = sample.attachment().map(|text| {
                let text = text.try_to_string().unwrap();
                text.into_owned()
            });
            // The test may have heard enough.
            let _ = heard.send((sample.encoding().to_string(), bytes, attachment));
        })
        .background()
        .wait()
        .unwrap();
    hear
}

#[test]
fn json_is_there_for_whoever_listens_or_asks_whatever_the_service_publishes_in() {
    let server = Server::start(&[]);
    let raw = RawPublisher::connect(&server.endpoint());
    let estimates = listen(&raw, &json_key(&estimate_key("default", "*")));
    let marks = listen(&raw, &json_key(&durable_key("default", AGENT)));
    // Who listens to everything hears nothing twice.
    let all = listen(&raw, "cogmap/default/*/estimate/**");
    let robot = server.robot(AGENT, SESSION);
    // The service hears of the listeners a moment after they have begun.
    let heard: Estimate = eventually("an estimate as JSON", || {
        robot.send_batch(samples(1)).unwrap();
        robot.flush(LONG).unwrap();
        let (encoding, bytes, _) = estimates.try_recv().map_err(|error| error.to_string())?;
        assert_eq!(encoding, Codec::Json.encoding());
        Ok(serde_json::from_slice(&bytes).unwrap())
    });
    assert_eq!((&*heard.agent, heard.session), (AGENT, SESSION));
    let (encoding, bytes, _) = marks.recv_timeout(LONG).unwrap();
    assert_eq!(encoding, Codec::Json.encoding());
    let mark: Watermark = serde_json::from_slice(&bytes).unwrap();
    assert_eq!(mark.session, SESSION);
    while let Ok((encoding, ..)) = all.try_recv() {
        assert_eq!(encoding, Codec::Cbor.encoding());
    }
    // And whoever asks gets the latest, in the encoding of the question.
    let detail = server.api().agent("default", AGENT).unwrap();
    for codec in [Codec::Json, Codec::Cbor, Codec::Postcard] {
        let ask = |key: &str| raw.ask(key, codec.encoding(), Vec::new());
        let bytes = ask(&estimate_key("default", AGENT)).unwrap();
        let estimate: Estimate = codec.decode(&bytes).unwrap();
        assert_eq!(Some(estimate), detail.estimate);
        let bytes = ask(&durable_key("default", AGENT)).unwrap();
        assert_eq!(codec.decode::<Watermark>(&bytes).unwrap(), detail.watermark);
        let refused = ask(&estimate_key("default", "nobody")).unwrap_err();
        let problem: Problem = codec.decode(&refused).unwrap();
        assert_eq!(problem.kind, "/problems/unknown-agent");
    }
    post_all(&server, "bea", SESSION, &samples(3));
    let replies = raw.session().get(estimate_key("default", "*"));
    let replies = replies.timeout(LONG).wait().unwrap();
    let mut agents: Vec<String> = std::iter::from_fn(|| replies.recv().ok())
        .map(|reply| {
            let sample = reply.result().unwrap();
            assert_eq!(sample.encoding().to_string(), Codec::Json.encoding());
            let estimate: Estimate = serde_json::from_slice(&sample.payload().to_bytes()).unwrap();
            assert_eq!(
                sample.key_expr().as_str(),
                estimate_key("default", &estimate.agent)
            );
            estimate.agent
        })
        .collect();
    agents.sort();
    assert_eq!(agents, [AGENT, "bea"]);
}

#[test]
fn events_have_one_id_over_zenoh_in_pages_and_after_a_kill() {
    let mut server = Server::start(&[]);
    let raw = RawPublisher::connect(&server.endpoint());
    let told = listen(&raw, &events_key("default"));
    let robot = server.robot(AGENT, SESSION);
    robot.send_batch(samples(300)).unwrap();
    robot.flush(LONG).unwrap();
    let page = |server: &Server| -> EventPage {
        let answer = server
            .http()
            .get("/v1/spaces/default/events?format=json&limit=1000");
        serde_json::from_value(answer.json(200)).unwrap()
    };
    let before = page(&server);
    assert!(before.events.len() > 5, "{before:?}");
    for record in &before.events {
        let (_, bytes, id) = told.recv_timeout(LONG).unwrap();
        assert_eq!(id, Some(record.id.to_string()));
        assert_eq!(Codec::Cbor.decode::<Event>(&bytes).unwrap(), record.event);
    }
    server.kill();
    server.run();
    assert_eq!(
        page(&server),
        before,
        "what is durable is told again as it was"
    );
}

#[test]
fn a_robot_that_closes_ends_its_trip() {
    let server = Server::start(&[]);
    let ended = || -> Vec<(u64, Option<TripEnd>)> {
        let trips = server.api().trips("default").unwrap();
        trips
            .iter()
            .map(|trip| (trip.session, trip.ended))
            .collect()
    };
    for (session, ends_session) in [(1, true), (2, false)] {
        let settings = RobotSettings {
            session: Some(session),
            ends_session,
            ..RobotSettings::default()
        };
        let robot = Robot::builder("default", AGENT).endpoint(&server.endpoint());
        let robot = robot.settings(settings).connect().unwrap();
        for _ in 0..60 {
            robot.velocity([1.0, 0.0, 0.0], [0.0; 3], 0.1).unwrap();
        }
        robot.close(LONG).unwrap();
    }
    let ended = ended();
    assert!(ended.contains(&(1, Some(TripEnd::SessionEnd))), "{ended:?}");
    // One that vanishes without a word ends its trip at its next session, or by a gap.
    assert!(ended.contains(&(2, None)), "{ended:?}");
}

#[test]
fn an_agent_tells_whether_its_session_has_ended_and_when_it_was_heard() {
    let mut server = Server::start(&[]);
    let told = |server: &Server| {
        let detail = server.api().agent("default", AGENT).unwrap();
        let listed = server.api().agents("default").unwrap();
        let listed = listed.iter().find(|listed| listed.name == AGENT).unwrap();
        assert_eq!(listed.session_ended, detail.session_ended);
        assert_eq!(listed.heard_ago_s.is_some(), detail.heard_ago_s.is_some());
        (detail.session_ended, detail.heard_ago_s)
    };
    let robot = |server: &Server, session| {
        let settings = RobotSettings {
            session: Some(session),
            ..RobotSettings::default()
        };
        let robot = Robot::builder("default", AGENT).endpoint(&server.endpoint());
        robot.settings(settings).connect().unwrap()
    };
    let before = Instant::now();
    let first = robot(&server, SESSION);
    first.velocity([1.0, 0.0, 0.0], [0.0; 3], 0.1).unwrap();
    first.flush(LONG).unwrap();
    let (ended, heard_ago_s) = told(&server);
    let spent_s = before.elapsed().as_secs_f64();
    assert!(!ended);
    assert!(
        (0.0..=spent_s).contains(&heard_ago_s.unwrap()),
        "{heard_ago_s:?} {spent_s}"
    );
    first.close(LONG).unwrap();
    assert!(told(&server).0);
    server.kill();
    server.run();
    assert_eq!(
        told(&server),
        (true, None),
        "nobody was heard since the start"
    );
    // A new session has not ended.
    let second = robot(&server, SESSION + 1);
    second.velocity([1.0, 0.0, 0.0], [0.0; 3], 0.1).unwrap();
    second.flush(LONG).unwrap();
    let (ended, heard_ago_s) = told(&server);
    assert!(!ended && heard_ago_s.is_some());
}

#[test]
fn names_of_channels_are_checked_over_zenoh_as_over_http() {
    let server = Server::start(&[]);
    let robot = server.robot(AGENT, SESSION);
    let level = SampleBody::Level(Level {
        channel: "my channel!".to_owned(),
        value: 1.0,
        offset_m: [0.0; 3],
        normal: None,
    });
    robot.send_now(level).unwrap();
    robot.flush(LONG).unwrap();
    let rejected = server
        .api()
        .agent("default", AGENT)
        .unwrap()
        .watermark
        .rejected;
    let reasons: Vec<_> = rejected.iter().map(|one| json!(one.reason)).collect();
    assert_eq!(reasons, [json!("invalid_label")]);
}

#[test]
fn metrics_say_what_the_process_takes_and_how_agents_stand() {
    let server = Server::start(&[]);
    post_all(&server, AGENT, SESSION, &samples(500));
    eventually("the sizes", || {
        let metrics = server.metrics();
        let sum = |name: &str, label| metrics.sum(name, label);
        let memory = sum("process_resident_memory_bytes", &[]);
        let open = sum("process_open_fds", &[]);
        let most = sum("process_max_fds", &[]);
        let store = sum("cogmap_store_bytes", &[]);
        let localized = sum("cogmap_agents_by_status", &[("status", "localized")]);
        let agents = sum("cogmap_agents_by_status", &[("space", "default")]);
        let behind = sum("cogmap_not_durable_samples_max", &[]);
        let known = memory > 1 << 20 && open > 3 && most > open && store > 1000;
        if known && (agents, behind) == (1, 0) && localized <= 1 {
            Ok(())
        } else {
            Err(format!(
                "{memory} {open} {most} {store} {localized} {agents} {behind}"
            ))
        }
    });
}

#[test]
fn help_shows_brackets_and_durations_have_units() {
    let help = run(&["demo", "--help"]);
    assert!(help.text().contains("--duration"), "{}", help.text());
    let help = |command| run(&[command, "--help"]);
    let of_lab = |command| lab(&[command, "--help"]);
    let of_service = ["demo", "export"].map(help);
    for help in of_service
        .into_iter()
        .chain(["bench", "replay", "eval"].map(of_lab))
    {
        assert!(!help.text().contains('\\'), "{}", help.text());
    }
    let refused = run(&["demo", "--duration", "soon"]);
    assert_eq!(refused.code(), 2, "{refused:?}");
}
