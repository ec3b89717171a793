//! Routes: over HTTP and Zenoh alike, the shortest of the exported ways, and the same after a
//! restart.

use std::collections::BTreeMap;

use cogmap_proto::{
    Codec, Increment, Problem, RouteAnswer, RouteAvoid, RouteCost, RouteEnd, RouteFormat,
    RouteQuery, RouteReverse, Sample, SampleBody, query_key,
};
use cogmap_tests::{RawPublisher, Server, batch};

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

    server.kill();
    server.run();
    for (query, answer) in answers {
        assert_eq!(server.api().route("default", &query).unwrap(), answer);
    }
}
