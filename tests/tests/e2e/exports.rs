//! Exports of ways for other programs, and of maps as they were.

use std::collections::{BTreeMap, BTreeSet};

use cogmap_client::Api;
use cogmap_proto::{
    Increment, RecallQuery, RecalledPlace, RouteAvoid, RouteCost, RouteEnd, RouteFormat,
    RouteQuery, RouteReverse, Sample, SampleBody,
};
use cogmap_tests::{Server, batch, run};
use serde_json::Value;

const AGENT: &str = "ada";

/// A straight corridor of eight metres, a corner, and four metres on; then all the way back but two
/// metres.
fn corner() -> Vec<Sample> {
    let mut bodies = Vec::new();
    let mut go = |x_m: f64, y_m: f64, times: usize| {
        let body = SampleBody::Increment(Increment {
            translation_m: [x_m, y_m, 0.0],
            rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
            noise: None,
        });
        bodies.extend(std::iter::repeat_n(body, times));
    };
    go(0.5, 0.0, 16);
    go(0.0, 0.5, 8);
    go(0.0, -0.5, 8);
    go(-0.5, 0.0, 12);
    let stamped = (0..).step_by(500_000_000).zip(bodies);
    stamped
        .map(|(stamp_ns, body)| Sample { stamp_ns, body })
        .collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    let numbers = value.as_array().unwrap().iter();
    numbers.map(|number| number.as_f64().unwrap()).collect()
}

/// Start, end, duration \[s\], and whether it was travelled.
type Edge = (u64, u64, f64, bool);

/// The rules of the sample graphs of `nav2_route` and of its loader: features with whole ids of 32
/// bits that none shares, points in the plane with a frame, edges in one line between two of them,
/// metadata of numbers, texts and truths, where a duration must be read as a float.
fn check_nav2(graph: &Value) -> (BTreeMap<u64, Vec<f64>>, Vec<Edge>) {
    assert_eq!(graph["type"], "FeatureCollection");
    let (mut ids, mut nodes, mut edges) = (BTreeSet::new(), BTreeMap::new(), Vec::new());
    for feature in graph["features"].as_array().unwrap() {
        assert_eq!(feature["type"], "Feature");
        let (properties, geometry) = (&feature["properties"], &feature["geometry"]);
        let id = properties["id"].as_u64().unwrap();
        assert!(u32::try_from(id).is_ok() && ids.insert(id), "{id}");
        let whole = |name: &str| properties[name].as_u64().unwrap();
        if geometry["type"] == "Point" {
            assert_eq!(properties["frame"], "map");
            let at = numbers(&geometry["coordinates"]);
            assert_eq!(at.len(), 2);
            nodes.insert(id, at);
            continue;
        }
        assert_eq!(geometry["type"], "MultiLineString");
        let lines = geometry["coordinates"].as_array().unwrap();
        assert_eq!(lines.len(), 1);
        let line: Vec<_> = lines[0].as_array().unwrap().iter().map(numbers).collect();
        let (start, end) = (whole("startid"), whole("endid"));
        assert_eq!(line, [nodes[&start].clone(), nodes[&end].clone()]);
        let metadata = &properties["metadata"];
        assert!(metadata["abs_time_taken"].is_f64(), "{metadata}");
        let seconds = metadata["abs_time_taken"].as_f64().unwrap();
        edges.push((
            start,
            end,
            seconds,
            metadata["travelled"].as_bool().unwrap(),
        ));
    }
    (nodes, edges)
}

#[test]
fn ways_are_exported_for_nav2_and_as_graphml() {
    let server = Server::start(&[]);
    server
        .api()
        .post_samples("default", AGENT, &batch(1, 0, corner()))
        .unwrap();
    let path = |rest: &str| format!("/v1/spaces/default/export?{rest}");
    let (nodes, edges) = check_nav2(&server.http().get(&path("format=nav2")).json(200));
    // The ends, the corner, and where the way back ended.
    assert_eq!(nodes.len(), 4, "{nodes:?}");
    assert_eq!(edges.len(), 2 * 3, "{edges:?}");
    let untravelled: Vec<_> = edges.iter().filter(|edge| !edge.3).collect();
    assert_eq!(untravelled.len(), 1, "{edges:?}");
    for (start, end, seconds, _) in &edges {
        let (a, b) = (&nodes[start], &nodes[end]);
        let distance_m = (a[0] - b[0]).hypot(a[1] - b[1]);
        // At one metre a second.
        assert!(
            (seconds - distance_m).abs() < 0.6,
            "{start} {end} {seconds} {distance_m}"
        );
    }
    let never = server
        .http()
        .get(&path("format=nav2&reverse=never"))
        .json(200);
    assert_eq!(check_nav2(&never).1.len(), 5);
    // Wide enough for the corner.
    let coarse = server
        .http()
        .get(&path("format=nav2&tolerance_m=5"))
        .json(200);
    assert!(check_nav2(&coarse).0.len() < 4);

    let graphml = server.http().get(&path("format=graphml")).body;
    assert!(graphml.starts_with("<?xml"), "{graphml}");
    assert_eq!(graphml.matches("<node ").count(), nodes.len());
    assert_eq!(graphml.matches("<edge ").count(), edges.len());
    for id in nodes.keys() {
        assert!(graphml.contains(&format!("<node id=\"{id}\">")));
    }
    for wrong in [
        "format=nav2&tolerance_m=-1",
        "format=nav2&tolerance_m=1000",
        "format=json&tolerance_m=1",
        "format=ply&reverse=never",
        "format=graphml&agent=ada",
    ] {
        let refused = server.http().get(&path(wrong));
        refused.problem(422, "invalid-query");
    }
}

#[test]
fn a_map_is_exported_as_it_was() {
    let mut server = Server::start(&[]);
    let api = server.api();
    let samples = corner();
    let mut served = Vec::new();
    for (part, samples) in (0..).zip(samples.chunks(11)) {
        let batch = batch(1, part * 11, samples.to_vec());
        api.post_samples("default", AGENT, &batch).unwrap();
        let export = server.http().get("/v1/spaces/default/export").json(200);
        served.push(export);
    }
    let data = server.data().to_str().unwrap().to_owned();
    server.kill();
    let revision = |export: &Value| export["space"]["map_revision"].as_u64().unwrap();
    for then in &served {
        let as_of = revision(then).to_string();
        let exported = run(&["export", "map", "--data-dir", &data, "--as-of", &as_of]);
        let exported: Value = serde_json::from_str(exported.text()).unwrap();
        // The digest among it is that of the whole map.
        assert_eq!(&exported, then);
    }
    let latest = run(&["export", "map", "--data-dir", &data]);
    let latest: Value = serde_json::from_str(latest.text()).unwrap();
    assert_eq!(Some(&latest), served.last());
    let beyond = (revision(&latest) + 1).to_string();
    let refused = run(&["export", "map", "--data-dir", &data, "--as-of", &beyond]);
    assert_eq!(refused.code(), 1);
    let range = format!("0 to {}", revision(&latest));
    assert!(refused.stderr.contains(&range), "{}", refused.stderr);
}

/// Length of a route \[m\], and its places.
type Route = (f64, Vec<Option<u64>>);

/// What a space recalls at some positions, and its routes between all pairs of some places.
fn answers(api: &Api, space: &str) -> (Vec<Vec<RecalledPlace>>, Vec<Route>) {
    let recalled = [[0.3, 0.1, 0.0], [5.0, 0.0, 0.0], [8.0, 3.0, 0.0]].map(|position_m| {
        let query = RecallQuery {
            position_m: Some(position_m),
            ..RecallQuery::default()
        };
        api.recall(space, &query).unwrap().places
    });
    let ends = [0, 5, 11, 17, 22];
    let pairs = ends.iter().flat_map(|from| ends.map(|to| (*from, to)));
    let routes = pairs.map(|(from, to)| {
        let query = RouteQuery {
            from: RouteEnd::Place(from),
            to: RouteEnd::Place(to),
            cost: RouteCost::Time,
            reverse: RouteReverse::Allowed,
            avoid: RouteAvoid::default(),
            shortcuts: false,
            body_radius_m: None,
            alternatives: 0,
            format: RouteFormat::Steps,
            spacing_m: None,
        };
        let route = api.route(space, &query).unwrap();
        let steps = route.steps.iter().map(|step| step.place);
        (route.length_m, steps.collect())
    });
    (recalled.to_vec(), routes.collect())
}

#[test]
fn an_export_makes_a_space_with_the_same_answers() {
    let mut server = Server::start(&[]);
    let api = server.api();
    let samples = batch(1, 0, corner());
    api.post_samples("default", AGENT, &samples).unwrap();
    let expected = answers(&api, "default");
    let data = server.data().to_str().unwrap().to_owned();
    server.terminate();
    let exported = run(&["export", "map", "--data-dir", &data]);
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("map.json");
    std::fs::write(&file, exported.text()).unwrap();
    let file = file.to_str().unwrap();

    let import = ["import", file, "--data-dir", &data, "--space", "copy"];
    let imported = run(&import);
    assert_eq!(imported.code(), 0, "{}", imported.stderr);
    let again = run(&import);
    assert_eq!(again.code(), 1, "the space is there already");
    let mut digests = Vec::new();
    for _ in 0..2 {
        server.run();
        let (mut recalled, routes) = answers(&api, "copy");
        // Strengths fade with the number of records, of which there are fewer now.
        for (now, then) in recalled
            .iter_mut()
            .flatten()
            .zip(expected.0.iter().flatten())
        {
            assert!((now.place.strength / then.place.strength - 1.0).abs() < 1e-3);
            now.place.strength = then.place.strength;
        }
        assert_eq!((recalled, routes), expected);
        digests.push(api.space("copy").unwrap().digest);
        server.kill();
    }
    assert!(imported.text().contains(&digests[0]), "{}", imported.text());
    assert_eq!(digests[0], digests[1]);

    std::fs::write(file, "{}").unwrap();
    let refused = run(&["import", file, "--data-dir", &data, "--space", "none"]);
    assert_eq!(refused.code(), 1);
    assert!(
        refused.stderr.contains("no JSON export"),
        "{}",
        refused.stderr
    );
}
