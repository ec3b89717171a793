//! Routes: over HTTP and Zenoh alike, the shortest of the exported ways, and the same after a
//! restart.

use std::collections::BTreeMap;
use std::sync::mpsc::channel;

use cogmap_client::{Api, ApiError};
use cogmap_proto::{
    BlockageRequest, Codec, Event, EventKind, FollowRequest, Increment, Problem, RouteAnswer,
    RouteAvoid, RouteBack, RouteCost, RouteEnd, RouteFormat, RouteQuery, RouteReverse, Sample,
    SampleBody, events_key, query_key,
};
use cogmap_tests::{LONG, RawPublisher, Server, batch};
use zenoh::Wait;

const AGENT: &str = "ada";

/// Round a block and across it: increments of 0.1 m with a quarter turn at each corner.
fn round_the_block() -> Vec<Sample> {
    let quarter = [0.0, 0.0, 0.5_f64.sqrt(), 0.5_f64.sqrt()];
    let increment = |x_m: f64, rotation_xyzw: [f64; 4]| {
        SampleBody::Increment(Increment {
            translation_m: [x_m, 0.0, 0.0],
            rotation_xyzw,
            noise: None,
        })
    };
    let mut bodies = Vec::new();
    for side_m in [3.0, 2.0, 3.0, 2.0, 1.5, 2.0] {
        let mut gone_m = 0.0;
        while gone_m < side_m {
            bodies.push(increment(0.1, [0.0, 0.0, 0.0, 1.0]));
            gone_m += 0.1;
        }
        bodies.push(increment(0.0, quarter));
    }
    let stamps = (1_800_000_000_000_000_000_i64..).step_by(100_000_000);
    let stamped = stamps.zip(bodies);
    stamped
        .map(|(stamp_ns, body)| Sample { stamp_ns, body })
        .collect()
}

fn query(from: u64, to: u64) -> RouteQuery {
    RouteQuery {
        from: RouteEnd::Place(from),
        to: RouteEnd::Place(to),
        cost: RouteCost::Length,
        reverse: RouteReverse::Allowed,
        avoid: RouteAvoid::default(),
        shortcuts: false,
        body_radius_m: None,
        alternatives: 2,
        format: RouteFormat::Path,
        spacing_m: None,
    }
}

/// Length of the shortest route from a place to each other by exported ways (Bellman 1958).
fn shortest(ways: &[serde_json::Value], from: u64) -> BTreeMap<u64, f64> {
    let mut lengths = BTreeMap::from([(from, 0.0)]);
    for _ in 0..ways.len() {
        for way in ways {
            let ends = [&way["from"], &way["to"]].map(|end| end.as_u64().unwrap());
            let length_m = way["length_m"].as_f64().unwrap();
            for [from, to] in [ends, [ends[1], ends[0]]] {
                if let Some(so_far) = lengths.get(&from).copied() {
                    let known = lengths.entry(to).or_insert(f64::INFINITY);
                    *known = known.min(so_far + length_m);
                }
            }
        }
    }
    lengths
}

#[test]
fn a_route_is_the_shortest_of_the_exported_ways_on_every_door_and_after_a_restart() {
    let mut server = Server::start(&[]);
    let api = server.api();
    api.post_samples("default", AGENT, &batch(1, 0, round_the_block()))
        .unwrap();
    let export = server.http().get("/v1/spaces/default/export").json(200);
    let ways = export["ways"].as_array().unwrap().clone();
    assert!(ways.len() > 30, "{}", ways.len());
    let mut answers = Vec::new();
    for (from, to) in [(0, 9), (5, 25), (30, 2)] {
        let query = query(from, to);
        let answer = api.route("default", &query).unwrap();
        let expected = shortest(&ways, from)[&to];
        assert!(
            (answer.length_m - expected).abs() < 1e-4,
            "{expected}: {answer:?}"
        );
        let raw = RawPublisher::connect(&server.endpoint());
        for codec in [Codec::Json, Codec::Cbor, Codec::Postcard] {
            let key = query_key("default", "route");
            let bytes = raw.ask(&key, codec.encoding(), codec.encode(&query));
            let heard: RouteAnswer = codec.decode(&bytes.unwrap()).unwrap();
            assert_eq!(heard, answer);
        }
        answers.push((query, answer));
    }
    let raw = RawPublisher::connect(&server.endpoint());
    let key = query_key("default", "route");
    let unknown = Codec::Json.encode(&query(0, 9_999));
    let problem = raw.ask(&key, Codec::Json.encoding(), unknown).unwrap_err();
    let problem: Problem = Codec::Json.decode(&problem).unwrap();
    assert_eq!(
        (problem.status, &*problem.kind),
        (404, "/problems/unknown-memory")
    );
    let problem = raw.ask(&key, Codec::Json.encoding(), Vec::new());
    let problem: Problem = Codec::Json.decode(&problem.unwrap_err()).unwrap();
    assert_eq!(problem.status, 400, "{problem:?}");
    assert!(
        problem.detail.contains("there is no message"),
        "{problem:?}"
    );

    server.kill();
    server.run();
    for (query, answer) in answers {
        assert_eq!(server.api().route("default", &query).unwrap(), answer);
    }
}

#[test]
fn a_followed_route_and_its_blockages_outlive_a_restart_and_are_told_on_every_door() {
    let mut server = Server::start(&[]);
    let api = server.api();
    let samples = round_the_block();
    let last_ns = samples.last().unwrap().stamp_ns;
    api.post_samples("default", AGENT, &batch(1, 0, samples.clone()))
        .unwrap();
    let events = RawPublisher::connect(&server.endpoint());
    let (note, told) = channel();
    events
        .session()
        .declare_subscriber(events_key("default"))
        .callback(move |sample| {
            let event: Event = Codec::Cbor.decode(&sample.payload().to_bytes()).unwrap();
            // The test may have heard enough.
            let _ = note.send(event);
        })
        .background()
        .wait()
        .unwrap();
    let request = FollowRequest {
        to: RouteEnd::Place(9),
        cost: RouteCost::Length,
        reverse: RouteReverse::Allowed,
        avoid: RouteAvoid::default(),
    };
    let route = api.follow_route("default", AGENT, &request).unwrap();
    assert!(route.steps.len() > 3 && route.steps_done == 0);
    let ahead = route.steps[1].place;
    let place = BlockageRequest {
        place: ahead,
        ..BlockageRequest::default()
    };
    let blockage = api.block("default", &place).unwrap();
    let other = api.followed_route("default", AGENT).unwrap();
    assert!(other.steps.iter().all(|step| step.place != ahead));
    let led = api.followed_routes("default").unwrap();
    let [only] = &led[..] else {
        panic!("one agent follows a route: {led:?}");
    };
    assert_eq!(
        (only.agent.as_str(), only.length_m, only.steps_left),
        (AGENT, other.length_m, other.steps.len() as u64)
    );
    let is_new_route = |event: &Event| {
        matches!(&event.kind, EventKind::RouteLeft { blockage: Some(id), steps, .. }
            if *id == blockage.id && !steps.is_empty())
    };
    while !is_new_route(&told.recv_timeout(LONG).expect("the new route is told")) {}
    let page = server.http().get("/v1/spaces/default/events?format=json");
    let page = page.json(200);
    let kinds = page["events"].as_array().unwrap().iter();
    assert!(
        kinds
            .clone()
            .any(|one| one["event"]["kind"].get("route_left").is_some())
    );

    server.kill();
    server.run();
    let api = server.api();
    assert_eq!(api.followed_route("default", AGENT).unwrap(), other);
    assert_eq!(api.followed_routes("default").unwrap(), led);
    assert_eq!(
        api.blockages("default").unwrap(),
        std::slice::from_ref(&blockage)
    );
    api.unblock("default", blockage.id).unwrap();
    assert_eq!(api.blockages("default").unwrap(), []);
    let still = Increment {
        translation_m: [0.0; 3],
        rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
        noise: None,
    };
    let sample = Sample {
        stamp_ns: last_ns + 1,
        body: SampleBody::Increment(still),
    };
    api.post_samples("default", AGENT, &batch(2, 0, vec![sample]))
        .unwrap();
    let over = api.followed_route("default", AGENT).unwrap_err();
    assert!(over.to_string().contains("follows no route"), "{over}");
    assert_eq!(api.followed_routes("default").unwrap(), []);
}

#[test]
fn instructions_that_make_no_sense_are_refused() {
    let server = Server::start(&[]);
    let api = server.api();
    api.post_samples("default", AGENT, &batch(1, 0, round_the_block()))
        .unwrap();
    let refused = |result: Result<(), ApiError>| match result {
        Err(ApiError::Problem(problem)) => (problem.status, problem.kind),
        other => panic!("{other:?}"),
    };
    let block = |request: &BlockageRequest| refused(api.block("default", request).map(drop));
    let none = BlockageRequest::default();
    let (unknown, invalid) = ("/problems/unknown-memory", "/problems/invalid-query");
    assert_eq!(block(&none), (422, invalid.to_owned()));
    let place = |place| BlockageRequest {
        place: Some(place),
        ..none.clone()
    };
    assert_eq!(block(&place(9_999)), (404, unknown.to_owned()));
    for radius_m in [None, Some(-1.0), Some(1e9)] {
        let ball = BlockageRequest {
            at_m: Some([0.0; 3]),
            radius_m,
            ..none.clone()
        };
        assert_eq!(block(&ball), (422, invalid.to_owned()), "{radius_m:?}");
    }
    assert_eq!(
        refused(api.unblock("default", 7)),
        (404, unknown.to_owned())
    );
    let follow = |api: &Api, to: RouteEnd| {
        let request = FollowRequest {
            to,
            cost: RouteCost::Length,
            reverse: RouteReverse::Allowed,
            avoid: RouteAvoid::default(),
        };
        refused(api.follow_route("default", AGENT, &request).map(drop))
    };
    let back = RouteBack {
        agent: AGENT.to_owned(),
        s: Some(1.0),
        m: Some(1.0),
    };
    for (to, expected) in [
        (RouteEnd::Place(9_999), (404, unknown)),
        (
            RouteEnd::PositionM([1e6; 3]),
            (422, "/problems/nothing-near"),
        ),
        (RouteEnd::Back(back), (422, invalid)),
        (
            RouteEnd::Home("nobody".to_owned()),
            (404, "/problems/unknown-agent"),
        ),
    ] {
        assert_eq!(follow(&api, to), (expected.0, expected.1.to_owned()));
    }
    assert_eq!(
        refused(api.followed_route("default", AGENT).map(drop)),
        (404, unknown.to_owned())
    );
    assert_eq!(
        refused(api.pin_trip("default", 9_999)),
        (404, unknown.to_owned())
    );
    for is_pinned in [true, false] {
        if is_pinned {
            api.pin_trip("default", 0).unwrap();
        } else {
            api.unpin_trip("default", 0).unwrap();
        }
        assert_eq!(api.trip("default", 0).unwrap().trip.pinned, is_pinned);
        let listed = api.trips("default").unwrap();
        assert!(
            listed
                .iter()
                .all(|trip| trip.pinned == (is_pinned && trip.id == 0))
        );
    }
}
