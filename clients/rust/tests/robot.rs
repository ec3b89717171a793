//! A robot against a fake service, over an in-process Zenoh router on a free loopback port.
// Everything here is a test; clippy sees that only in test functions.
#![allow(clippy::unwrap_used)]

mod service;

use std::net::TcpListener;
use std::sync::mpsc::channel;
use std::thread;
use std::time::Duration;

use cogmap_client::proto::{
    Codec, Estimate, Level, POSTCARD_V1, Rejection, Relation, Sample, SampleBody, SeqRange,
    SkipReason, Target, estimate_key,
};
use cogmap_client::{ClientError, Robot, RobotSettings, TripMark, open_session};
use service::{Faults, Service};
use zenoh::Wait;

/// Longest wait of any test; none should come near.
const LONG: Duration = Duration::from_secs(30);

fn free_endpoint() -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    format!("tcp/{}", listener.local_addr().unwrap())
}

fn level(stamp_ns: i64) -> Sample {
    Sample {
        stamp_ns,
        body: SampleBody::Level(Level {
            channel: "touch".to_owned(),
            value: 0.5,
            offset_m: [0.0; 3],
            normal: None,
        }),
    }
}

fn levels(count: i64) -> Vec<Sample> {
    (0..count).map(level).collect()
}

#[test]
fn ten_lines_take_a_robot_to_its_first_estimate() {
    let endpoint = free_endpoint();
    let service = Service::start(&endpoint, "demo", "ada", Faults::default());
    let robot = Robot::connect(&endpoint, "demo", "ada").unwrap();
    robot.start_pose([0.0; 3], [0.0, 0.0, 0.0, 1.0]).unwrap();
    robot
        .velocity([0.5, 0.0, 0.0], [0.0, 0.0, 0.1], 0.1)
        .unwrap();
    robot.flush(LONG).unwrap();
    let estimate = robot.estimate(LONG).unwrap();
    assert_eq!((estimate.session, estimate.seq), (robot.session(), 1));
    let watermark = robot.watermark().unwrap();
    assert_eq!((watermark.durable, watermark.applied), (2, 2));
    assert_eq!(robot.pending(), 0);
    let kinds: Vec<_> = service.journal().into_iter().map(|s| s.body).collect();
    assert!(matches!(
        kinds.as_slice(),
        [SampleBody::StartPose(_), SampleBody::Velocity(_)]
    ));
}

#[test]
fn what_the_link_loses_is_sent_again_until_all_is_there_once_and_in_order() {
    let endpoint = free_endpoint();
    let faults = Faults {
        ignored_batch: |number| number == 0 || number % 3 == 1,
        ..Faults::default()
    };
    let service = Service::start(&endpoint, "demo", "ada", faults);
    let settings = RobotSettings {
        batch_samples: 10,
        window_samples: 200,
        ..RobotSettings::default()
    };
    let robot = Robot::builder("demo", "ada")
        .endpoint(&endpoint)
        .settings(settings)
        .connect()
        .unwrap();
    assert_eq!(robot.send_batch(levels(500)).unwrap(), 0);
    assert_eq!(robot.send(level(500)).unwrap(), 500);
    robot.flush(LONG).unwrap();
    let mut sent = levels(500);
    sent.push(level(500));
    assert_eq!(service.journal(), sent);
    let counters = robot.counters();
    assert_eq!(counters.samples_sent, 501);
    assert!(counters.samples_resent > 0);
}

#[test]
fn a_lost_last_batch_is_found_by_asking() {
    let endpoint = free_endpoint();
    let faults = Faults {
        ignored_batch: |number| number == 0,
        ..Faults::default()
    };
    let service = Service::start(&endpoint, "demo", "ada", faults);
    let robot = Robot::connect(&endpoint, "demo", "ada").unwrap();
    robot.send_batch(levels(5)).unwrap();
    robot.flush(LONG).unwrap();
    assert_eq!(service.journal(), levels(5));
    assert!(robot.counters().queries >= 1);
    assert!(robot.counters().samples_resent >= 5);
}

#[test]
fn samples_sent_before_the_service_is_up_are_not_lost() {
    let endpoint = free_endpoint();
    let router = service::router(&endpoint);
    let settings = RobotSettings {
        match_timeout: Duration::ZERO,
        ..RobotSettings::default()
    };
    let robot = Robot::builder("demo", "ada")
        .endpoint(&endpoint)
        .settings(settings)
        .connect()
        .unwrap();
    robot.send_batch(levels(100)).unwrap();
    let flushed = robot.flush(Duration::from_millis(100));
    assert!(matches!(
        flushed,
        Err(ClientError::FlushTimeout { pending: 100, .. })
    ));
    let service = Service::on(router, "demo", "ada", Faults::default());
    robot.flush(LONG).unwrap();
    assert_eq!(service.journal(), levels(100));
}

#[test]
fn connecting_waits_for_a_router_that_is_not_up_yet() {
    let endpoint = free_endpoint();
    let down = free_endpoint();
    let late = endpoint.clone();
    let starts = thread::spawn(move || {
        thread::sleep(Duration::from_millis(300));
        service::router(&late)
    });
    let session = open_session(&[&down, &endpoint], LONG).unwrap();
    drop((session, starts.join().unwrap()));
}

#[test]
fn connecting_to_nobody_fails_in_time_and_says_where() {
    let endpoint = free_endpoint();
    let settings = RobotSettings {
        connect_timeout: Duration::from_millis(300),
        ..RobotSettings::default()
    };
    let error = Robot::builder("demo", "ada")
        .endpoint(&endpoint)
        .settings(settings)
        .connect()
        .unwrap_err();
    assert!(matches!(error, ClientError::Connect { .. }));
    assert!(error.to_string().contains(&endpoint));
}

#[test]
fn a_later_session_ends_an_earlier_one_with_a_typed_error() {
    let endpoint = free_endpoint();
    let service = Service::start(&endpoint, "demo", "ada", Faults::default());
    let shared = open_session(&[&endpoint], LONG).unwrap();
    let connect = |session| {
        Robot::builder("demo", "ada")
            .zenoh_session(shared.clone())
            .session(session)
            .connect()
            .unwrap()
    };
    let first = connect(1);
    first.send_batch(levels(3)).unwrap();
    first.flush(LONG).unwrap();
    let second = connect(2);
    second.send_batch(levels(4)).unwrap();
    second.flush(LONG).unwrap();
    assert_eq!(service.journal(), levels(4));
    // The first one heard it too: on the same watermark, or as the answer to its next batch.
    let error = first
        .send(level(9))
        .and_then(|_| first.flush(LONG))
        .unwrap_err();
    assert!(matches!(
        error,
        ClientError::SessionSuperseded { session: 1, by: 2 }
    ));
    assert!(matches!(
        first.send(level(10)),
        Err(ClientError::SessionSuperseded { .. })
    ));
    second.send(level(20)).unwrap();
    second.close(LONG).unwrap();
}

#[test]
fn a_second_run_with_the_same_session_number_sends_nothing_and_is_told() {
    let endpoint = free_endpoint();
    let service = Service::start(&endpoint, "demo", "ada", Faults::default());
    let shared = open_session(&[&endpoint], LONG).unwrap();
    let connect = || {
        Robot::builder("demo", "ada")
            .zenoh_session(shared.clone())
            .settings(RobotSettings {
                session: Some(5),
                ends_session: false,
                ..RobotSettings::default()
            })
            .connect()
            .unwrap()
    };
    let first = connect();
    first.send_batch(levels(10)).unwrap();
    first.close(LONG).unwrap();
    for count in [1, 10, 500] {
        let second = connect();
        let told = second
            .send_batch(levels(count))
            .and_then(|_| second.flush(LONG));
        let error = told.unwrap_err();
        assert!(matches!(
            error,
            ClientError::SessionSuperseded { session: 5, by: 5 }
        ));
        assert!(error.to_string().contains("in use by another run"));
        assert_eq!(second.counters().samples_sent, 0);
        assert!(matches!(
            second.close(LONG),
            Err(ClientError::SessionSuperseded { .. })
        ));
    }
    assert_eq!(service.journal(), levels(10));
}

#[test]
fn a_full_window_refuses_after_the_timeout_and_says_how_far_it_came() {
    let endpoint = free_endpoint();
    let _router = service::router(&endpoint);
    let settings = RobotSettings {
        window_samples: 8,
        send_timeout: Duration::from_millis(50),
        ..RobotSettings::default()
    };
    let robot = Robot::builder("demo", "ada")
        .endpoint(&endpoint)
        .settings(settings)
        .connect()
        .unwrap();
    assert!(matches!(
        robot.send_batch(levels(10)),
        Err(ClientError::WindowFull {
            pending: 8,
            taken: 8
        })
    ));
    assert!(matches!(
        robot.send(level(8)),
        Err(ClientError::WindowFull {
            pending: 8,
            taken: 0
        })
    ));
}

#[test]
fn every_kind_of_sample_and_every_codec_reaches_the_service() {
    for codec in [Codec::Postcard, Codec::Cbor, Codec::Json] {
        let endpoint = free_endpoint();
        let service = Service::start(&endpoint, "demo", "ada", Faults::default());
        let settings = RobotSettings {
            codec,
            ..RobotSettings::default()
        };
        let robot = Robot::builder("demo", "ada")
            .endpoint(&endpoint)
            .settings(settings)
            .connect()
            .unwrap();
        let still = [0.0, 0.0, 0.0, 1.0];
        robot.start_pose_at(1, [1.0, 2.0, 0.0], still).unwrap();
        robot.velocity_at(2, [1.0; 3], [0.0; 3], 0.1).unwrap();
        robot.increment_at(3, [0.1, 0.0, 0.0], still).unwrap();
        robot.level_at(4, "touch", 0.7).unwrap();
        robot.descriptor_at(5, "camera", vec![0.5; 8]).unwrap();
        let relation = Relation::Position {
            translation_m: [1.0, 0.0, 0.0],
            sd_m: [0.1; 3],
        };
        robot
            .sighting_at(6, Target::Landmark("door".to_owned()), relation.clone())
            .unwrap();
        robot.marker_at(7, "dock", TripMark::Ends).unwrap();
        // The clock's stamps go on from there.
        robot.sighting(Target::OwnSample(0), relation).unwrap();
        robot.level("touch", 0.8).unwrap();
        robot.flush(LONG).unwrap();
        let journal = service.journal();
        assert_eq!(journal.len(), 9, "{codec:?}");
        assert!(journal.is_sorted_by_key(|sample| sample.stamp_ns));
        assert!(matches!(&journal[6].body, SampleBody::Marker(m) if m.ends_trip));
    }
}

#[test]
fn a_stamp_from_the_clock_never_runs_backwards() {
    let endpoint = free_endpoint();
    let service = Service::start(&endpoint, "demo", "ada", Faults::default());
    let robot = Robot::connect(&endpoint, "demo", "ada").unwrap();
    robot.level_at(i64::MAX, "touch", 0.1).unwrap();
    robot.level("touch", 0.2).unwrap();
    robot.flush(LONG).unwrap();
    assert_eq!(service.journal()[1].stamp_ns, i64::MAX);
}

#[test]
fn estimates_of_this_session_reach_the_callback() {
    let endpoint = free_endpoint();
    let _service = Service::start(&endpoint, "demo", "ada", Faults::default());
    let robot = Robot::connect(&endpoint, "demo", "ada").unwrap();
    assert_eq!(robot.latest_estimate(), None);
    let (told, heard) = channel();
    robot.on_estimate(move |estimate| {
        // The test may have ended already.
        let _ = told.send(estimate.clone());
    });
    robot.send(level(77)).unwrap();
    let estimate = heard.recv_timeout(LONG).unwrap();
    assert_eq!((estimate.seq, estimate.stamp_ns), (0, 77));
    assert_eq!(robot.latest_estimate(), Some(estimate));
}

#[test]
fn samples_refused_for_good_are_told_and_do_not_hold_up_the_rest() {
    let endpoint = free_endpoint();
    let faults = Faults {
        refused_seq: Some(1),
        ..Faults::default()
    };
    let _service = Service::start(&endpoint, "demo", "ada", faults);
    let robot = Robot::connect(&endpoint, "demo", "ada").unwrap();
    robot.send_batch(levels(2)).unwrap();
    robot.flush(LONG).unwrap();
    let refused = Rejection {
        range: SeqRange { from: 1, to: 2 },
        reason: SkipReason::NumberOutOfRange,
    };
    assert_eq!(robot.rejections(), [refused]);
    // The refused sample brings no estimate; the one before it is the latest there is.
    assert_eq!(robot.estimate(LONG).unwrap().seq, 0);
}

#[test]
fn a_sample_that_no_message_can_carry_is_refused_at_once() {
    let endpoint = free_endpoint();
    let _router = service::router(&endpoint);
    let shared = open_session(&[&endpoint], LONG).unwrap();
    let robot = Robot::builder("demo", "ada")
        .zenoh_session(shared.clone())
        .connect()
        .unwrap();
    assert!(matches!(
        robot.descriptor("camera", vec![1.0; 1 << 18]),
        Err(ClientError::SampleTooLong { .. })
    ));
    let settings = RobotSettings {
        codec: Codec::Json,
        ..RobotSettings::default()
    };
    let json = Robot::builder("demo", "eve")
        .zenoh_session(shared)
        .settings(settings)
        .connect()
        .unwrap();
    assert!(matches!(
        json.level("touch", f64::NAN),
        Err(ClientError::NotFinite)
    ));
    assert_eq!((robot.pending(), json.pending()), (0, 0));
}

#[test]
fn names_and_settings_are_checked_before_connecting() {
    let nowhere = "tcp/127.0.0.1:1";
    assert!(matches!(
        Robot::connect(nowhere, "a/b", "ada"),
        Err(ClientError::Space(_))
    ));
    assert!(matches!(
        Robot::connect(nowhere, "demo", "*"),
        Err(ClientError::Agent(_))
    ));
    for (batch_samples, window_samples) in [(0, 1), (4097, 1), (1, 0)] {
        let settings = RobotSettings {
            batch_samples,
            window_samples,
            ..RobotSettings::default()
        };
        let built = Robot::builder("demo", "ada")
            .endpoint(nowhere)
            .settings(settings);
        assert!(matches!(built.connect(), Err(ClientError::Settings(_))));
    }
}

#[test]
fn closing_ends_the_session_with_a_last_sample_at_the_last_stamp() {
    let endpoint = free_endpoint();
    let service = Service::start(&endpoint, "demo", "ada", Faults::default());
    let connect = || Robot::connect(&endpoint, "demo", "ada").unwrap();
    // One that has sent nothing has no session to end.
    connect().close(LONG).unwrap();
    assert_eq!(service.journal(), []);
    let robot = connect();
    robot.send_batch(levels(3)).unwrap();
    robot.close(LONG).unwrap();
    let journal = service.journal();
    let last = journal.last().unwrap();
    assert_eq!(journal[..3], levels(3));
    assert_eq!((journal.len(), &last.body), (4, &SampleBody::SessionEnd {}));
    assert_eq!(last.stamp_ns, journal[2].stamp_ns);
}

#[test]
fn waits_without_an_end_are_no_fault() {
    let endpoint = free_endpoint();
    let _service = Service::start(&endpoint, "demo", "ada", Faults::default());
    let settings = RobotSettings {
        batch_delay: Duration::MAX,
        window_samples: 2,
        send_timeout: Duration::MAX,
        connect_timeout: Duration::MAX,
        match_timeout: Duration::MAX,
        ..RobotSettings::default()
    };
    let robot = Robot::builder("demo", "ada")
        .endpoint(&endpoint)
        .settings(settings)
        .connect()
        .unwrap();
    robot.send_batch(levels(5)).unwrap();
    robot.flush(Duration::MAX).unwrap();
    assert_eq!(robot.estimate(Duration::MAX).unwrap().seq, 4);
    robot.close(Duration::MAX).unwrap();
}

#[test]
fn an_estimate_of_an_owner_before_is_not_taken_and_one_of_the_next_may_go_back() {
    let endpoint = free_endpoint();
    let router = service::router(&endpoint);
    let _service = Service::on(router.clone(), "demo", "ada", Faults::default());
    let robot = Robot::connect(&endpoint, "demo", "ada").unwrap();
    robot.send_batch(levels(5)).unwrap();
    robot.flush(LONG).unwrap();
    let known = robot.estimate(LONG).unwrap();
    let (told, heard) = channel();
    robot.on_estimate(move |estimate| told.send((estimate.term, estimate.seq)).unwrap());
    for (term, seq) in [(4, 2), (3, 4), (4, 1), (4, 2), (5, 0), (0, 4), (5, 1)] {
        let estimate = Estimate {
            term,
            seq,
            ..known.clone()
        };
        router
            .put(
                estimate_key("demo", "ada"),
                Codec::Postcard.encode(&estimate),
            )
            .encoding(POSTCARD_V1)
            .wait()
            .unwrap();
    }
    let heard: Vec<_> = { 0..4 }
        .map(|_| heard.recv_timeout(LONG).unwrap())
        .collect();
    assert_eq!(heard, [(4, 2), (4, 2), (5, 0), (5, 1)]);
    assert_eq!(robot.latest_estimate().unwrap().seq, 1);
}
