//! Routes: what is found, and every way in which there is none.

use cogmap_proto::Level;
use serde_json::json;

use super::*;

const JSON: &str = "application/json";

/// A rover that has gone five metres straight ahead, seen a post, and felt something at the end.
async fn driven() -> Rig {
    let rig = rig();
    rig.samples("rover", &steps(1, 0, 50)).await.good();
    rig.samples("rover", &at(1, 50, post_ahead("post")))
        .await
        .good();
    let felt = SampleBody::Level(Level {
        channel: "touch".to_owned(),
        value: 1.0,
        offset_m: [0.0; 3],
        normal: None,
    });
    rig.samples("rover", &at(1, 51, felt)).await.good();
    rig
}

async fn ask(rig: &Rig, query: &Value) -> Answer {
    let path = "/v1/spaces/lab/route";
    rig.send(Method::POST, path, JSON, query.to_string()).await
}

/// The places of a route, from its answer.
fn places(route: &Value) -> Vec<u64> {
    let steps = route["steps"].as_array().expect("steps");
    steps
        .iter()
        .filter_map(|step| step["place"].as_u64())
        .collect()
}

#[tokio::test]
async fn a_route_leads_back_the_way_that_was_gone() {
    let rig = driven().await;
    let query = json!({ "from": { "agent": "rover" }, "to": { "home": "rover" } });
    let route = ask(&rig, &query).await.good();
    assert_eq!(
        (&route["frame"], &route["space"]),
        (&"map".into(), &"lab".into())
    );
    let places = places(&route);
    assert!(
        places.len() > 10 && places.is_sorted_by(|a, b| a > b),
        "{places:?}"
    );
    assert_eq!(places.last(), Some(&0));
    let steps = route["steps"].as_array().expect("steps");
    for step in &steps[1..] {
        assert_eq!(
            (&step["way"], &step["traversals"]),
            (&"reversed".into(), &0.into())
        );
        // It faces back.
        let facing = step["rotation_xyzw"][2].as_f64().expect("a number").abs();
        assert!((facing - 1.0).abs() < 1e-9, "{step}");
        assert!(
            step["trip"] == 0 && step["tolerance_m"].as_f64() >= Some(0.125),
            "{step}"
        );
    }
    let length_m = route["length_m"].as_f64().expect("a number");
    assert!((4.4..5.2).contains(&length_m), "{length_m}");
    // The same question of the same map has the same answer.
    assert_eq!(ask(&rig, &query).await.good(), route);
    let start = json!({ "from": { "agent": "rover" }, "to": { "trip": 0 } });
    assert_eq!(ask(&rig, &start).await.good()["steps"], route["steps"]);
    let never = json!({
        "from": { "agent": "rover" }, "to": { "home": "rover" }, "reverse": "never",
    });
    let problem = ask(&rig, &never).await.problem(409, "no-way");
    let detail = problem["detail"].as_str().expect("a text");
    assert!(
        detail.contains("the nearest place that can be reached is"),
        "{detail}"
    );
}

#[tokio::test]
async fn a_path_has_poses_at_equal_distances() {
    let rig = driven().await;
    let query = json!({
        "from": { "position_m": [0.5, 0.1, 0] }, "to": { "position_m": [4, 0.1, 0] },
        "format": "path", "spacing_m": 0.2,
    });
    let route = ask(&rig, &query).await.good();
    let steps = route["steps"].as_array().expect("steps");
    let way = |step: &Value| step["way"].as_str().map(str::to_owned);
    assert_eq!(way(&steps[0]).as_deref(), Some("approach"));
    assert_eq!(steps.last().and_then(way).as_deref(), Some("approach"));
    let path = route["path"].as_array().expect("a path");
    let length_m = route["length_m"].as_f64().expect("a number");
    assert!(
        (path.len() as f64 - length_m / 0.2).abs() <= 2.0,
        "{} poses",
        path.len()
    );
    assert_eq!(path[0]["translation_m"], json!([0.5, 0.1, 0.0]));
    let last = path.last().expect("poses");
    assert_eq!(last["translation_m"], json!([4.0, 0.1, 0.0]));
    for pose in path {
        let squares = pose["rotation_xyzw"]
            .as_array()
            .expect("a quaternion")
            .iter();
        let squares = squares.map(|x| x.as_f64().expect("a number").powi(2));
        assert!((squares.sum::<f64>() - 1.0).abs() < 1e-9, "{pose}");
    }
    let here = json!({ "from": { "place": 3 }, "to": { "place": 3 }, "format": "path" });
    let here = ask(&rig, &here).await.good();
    assert_eq!(
        (&here["steps"], &here["path"], &here["cost"]),
        (&json!([]), &json!([]), &json!(0.0))
    );
}

#[tokio::test]
async fn ends_are_places_positions_agents_landmarks_trips_and_percepts() {
    let rig = driven().await;
    let start = json!({ "place": 0 });
    for end in [
        json!({ "place": 9 }),
        json!({ "position_m": [3, 0, 0] }),
        json!({ "agent": "rover" }),
        json!({ "landmark": "post" }),
        json!({ "percept": { "level": { "channel": "touch", "value": 1.0 } } }),
    ] {
        for cost in ["length", "time", "uncertainty", "recency"] {
            let query = json!({ "from": start, "to": end, "cost": cost });
            let route = ask(&rig, &query).await.good();
            assert!(places(&route).len() > 3, "{query}");
            assert!(route["cost"].as_f64() > Some(0.0), "{query}");
            let back = json!({ "from": end, "to": start, "cost": cost });
            assert_eq!(
                places(&ask(&rig, &back).await.good()).last(),
                Some(&0),
                "{back}"
            );
        }
    }
}

#[tokio::test]
async fn whatever_is_not_there_is_named() {
    let rig = driven().await;
    let to = |end: Value| json!({ "from": { "place": 0 }, "to": end });
    for (end, status, kind) in [
        (json!({ "place": 999 }), 404, "unknown-memory"),
        (json!({ "place": u64::MAX }), 404, "unknown-memory"),
        (json!({ "trip": 7 }), 404, "unknown-memory"),
        (json!({ "landmark": "door" }), 404, "unknown-memory"),
        (json!({ "agent": "nobody" }), 404, "unknown-agent"),
        (json!({ "home": "nobody" }), 404, "unknown-agent"),
        (json!({ "position_m": [2, 9, 0] }), 422, "nothing-near"),
        (json!({ "position_m": [1e300, 0, 0] }), 422, "invalid-query"),
        (json!({ "position_m": [null, 0, 0] }), 400, "malformed-body"),
        (json!({ "tower": 3 }), 400, "malformed-body"),
        (
            json!({ "percept": { "level": { "channel": "tuch", "value": 1.0 } } }),
            404,
            "unknown-channel",
        ),
    ] {
        ask(&rig, &to(end)).await.problem(status, kind);
    }
    let with = |field: &str, value: Value| {
        let mut query = json!({ "from": { "place": 0 }, "to": { "place": 5 } });
        query[field] = value;
        query
    };
    for (query, status, kind) in [
        (with("alternatives", json!(5)), 422, "invalid-query"),
        (with("spacing_m", json!(0)), 422, "invalid-query"),
        (with("speed", json!(1)), 400, "malformed-body"),
        (with("cost", json!("beauty")), 400, "malformed-body"),
        (
            with("avoid", json!({ "places": [999] })),
            404,
            "unknown-memory",
        ),
        (
            with(
                "avoid",
                json!({ "boxes": [{ "min_m": [1, 0, 0], "max_m": [0, 0, 0] }] }),
            ),
            422,
            "invalid-query",
        ),
        (with("avoid", json!({ "places": [3] })), 409, "no-way"),
        (
            with(
                "avoid",
                json!({ "boxes": [{ "min_m": [1, -1, -1], "max_m": [1.1, 1, 1] }] }),
            ),
            409,
            "no-way",
        ),
    ] {
        ask(&rig, &query).await.problem(status, kind);
    }
    let path = "/v1/spaces/nowhere/route";
    let body = with("cost", json!("time")).to_string();
    let answer = rig.send(Method::POST, path, JSON, body).await;
    answer.problem(404, "unknown-space");
}

#[tokio::test]
async fn a_lost_agent_and_a_forgotten_place_are_no_ends() {
    let rig = rig();
    let settings = "{\"places_max\": 12}";
    let path = "/v1/spaces/small";
    rig.send(Method::PUT, path, JSON, settings).await.good();
    let samples = "/v1/spaces/small/agents/rover/samples";
    let body = Codec::Json.encode(&steps(1, 0, 60));
    rig.send(Method::POST, samples, JSON, body).await.good();
    let newcomer = Codec::Json.encode(&steps(1, 0, 3));
    let samples = "/v1/spaces/small/agents/newcomer/samples";
    rig.send(Method::POST, samples, JSON, newcomer).await.good();
    let ask = async |from: Value, to: Value| {
        let query = json!({ "from": from, "to": to }).to_string();
        let path = "/v1/spaces/small/route";
        rig.send(Method::POST, path, JSON, query).await
    };
    let rover = json!({ "agent": "rover" });
    let lost = ask(json!({ "agent": "newcomer" }), rover.clone()).await;
    lost.problem(409, "agent-lost");
    let forgotten = ask(rover.clone(), json!({ "place": 0 })).await;
    forgotten.problem(410, "forgotten-memory");
    ask(rover, json!({ "home": "rover" }))
        .await
        .problem(410, "forgotten-memory");
}
