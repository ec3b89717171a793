//! Names that others claim, and agents that are removed.

use std::sync::mpsc::channel;
use std::time::Duration;

use cogmap_client::{ApiError, ClientError, Robot, RobotSettings};
use cogmap_proto::{Codec, Event, EventKind, Place, events_key};
use cogmap_tests::{Drive, LONG, RawPublisher, Server, batch, eventually};
use zenoh::Wait;

fn drive(robot: &Robot, seed: u64, count: usize) {
    robot
        .send_batch(Drive::new(seed).take(count).collect())
        .unwrap();
    robot.flush(LONG).unwrap();
}

/// A robot that numbers its run as robots do by themselves: by the time.
fn robot(server: &Server, agent: &str) -> Robot {
    server.robot_with(agent, RobotSettings::default())
}

#[test]
fn a_forged_session_cannot_take_a_name_for_good() {
    let server = Server::start(&[]);
    let mut raw = RawPublisher::connect(&server.endpoint());
    let forged = |session| batch(session, 0, Drive::new(1).take(5).collect());
    raw.put_batch("default", "ada", Codec::Cbor, &forged(u64::MAX - 1));
    eventually("the refusal in the metrics", || {
        let count = server.metrics().sum(
            "cogmap_dropped_messages_total",
            &[("reason", "session_in_future")],
        );
        (count >= 1).then_some(()).ok_or_else(|| count.to_string())
    });
    assert!(server.api().agents("default").unwrap().is_empty());
    let ada = robot(&server, "ada");
    drive(&ada, 2, 50);
    let own = ada.session();
    // Less than a day ahead it is taken: the clocks of robots differ.
    raw.put_batch(
        "default",
        "ada",
        Codec::Cbor,
        &forged(own + 3_600_000_000_000),
    );
    eventually("the takeover", || {
        match ada.flush(Duration::from_millis(200)) {
            Err(ClientError::SessionSuperseded { .. }) => Ok(()),
            other => Err(format!("{other:?}")),
        }
    });
    drop(ada);
    // Whoever runs the service gives the name back.
    server.api().delete_agent("default", "ada").unwrap();
    let ada = robot(&server, "ada");
    drive(&ada, 3, 20);
    assert_eq!(
        ada.watermark().map(|mark| mark.session),
        Some(ada.session())
    );
}

#[test]
fn a_robot_whose_clock_is_far_ahead_is_told() {
    let server = Server::start(&[]);
    let robot = server.robot("ada", 1 << 63);
    robot
        .send_batch(Drive::new(1).take(5).collect())
        .unwrap_or_default();
    let told = eventually("the refusal", || {
        match robot.flush(Duration::from_millis(200)) {
            Err(ClientError::SessionRefused { detail }) => Ok(detail),
            other => Err(format!("{other:?}")),
        }
    });
    assert!(
        told.contains("future") && told.contains("Unix time"),
        "{told}"
    );
}

#[test]
fn a_removed_agent_leaves_its_past_and_its_name() {
    let mut server = Server::start(&[]);
    let api = server.api();
    let raw = RawPublisher::connect(&server.endpoint());
    let (heard, hear) = channel();
    raw.session()
        .declare_subscriber(events_key("default"))
        .callback(move |sample| {
            let event: Event = Codec::Cbor.decode(&sample.payload().to_bytes()).unwrap();
            // The test may have heard enough.
            let _ = heard.send((event.agent, event.kind));
        })
        .background()
        .wait()
        .unwrap();
    let ada = robot(&server, "ada");
    drive(&ada, 4, 400);
    let session = ada.session();
    ada.close(LONG).unwrap();
    let (places, trips) = (
        api.places("default").unwrap(),
        api.trips("default").unwrap(),
    );
    assert!(!places.is_empty() && !trips.is_empty());
    api.delete_agent("default", "ada").unwrap();
    eventually("the event", || {
        let mut events = hear.try_iter();
        let removed = events.find(|(_, kind)| *kind == EventKind::AgentRemoved {});
        removed
            .map(|(agent, _)| assert_eq!(agent, "ada"))
            .ok_or_else(String::new)
    });
    let gone = |result: Result<(), ApiError>| match result {
        Err(ApiError::Problem(problem)) => (problem.status, problem.kind),
        other => panic!("{other:?}"),
    };
    let removed = (410, "/problems/removed-agent".to_owned());
    assert_eq!(gone(api.delete_agent("default", "ada")), removed);
    // A kill later it is still so.
    server.kill();
    server.run();
    assert_eq!(gone(api.agent("default", "ada").map(drop)), removed);
    assert_eq!(gone(api.delete_agent("default", "nobody")).0, 404);
    assert!(api.agents("default").unwrap().is_empty());
    let is_same = |(place, was): (&Place, &Place)| {
        (place.id, place.translation_m, &place.founder) == (was.id, was.translation_m, &was.founder)
    };
    let still = api.places("default").unwrap();
    assert_eq!(still.len(), places.len());
    assert!(still.iter().zip(&places).all(is_same), "{still:?}");
    assert!(
        api.trips("default")
            .unwrap()
            .iter()
            .all(|trip| trip.agent == "ada")
    );
    let way = format!("/v1/spaces/default/agents/ada/trajectory?session={session}");
    let way = server.http().get(&way).json(200);
    assert!(
        way["poses"]
            .as_array()
            .is_some_and(|poses| poses.len() > 50)
    );
    // The name is free: a new agent, of which nothing is known yet.
    let again = server.robot("ada", 1);
    drive(&again, 5, 10);
    let detail = api.agent("default", "ada").unwrap();
    assert_eq!(
        (detail.watermark.session, detail.watermark.durable),
        (1, 10)
    );
}

#[test]
fn names_that_never_did_anything_make_room() {
    let server = Server::start(&["engine.agents_max=16"]);
    let mut raw = RawPublisher::connect(&server.endpoint());
    let founder = robot(&server, "founder");
    drive(&founder, 6, 100);
    // Without a start pose they are nowhere in the founder's map.
    let samples: Vec<_> = Drive::new(7).skip(1).take(1).collect();
    for name in 0..15 {
        let batch = batch(1, 0, samples.clone());
        raw.put_batch("default", &format!("forged-{name}"), Codec::Cbor, &batch);
    }
    eventually("sixteen agents", || {
        let agents = server.api().agents("default").unwrap().len();
        (agents == 16)
            .then_some(())
            .ok_or_else(|| agents.to_string())
    });
    let honest = robot(&server, "honest");
    drive(&honest, 8, 50);
    let names: Vec<_> = { server.api().agents("default").unwrap() }
        .into_iter()
        .map(|agent| agent.name)
        .collect();
    assert_eq!(names.len(), 16);
    assert!(
        names.iter().any(|name| name == "founder") && names.iter().any(|name| name == "honest")
    );
    assert!(!names.iter().any(|name| name == "forged-0"), "{names:?}");
}
