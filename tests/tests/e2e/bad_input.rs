//! What no client would send: it is counted, its sender is told where there is one, and nobody
//! else notices.

use cogmap_client::ClientError;
use cogmap_proto::limits::{BATCH_SAMPLES_MAX, MESSAGE_BYTES_MAX};
use cogmap_proto::{
    Codec, Descriptor, Increment, Level, ObjectMark, Orientation, Rejection, Relation, Sample,
    SampleBatch, SampleBody, SeqRange, Sighting, SkipReason, StartPose, Target, TouchNoise,
    samples_key,
};
use cogmap_tests::{Drive, LONG, Metrics, RawPublisher, Server, batch, eventually, seed, velocity};

use crate::feeding::{Feeder, assert_exactly_once};

const DECODE_ERRORS: &str = "cogmap_decode_errors_total";
const DROPPED: &str = "cogmap_dropped_messages_total";
const SKIPPED: &str = "cogmap_skipped_samples_total";

/// A counter's series, and by how much it has to move.
type Counted = (&'static str, (&'static str, &'static str), u64);

/// Waits until the counter has moved by exactly its amount.
fn await_moved(server: &Server, before: &Metrics, (name, label, amount): Counted) {
    let from = before.sum(name, &[label]);
    eventually(&format!("{name}{label:?}"), || {
        let moved = server.metrics().sum(name, &[label]) - from;
        assert!(moved <= amount, "{name}{label:?} moved by {moved}");
        (moved == amount).then_some(()).ok_or(moved.to_string())
    });
}

/// Asserts that of all counters of bad input only these have moved since `before`.
fn assert_nothing_else_moved(server: &Server, before: &Metrics, amount: u64) {
    let after = server.metrics();
    let all = |metrics: &Metrics| -> u64 {
        [DECODE_ERRORS, DROPPED, SKIPPED]
            .map(|name| metrics.sum(name, &[]))
            .iter()
            .sum()
    };
    assert_eq!(all(&after) - all(before), amount);
}

/// Asserts that a robot beside all this was not disturbed.
fn assert_undisturbed(server: &Server, feeder: Feeder) {
    let sent = feeder.finish().len() as u64;
    let detail = server.api().agent("default", "ada").unwrap();
    assert_eq!((detail.watermark.durable, detail.lag_samples), (sent, 0));
    assert_eq!(detail.watermark.rejected, vec![]);
    assert_eq!(server.http().get("/readyz").status, 200);
}

fn at(stamp_ns: i64, body: SampleBody) -> Sample {
    Sample { stamp_ns, body }
}

fn two_steps(session: u64) -> SampleBatch {
    let step = |stamp_ns| at(stamp_ns, velocity(0.5, 0.1, 0.02));
    batch(session, 0, vec![step(0), step(20_000_000)])
}

/// A message that is refused whole: key, encoding, bytes, and the counter that has to tell it.
type Refused = (String, &'static str, Vec<u8>, Counted);

/// Messages that cannot be read, each with its kind.
fn unreadable_messages() -> Vec<Refused> {
    let whole = |codec: Codec| codec.encode(&two_steps(1));
    let cut = |codec: Codec| {
        let mut bytes = whole(codec);
        bytes.truncate(bytes.len() - 3);
        bytes
    };
    let of = |batch: &SampleBatch| Codec::Postcard.encode(batch);
    let many = vec![at(0, velocity(0.0, 0.0, 0.1)); BATCH_SAMPLES_MAX + 1];
    let endless = SampleBatch {
        first_seq: u64::MAX,
        ..two_steps(1)
    };
    let [postcard, cbor, json] = [Codec::Postcard, Codec::Cbor, Codec::Json].map(Codec::encoding);
    let v9 = "application/vnd.cogmap.postcard;v9";
    [
        (postcard, cut(Codec::Postcard), "malformed"),
        (cbor, cut(Codec::Cbor), "malformed"),
        (json, cut(Codec::Json), "malformed"),
        (json, whole(Codec::Postcard), "malformed"),
        (postcard, Vec::new(), "malformed"),
        (postcard, vec![0; MESSAGE_BYTES_MAX + 1], "too_long"),
        (v9, whole(Codec::Postcard), "unsupported_version"),
        ("image/png", whole(Codec::Postcard), "unknown_encoding"),
        (postcard, of(&batch(1, 0, Vec::new())), "empty_batch"),
        (postcard, of(&batch(1, 0, many)), "too_many_samples"),
        (postcard, of(&endless), "sequence_overflow"),
    ]
    .map(|(encoding, bytes, kind)| {
        let key = samples_key("default", "bad");
        (key, encoding, bytes, (DECODE_ERRORS, ("kind", kind), 1))
    })
    .into()
}

/// Messages that can be read, but are of nobody.
fn misdirected_messages() -> Vec<Refused> {
    [
        ("default", ".bad", "bad_key"),
        ("default", "b d", "bad_key"),
        ("default", &"n".repeat(65), "bad_key"),
        ("sp\u{e4}ce", "bad", "bad_key"),
        ("nowhere", "bad", "unknown_space"),
    ]
    .map(|(space, agent, reason)| {
        let codec = Codec::Postcard;
        let bytes = codec.encode(&two_steps(1));
        let counted = (DROPPED, ("reason", reason), 1);
        (samples_key(space, agent), codec.encoding(), bytes, counted)
    })
    .into()
}

#[test]
fn messages_that_cannot_be_taken_are_counted_by_kind() {
    let server = Server::start(&[]);
    let feeder = Feeder::start(server.robot("ada", 7), Drive::new(seed(10)));
    let mut raw = RawPublisher::connect(&server.endpoint());
    let messages = [unreadable_messages(), misdirected_messages()].concat();
    let (start, count) = (server.metrics(), messages.len() as u64);
    for (key, encoding, bytes, counted) in messages {
        let before = server.metrics();
        raw.put(&key, encoding, bytes);
        await_moved(&server, &before, counted);
    }
    assert_nothing_else_moved(&server, &start, count);
    assert_undisturbed(&server, feeder);
    // None of it made an agent or a space.
    let agents = server.api().agents("default").unwrap();
    let names: Vec<_> = agents.into_iter().map(|agent| agent.name).collect();
    assert_eq!(names, ["ada"]);
    assert_eq!(server.api().spaces().unwrap().len(), 1);
}

/// Samples that make no sense, by what is wrong with them, with the reason's name in the metrics.
/// Each comes after a sample with the stamp 10 ns.
fn senseless_samples() -> Vec<(SkipReason, &'static str, Vec<Sample>)> {
    let increment = |rotation_xyzw| {
        SampleBody::Increment(Increment {
            translation_m: [0.1, 0.0, 0.0],
            rotation_xyzw,
            noise: None,
        })
    };
    let sighting = |label: &str, sd_m| {
        SampleBody::Sighting(Sighting {
            target: Target::Landmark(label.to_owned()),
            relation: Relation::Position {
                translation_m: [1.0, 0.0, 0.0],
                sd_m,
            },
        })
    };
    let descriptor = |vector| {
        let channel = "camera".to_owned();
        SampleBody::Descriptor(Descriptor { channel, vector })
    };
    let level = |normal| {
        SampleBody::Level(Level {
            channel: "touch".to_owned(),
            value: 1.0,
            offset_m: [0.0; 3],
            normal,
        })
    };
    let start_pose = |x_m| {
        SampleBody::StartPose(StartPose {
            translation_m: [x_m, 0.0, 0.0],
            rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
            noise: None,
        })
    };
    let now = |bodies: Vec<SampleBody>| bodies.into_iter().map(|body| at(10, body)).collect();
    let numbers = vec![
        velocity(f64::NAN, 0.0, 0.02),
        velocity(0.0, f64::INFINITY, 0.02),
        velocity(1e30, 0.0, 0.02),
        velocity(0.1, 0.0, -0.02),
        start_pose(f64::NEG_INFINITY),
    ];
    let quaternions = vec![increment([0.0; 4]), increment([0.0, 0.0, 0.6, 0.6])];
    let learn = SampleBody::Object(ObjectMark::Learn {
        // It would have the address of a question.
        name: Some("identify".to_owned()),
        spacing_m: 0.004,
        orientation: Orientation::Known {},
        noise: TouchNoise::default(),
    });
    let long = "x".repeat(200);
    let labels = vec![sighting("", [0.1; 3]), sighting(&long, [0.1; 3]), learn];
    let descriptors = vec![descriptor(vec![0.0; 16]), descriptor(vec![1.0; 7])];
    let late = vec![at(9, step()), at(i64::MIN, step())];
    let noise = vec![sighting("post", [-0.1; 3])];
    let normals = vec![level(Some([0.0, 0.0, 2.0]))];
    vec![
        (
            SkipReason::NumberOutOfRange,
            "number_out_of_range",
            now(numbers),
        ),
        (
            SkipReason::NonUnitQuaternion,
            "non_unit_quaternion",
            now(quaternions),
        ),
        (SkipReason::NegativeNoise, "negative_noise", now(noise)),
        (SkipReason::InvalidLabel, "invalid_label", now(labels)),
        (
            SkipReason::InvalidDescriptor,
            "invalid_descriptor",
            now(descriptors),
        ),
        (SkipReason::InvalidNormal, "invalid_normal", now(normals)),
        (SkipReason::TimeBackwards, "time_backwards", late),
    ]
}

/// A step of a centimetre.
fn step() -> SampleBody {
    velocity(0.5, 0.0, 0.02)
}

#[test]
fn samples_that_make_no_sense_are_refused_one_by_one_with_their_reason() {
    let server = Server::start(&[]);
    let feeder = Feeder::start(server.robot("ada", 7), Drive::new(seed(11)));
    let mut raw = RawPublisher::connect(&server.endpoint());
    let before = server.metrics();
    // A good sample before, between and after the bad ones.
    let (mut samples, mut expected) = (vec![at(10, step())], Vec::new());
    for (reason, _, bad) in senseless_samples() {
        for bad in bad {
            let from = samples.len() as u64;
            let range = SeqRange { from, to: from + 1 };
            expected.push(Rejection { range, reason });
            samples.extend([bad, at(10, step())]);
        }
    }
    let (sent, refused) = (samples.len() as u64, expected.len() as u64);
    raw.put_batch("default", "bad", Codec::Postcard, &batch(1, 0, samples));
    let mark = eventually("the end of the batch", || {
        let detail = server.api().agent("default", "bad");
        let mark = detail.map_err(|error| error.to_string())?.watermark;
        let told = format!("{mark:?}");
        (mark.durable == sent).then_some(mark).ok_or(told)
    });
    assert_eq!(mark.rejected, expected);
    for (_, name, bad) in senseless_samples() {
        await_moved(
            &server,
            &before,
            (SKIPPED, ("reason", name), bad.len() as u64),
        );
    }
    assert_nothing_else_moved(&server, &before, refused);
    assert_undisturbed(&server, feeder);
    // The good ones moved the agent.
    let travelled_m = server.api().agent("default", "bad").unwrap().travelled_m;
    let expected_m = 0.01 * (sent - refused) as f64;
    assert!((travelled_m - expected_m).abs() < 1e-9, "{travelled_m}");
}

#[test]
fn thousands_of_names_stay_bounded() {
    let server = Server::start(&["engine.agents_max=20"]);
    let feeder = Feeder::start(server.robot("ada", 7), Drive::new(seed(12)));
    eventually("the robot's enrolment", || {
        (feeder.told() > 0).then_some(()).ok_or(String::new())
    });
    let before = server.metrics();
    let mut raw = RawPublisher::connect(&server.endpoint());
    let payload = Codec::Postcard.encode(&two_steps(1));
    raw.put_batch("default", "stranger0", Codec::Postcard, &two_steps(1));
    for number in 1..3000 {
        let key = samples_key("default", &format!("stranger{number}"));
        raw.put_unmatched(&key, Codec::Postcard.encoding(), payload.clone());
    }
    // One of the twenty is the robot.
    await_moved(
        &server,
        &before,
        (DROPPED, ("reason", "too_many_agents"), 3000 - 19),
    );
    assert_eq!(server.api().agents("default").unwrap().len(), 20);
    let stranger = server.api().agent("default", "stranger18").unwrap();
    assert_eq!(stranger.watermark.durable, 2);
    assert_undisturbed(&server, feeder);
}

#[test]
fn of_two_senders_with_one_name_the_newer_session_wins() {
    let server = Server::start(&[]);
    let samples: Vec<_> = Drive::new(seed(13)).take(200).collect();
    let old = server.robot("ada", 7);
    old.send_batch(samples.clone()).unwrap();
    old.flush(LONG).unwrap();
    let new = server.robot("ada", 8);
    new.send_batch(samples.clone()).unwrap();
    new.flush(LONG).unwrap();
    let before = server.metrics();
    // The old one learns of it by the watermark of the new one, at the latest when it sends.
    let error = eventually("the end of the old session", || {
        match old
            .send_batch(samples[..1].to_vec())
            .and_then(|_| old.flush(LONG))
        {
            Err(error) => Ok(error),
            Ok(()) => Err("it goes on".to_owned()),
        }
    });
    assert!(
        matches!(error, ClientError::SessionSuperseded { session: 7, by: 8 }),
        "{error}"
    );
    // What arrives of it all the same is dropped, and its sender is told by the watermark.
    let mut raw = RawPublisher::connect(&server.endpoint());
    raw.put_batch(
        "default",
        "ada",
        Codec::Postcard,
        &batch(7, 200, samples[..5].to_vec()),
    );
    await_moved(&server, &before, (DROPPED, ("reason", "stale_session"), 1));
    let mark = server.api().agent("default", "ada").unwrap().watermark;
    assert_eq!((mark.session, mark.durable), (8, 200));
}

#[test]
fn a_second_run_with_the_same_session_number_is_told_whether_it_sends_less_or_more() {
    let server = Server::start(&[]);
    let samples: Vec<_> = Drive::new(seed(15)).take(300).collect();
    let first = server.robot("ada", 7);
    first.send_batch(samples).unwrap();
    first.close(LONG).unwrap();
    for count in [1, 1000] {
        let second = server.robot("ada", 7);
        let others: Vec<_> = Drive::new(seed(16)).take(count).collect();
        let told = second.send_batch(others).and_then(|_| second.flush(LONG));
        let error = told.unwrap_err();
        assert!(
            matches!(error, ClientError::SessionSuperseded { session: 7, by: 7 }),
            "{error}"
        );
        assert!(error.to_string().contains("in use by another run"));
    }
    // Nothing of them was taken for the first run's, and nothing was added to it.
    assert_exactly_once(&server, "ada", 7, 300);
    let metrics = server.metrics();
    assert_eq!(metrics.sum("cogmap_duplicate_samples_total", &[]), 0);
}

#[test]
fn a_robot_with_two_links_sends_everything_twice_and_counts_once() {
    let server = Server::start(&[]);
    let samples: Vec<_> = Drive::new(seed(14)).take(400).collect();
    let mut raw = RawPublisher::connect(&server.endpoint());
    // Each batch twice, and in the wrong order within pairs.
    for pair in samples
        .chunks(100)
        .enumerate()
        .collect::<Vec<_>>()
        .chunks(2)
    {
        for (number, chunk) in pair.iter().rev().chain(pair) {
            let batch = batch(7, *number as u64 * 100, chunk.to_vec());
            raw.put_batch("default", "ada", Codec::Postcard, &batch);
        }
    }
    eventually("all of it", || {
        let mark = server
            .api()
            .agent("default", "ada")
            .map(|agent| agent.watermark);
        let mark = mark.map_err(|error| error.to_string())?;
        (mark.durable == 400)
            .then_some(())
            .ok_or(format!("{mark:?}"))
    });
    let before = Metrics::read(&server.http());
    assert_eq!(before.sum("cogmap_duplicate_samples_total", &[]), 400);
    assert_eq!(before.sum("cogmap_reordered_samples_total", &[]), 200);
    assert_exactly_once(&server, "ada", 7, 400);
}
