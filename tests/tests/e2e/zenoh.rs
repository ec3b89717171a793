//! What the service says over Zenoh: estimates, watermarks, answers, events, each in the codec that
//! it should be in; and clients that outlive it.

use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use cogmap_client::{Robot, RobotSettings};
use cogmap_proto::{
    Codec, Estimate, Event, EventKind, Problem, RecallAnswer, RecallQuery, Sample, SpaceSettings,
    Status, Watermark, WatermarkQuery, durable_key, estimate_key, events_key, query_key,
};
use cogmap_tests::{Drive, LONG, RawPublisher, Server, batch, circle, eventually, seed};
use zenoh::Wait;

use crate::feeding::{Outcome, assert_exactly_once, post_all};

const AGENT: &str = "ada";
const SESSION: u64 = 7;

fn samples(seed: u64, count: usize) -> Vec<Sample> {
    Drive::new(seed).take(count).collect()
}

/// What is published under a key: encoding and bytes.
fn listen(raw: &RawPublisher, key: String) -> Receiver<(String, Vec<u8>)> {
    let (heard, hear) = channel();
    raw.session()
        .declare_subscriber(key)
        .callback(move |sample| {
            let bytes = sample.payload().to_bytes().into_owned();
            // The test may have heard enough.
            let _ = heard.send((sample.encoding().to_string(), bytes));
        })
        .background()
        .wait()
        .unwrap();
    hear
}

#[test]
fn ten_lines_bring_a_robot_to_its_first_estimate() {
    let mut server = Server::start(&[]);
    let robot = Robot::connect(&server.endpoint(), "default", AGENT).unwrap();
    robot
        .start_pose([1.0, 2.0, 0.0], [0.0, 0.0, 0.0, 1.0])
        .unwrap();
    robot.velocity([0.5, 0.0, 0.0], [0.0; 3], 0.1).unwrap();
    robot.flush(LONG).unwrap();
    let estimate = robot.estimate(LONG).unwrap();
    assert_eq!((estimate.seq, estimate.status), (1, Status::Localized));
    let [x, y, z] = estimate.translation_m;
    assert!((x - 1.05).abs() < 1e-12 && (y - 2.0).abs() < 1e-12 && z.abs() < 1e-12);
    // HTTP tells the same.
    let detail = server.api().agent("default", AGENT).unwrap();
    assert_eq!(detail.estimate, Some(estimate));
    assert_eq!(Some(detail.watermark), robot.watermark());
    robot.close(LONG).unwrap();
    server.terminate();
}

#[test]
fn what_is_published_is_cbor_unless_set_otherwise() {
    for (setting, codec) in [
        (None, Codec::Cbor),
        (Some("zenoh.encoding=json"), Codec::Json),
        (Some("zenoh.encoding=postcard"), Codec::Postcard),
    ] {
        let server = Server::start(setting.as_slice());
        let raw = RawPublisher::connect(&server.endpoint());
        let estimates = listen(&raw, estimate_key("default", AGENT));
        let marks = listen(&raw, durable_key("default", AGENT));
        let events = listen(&raw, events_key("default"));
        let robot = server.robot(AGENT, SESSION);
        robot.send_batch(samples(seed(40), 300)).unwrap();
        robot.flush(LONG).unwrap();
        let estimate = robot.estimate(LONG).unwrap();
        let (encoding, bytes) = last(&estimates, |bytes| {
            codec
                .decode::<Estimate>(bytes)
                .is_ok_and(|heard| heard.seq == 299)
        });
        assert_eq!(encoding, codec.encoding());
        let heard: Estimate = codec.decode(&bytes).unwrap();
        assert_eq!((heard.session, heard.seq), (estimate.session, estimate.seq));
        let (encoding, _) = last(&marks, |bytes| {
            codec
                .decode::<Watermark>(bytes)
                .is_ok_and(|mark| mark.durable == 300)
        });
        assert_eq!(encoding, codec.encoding());
        let (encoding, bytes) = last(&events, |bytes| {
            codec
                .decode::<Event>(bytes)
                .is_ok_and(|event| matches!(event.kind, EventKind::PlaceRecruited { .. }))
        });
        assert_eq!(encoding, codec.encoding());
        let event: Event = codec.decode(&bytes).unwrap();
        assert_eq!((&*event.space, &*event.agent), ("default", AGENT));
    }
}

/// Listens until something wanted comes.
fn last(heard: &Receiver<(String, Vec<u8>)>, wanted: impl Fn(&[u8]) -> bool) -> (String, Vec<u8>) {
    loop {
        let (encoding, bytes) = heard.recv_timeout(LONG).unwrap();
        if wanted(&bytes) {
            return (encoding, bytes);
        }
    }
}

#[test]
fn queries_answer_as_http_does_in_the_codec_of_the_question() {
    let server = Server::start(&[]);
    post_all(&server, AGENT, SESSION, &circle(1.0, 400).0);
    let raw = RawPublisher::connect(&server.endpoint());
    let api = server.api();
    let recall = RecallQuery {
        position_m: Some([1.0, 1.0, 0.0]),
        limit: Some(5),
        ..RecallQuery::default()
    };
    let mark = api.agent("default", AGENT).unwrap().watermark;
    let recalled = api.recall("default", &recall).unwrap();
    assert_eq!(recalled.places.len(), 5);
    for codec in [Codec::Json, Codec::Cbor, Codec::Postcard] {
        let ask = |key: &str, body| raw.ask(key, codec.encoding(), body);
        let bytes = ask(&query_key("default", "recall"), codec.encode(&recall)).unwrap();
        let answer: RecallAnswer = codec.decode(&bytes).unwrap();
        let ids = |answer: &RecallAnswer| -> Vec<_> {
            answer.places.iter().map(|place| place.place.id).collect()
        };
        assert_eq!(ids(&answer), ids(&recalled));
        assert_eq!(answer.map_revision, recalled.map_revision);

        let of_agent = |agent: &str| {
            codec.encode(&WatermarkQuery {
                agent: agent.to_owned(),
            })
        };
        let key = query_key("default", "watermark");
        let bytes = ask(&key, of_agent(AGENT)).unwrap();
        assert_eq!(codec.decode::<Watermark>(&bytes).unwrap(), mark);

        let problem = |bytes: Vec<u8>| {
            let problem: Problem = codec.decode(&bytes).unwrap();
            (problem.kind, problem.status)
        };
        let unknown = ask(&key, of_agent("nobody")).unwrap_err();
        assert_eq!(
            problem(unknown),
            ("/problems/unknown-agent".to_owned(), 404)
        );
        let nowhere = ask(&query_key("nowhere", "watermark"), of_agent(AGENT)).unwrap_err();
        assert_eq!(
            problem(nowhere),
            ("/problems/unknown-space".to_owned(), 404)
        );
        let malformed = ask(&key, vec![0xff]).unwrap_err();
        assert_eq!(
            problem(malformed),
            ("/problems/malformed-body".to_owned(), 400)
        );
    }
}

#[test]
fn all_codecs_of_samples_make_the_same_map() {
    let samples = samples(seed(41), 1000);
    let outcomes = [Codec::Postcard, Codec::Cbor].map(|codec| {
        let server = Server::start(&[]);
        let settings = RobotSettings {
            session: Some(SESSION),
            codec,
            ..RobotSettings::default()
        };
        let robot = server.robot_with(AGENT, settings);
        robot.send_batch(samples.clone()).unwrap();
        robot.flush(LONG).unwrap();
        assert_exactly_once(&server, AGENT, SESSION, samples.len());
        Outcome::read(&server.api(), AGENT)
    });
    assert!(outcomes[0] == outcomes[1]);
    assert!(outcomes[0] == Outcome::undisturbed(AGENT, SESSION, &samples));
}

#[test]
fn a_client_that_starts_before_the_service_waits_for_it() {
    let mut server = Server::stopped(&[]);
    let endpoint = server.endpoint();
    let early = std::thread::spawn(move || {
        let settings = RobotSettings {
            session: Some(SESSION),
            connect_timeout: LONG,
            ends_session: false,
            ..RobotSettings::default()
        };
        let robot = Robot::builder("default", AGENT).endpoint(&endpoint);
        let robot = robot.settings(settings).connect().unwrap();
        robot.send_batch(samples(42, 500)).unwrap();
        robot.close(LONG).unwrap();
    });
    std::thread::sleep(Duration::from_millis(500));
    server.run();
    early.join().unwrap();
    assert_exactly_once(&server, AGENT, SESSION, 500);
}

#[test]
fn a_space_that_is_made_after_its_robots_have_begun_gets_all_of_their_samples() {
    let server = Server::start(&[]);
    let robot = Robot::builder("lab", AGENT)
        .endpoint(&server.endpoint())
        .session(SESSION)
        .connect()
        .unwrap();
    robot.send_batch(samples(seed(43), 500)).unwrap();
    eventually("the drop of a message", || {
        let dropped = server.metrics().sum(
            "cogmap_dropped_messages_total",
            &[("reason", "unknown_space")],
        );
        (dropped > 0).then_some(()).ok_or(String::new())
    });
    server
        .api()
        .create_space("lab", &SpaceSettings::default())
        .unwrap();
    robot.flush(LONG).unwrap();
    let mark = server.api().agent("lab", AGENT).unwrap().watermark;
    assert_eq!((mark.session, mark.durable), (SESSION, 500));
}

#[test]
fn a_robot_lives_through_a_restart_of_the_service() {
    let mut server = Server::start(&[]);
    let samples = samples(seed(44), 1500);
    let robot = server.robot(AGENT, SESSION);
    robot.send_batch(samples[..500].to_vec()).unwrap();
    robot.flush(LONG).unwrap();
    server.terminate();
    // Sent while nobody is there.
    robot.send_batch(samples[500..1000].to_vec()).unwrap();
    server.run();
    robot.send_batch(samples[1000..].to_vec()).unwrap();
    robot.flush(LONG).unwrap();
    let estimate = robot.estimate(LONG).unwrap();
    assert_eq!((estimate.session, estimate.seq), (SESSION, 1499));
    assert_exactly_once(&server, AGENT, SESSION, 1500);
    assert!(Outcome::read(&server.api(), AGENT) == Outcome::undisturbed(AGENT, SESSION, &samples));
}

#[test]
fn what_never_comes_is_given_up_after_its_time_and_said() {
    let server = Server::start(&["engine.gap_timeout_s=0.3"]);
    let mut raw = RawPublisher::connect(&server.endpoint());
    let marks = listen(&raw, durable_key("default", AGENT));
    let samples = samples(seed(45), 30);
    for part in [0..10, 20..30] {
        let batch = batch(SESSION, part.start as u64, samples[part].to_vec());
        raw.put_batch("default", AGENT, Codec::Postcard, &batch);
    }
    let watermark = |bytes: &[u8]| Codec::Cbor.decode::<Watermark>(bytes).unwrap();
    let (_, bytes) = last(&marks, |bytes| watermark(bytes).gap.is_some());
    let gap = watermark(&bytes).gap.unwrap();
    assert_eq!((gap.from, gap.to), (10, 20));
    let (_, bytes) = last(&marks, |bytes| watermark(bytes).durable == 30);
    let mark = watermark(&bytes);
    assert_eq!((mark.applied, mark.gap), (30, None));
    let rejected = serde_json::to_value(&mark.rejected).unwrap();
    let lost = serde_json::json!([{"range": {"from": 10, "to": 20}, "reason": "lost"}]);
    assert_eq!(rejected, lost);
    let skipped = server
        .metrics()
        .sum("cogmap_skipped_samples_total", &[("reason", "lost")]);
    assert_eq!(skipped, 10);
}
