//! Every way to be refused is a problem document.

use cogmap_proto::limits::MESSAGE_BYTES_MAX;

use super::*;

const JSON: &str = "application/json";

#[tokio::test]
async fn paths_that_lead_nowhere() {
    let rig = rig();
    rig.get("/nowhere").await.problem(404, "unknown-route");
    rig.get("/v1/spaces/lab/nowhere")
        .await
        .problem(404, "unknown-route");
    rig.get("/docs/nowhere.js")
        .await
        .problem(404, "unknown-route");
    rig.get("/v1/spaces/void")
        .await
        .problem(404, "unknown-space");
    rig.get("/v1/spaces/void/places")
        .await
        .problem(404, "unknown-space");
    rig.get("/v1/spaces/void/agents/rover")
        .await
        .problem(404, "unknown-space");
    rig.get("/v1/spaces/lab/agents/rover")
        .await
        .problem(404, "unknown-agent");
    rig.get("/v1/spaces/lab/agents/rover/grid")
        .await
        .problem(404, "unknown-agent");
    rig.get("/v1/spaces/lab/agents/rover/trajectory")
        .await
        .problem(404, "unknown-agent");
    rig.get("/v1/spaces/lab/places/0")
        .await
        .problem(404, "unknown-memory");
    rig.get("/v1/spaces/lab/trips/18446744073709551615")
        .await
        .problem(404, "unknown-memory");
    rig.get("/v1/spaces/lab/landmarks/post")
        .await
        .problem(404, "unknown-memory");
    rig.get("/v1/spaces/lab/export?format=tum&agent=rover")
        .await
        .problem(404, "unknown-agent");
    let gone = Request::delete("/v1/spaces/void")
        .body(Body::empty())
        .expect("a request");
    rig.ask(gone).await.problem(404, "unknown-space");
}

#[tokio::test]
async fn paths_that_cannot_be() {
    let rig = rig();
    rig.get("/v1/spaces/a%20b")
        .await
        .problem(400, "invalid-path");
    rig.get("/v1/spaces/.hidden/places")
        .await
        .problem(400, "invalid-path");
    rig.get("/v1/spaces/%FF").await.problem(400, "invalid-path");
    rig.get("/v1/spaces/lab/agents/a*b")
        .await
        .problem(400, "invalid-path");
    rig.get("/v1/spaces/lab/places/-1")
        .await
        .problem(400, "invalid-path");
    rig.get("/v1/spaces/lab/places/one")
        .await
        .problem(400, "invalid-path");
    let long = format!("/v1/spaces/{}", "a".repeat(65));
    rig.send(Method::PUT, &long, JSON, "{}")
        .await
        .problem(400, "invalid-path");
}

#[tokio::test]
async fn parameters_that_cannot_be() {
    let rig = rig();
    for query in [
        "limit=-1",
        "limit=many",
        "limit=",
        "lim=1",
        "after=-1",
        "min_m=1,2",
        "min_m=1,2,3,4",
        "max_m=a,b,c",
        "min_m=nan,0,0",
        "min_m=inf,0,0",
        "min_m=",
        "since_ns=1.5",
        "since_ns=9223372036854775808",
        "limit=1&limit=2",
    ] {
        let path = format!("/v1/spaces/lab/places?{query}");
        rig.get(&path).await.problem(400, "invalid-parameter");
    }
    // Stamps may be negative, counts not.
    for (query, told) in [
        ("since_ns=1.5", "since_ns: expected a whole number"),
        ("limit=-1", "limit: expected a whole number from 0 on"),
    ] {
        let path = format!("/v1/spaces/lab/places?{query}");
        let problem = rig.get(&path).await.problem(400, "invalid-parameter");
        assert_eq!(problem["detail"], told);
    }
    for path in [
        "/v1/spaces?x=1",
        "/v1/spaces/lab?x=1",
        "/healthz?x=1",
        "/readyz?x=1",
        "/metrics?x=1",
        "/v1/spaces/lab/agents?x=1",
        "/v1/spaces/lab/trips?x=1",
        "/v1/spaces/lab/landmarks?x=1",
        "/v1/spaces/lab/events?x=1",
        "/v1/spaces/lab/export?format=bmp",
    ] {
        rig.get(path).await.problem(400, "invalid-parameter");
    }
    rig.get("/v1/spaces/lab/export?format=tum")
        .await
        .problem(422, "invalid-query");
}

#[tokio::test]
async fn methods_that_a_path_does_not_take_are_told_those_that_it_takes() {
    let rig = rig();
    for (method, path, allowed) in [
        (Method::POST, "/v1/spaces", "GET,HEAD"),
        (Method::PATCH, "/v1/spaces/lab", "GET,HEAD,PUT,DELETE"),
        (Method::GET, "/v1/spaces/lab/recall", "POST"),
        (Method::TRACE, "/healthz", "GET,HEAD"),
        (Method::DELETE, "/openapi.json", "GET,HEAD"),
    ] {
        let request = Request::builder()
            .method(method)
            .uri(path)
            .body(Body::empty());
        let answer = rig.ask(request.expect("a request")).await;
        answer.problem(405, "method-not-allowed");
        assert_eq!(answer.header("allow"), allowed, "{path}");
    }
}

#[tokio::test]
#[expect(clippy::too_many_lines, reason = "a table: a row for each body")]
async fn bodies_that_cannot_be_read() {
    let rig = rig();
    let recall = "/v1/spaces/lab/recall";
    let samples = "/v1/spaces/lab/agents/rover/samples";
    for path in [recall, samples] {
        for media_type in ["text/plain", "application/xml"] {
            let answer = rig.send(Method::POST, path, media_type, "{}").await;
            answer.problem(415, "unsupported-media-type");
        }
        for body in [
            "",
            "{",
            "[]",
            "null",
            "{\"session\": true}",
            "{\"limit\": -1}",
            "\u{7f}",
        ] {
            rig.send(Method::POST, path, JSON, body)
                .await
                .problem(400, "malformed-body");
        }
        let long = vec![b' '; MESSAGE_BYTES_MAX + 1];
        rig.send(Method::POST, path, JSON, long)
            .await
            .problem(413, "body-too-long");
    }
    let cbor = rig
        .send(Method::POST, recall, "application/cbor", vec![0xa0])
        .await;
    cbor.problem(415, "unsupported-media-type");
    let v2 = "application/vnd.cogmap.postcard;v2";
    rig.send(Method::POST, samples, v2, vec![0])
        .await
        .problem(415, "unsupported-media-type");
    let unknown = rig
        .send(Method::POST, recall, JSON, "{\"positon_m\": [0, 0, 0]}")
        .await;
    let problem = unknown.problem(400, "malformed-body");
    assert!(
        problem["detail"]
            .as_str()
            .is_some_and(|detail| detail.contains("positon_m"))
    );
    for settings in [
        "[]",
        "[1]",
        "{\"odometry_noise\": []}",
        "{\"recruitment\": {\"novelty\": []}}",
    ] {
        let answer = rig
            .send(Method::PUT, "/v1/spaces/new", JSON, settings)
            .await;
        answer.problem(400, "malformed-body");
    }
    let empty = SampleBatch {
        samples: Vec::new(),
        ..steps(1, 0, 1)
    };
    rig.samples("rover", &empty)
        .await
        .problem(422, "invalid-query");
    rig.samples(
        "rover",
        &SampleBatch {
            first_seq: u64::MAX,
            ..steps(1, 0, 1)
        },
    )
    .await
    .problem(422, "invalid-query");
}

#[tokio::test]
async fn bodies_that_make_no_sense() {
    let rig = rig();
    for (body, part) in [
        ("{\"radius_m\": 1}", "position_m"),
        ("{\"position_m\": [0, 0, 1e9]}", "position_m"),
        ("{\"position_m\": [0, 0, 0], \"radius_m\": -1}", "radius_m"),
        ("{\"limit\": 0}", "limit"),
        ("{\"limit\": 1001}", "limit"),
        ("{\"since_ns\": 2, \"until_ns\": 1}", "since_ns 2"),
        ("{\"code\": [[0.5, 0.5, 0.5]]}", "modules"),
        ("{\"code\": [[1, 0, 0], null, null, null, null]}", "phases"),
        ("{\"agent\": \"a b\"}", "agent"),
    ] {
        let answer = rig
            .send(Method::POST, "/v1/spaces/lab/recall", JSON, body)
            .await;
        let problem = answer.problem(422, "invalid-query");
        assert!(
            problem["detail"].as_str().is_some_and(|d| d.contains(part)),
            "{body}: {problem}"
        );
    }
    let lost = "{\"localized_sd_m\": 2, \"lost_sd_m\": 1}";
    let answer = rig.send(Method::PUT, "/v1/spaces/new", JSON, lost).await;
    let problem = answer.problem(422, "invalid-settings");
    assert!(
        problem["detail"]
            .as_str()
            .is_some_and(|detail| detail.contains("lost_sd_m"))
    );
}

#[tokio::test]
async fn samples_out_of_order_are_told_what_is_next() {
    let rig = rig();
    let gap = rig
        .samples("rover", &steps(5, 3, 2))
        .await
        .problem(409, "sequence-gap");
    assert_eq!(
        (&gap["session"], &gap["expected_seq"]),
        (&5.into(), &0.into()),
        "{gap}"
    );
    rig.samples("rover", &steps(5, 0, 4)).await.good();
    let gap = rig
        .samples("rover", &steps(5, 9, 2))
        .await
        .problem(409, "sequence-gap");
    assert_eq!(gap["expected_seq"], 4, "{gap}");
    let stale = rig
        .samples("rover", &steps(4, 0, 1))
        .await
        .problem(409, "stale-session");
    assert_eq!(stale["session"], 5, "{stale}");
}

#[tokio::test]
async fn a_refusal_says_what_is_there_and_what_is_wanted() {
    let rig = rig();
    let mut batch = steps(1, 0, 2);
    if let SampleBody::Increment(increment) = &mut batch.samples[1].body {
        increment.rotation_xyzw = [0.0; 4];
    }
    let answer = rig.samples("rover", &batch).await.good();
    let refused = "samples[1].body.increment.rotation_xyzw [0.0, 0.0, 0.0, 0.0]: \
        must be a unit quaternion [x, y, z, w]";
    assert_eq!(answer["refused"], serde_json::json!([refused]));
    let behind = "{\"session\": 1, \"first_seq\": 2, \"samples\": [{\"stamp_ns\": 9, \"body\": \
        {\"sighting\": {\"target\": {\"landmark\": \"door\"}, \"relation\": \
        {\"range\": {\"range_m\": -1, \"range_sd_m\": 0.1}}}}}]}";
    let samples = "/v1/spaces/lab/agents/rover/samples";
    let answer = rig.send(Method::POST, samples, JSON, behind).await.good();
    let refused = answer["refused"][0].as_str().expect("a refusal");
    assert!(
        refused.starts_with("samples[0].body.sighting.relation {\"range\":{\"range_m\":-1.0")
            && refused.ends_with("of at most 1e8, and no negative range"),
        "{refused}"
    );
    let path = "/v1/spaces/new";
    rig.send(Method::PUT, path, JSON, "{\"seed\": 7}").await;
    let other = rig.send(Method::PUT, path, JSON, "{\"seed\": 8}").await;
    let detail = other.problem(409, "other-settings")["detail"].to_string();
    assert!(detail.contains("seed is 7, not 8"), "{detail}");
}

#[tokio::test]
async fn a_memory_that_is_not_there_is_called_by_its_name() {
    let rig = rig();
    for (path, unknown) in [
        ("places/7", "the space has no place 7"),
        ("trips/8", "the space has no trip 8"),
        ("trips/8/pin", "the space has no trip 8"),
        ("landmarks/post", "the space has no landmark \"post\""),
        ("objects/cup", "the space has no object \"cup\""),
        ("objects/%1B", "the space has no object \"\\u{1b}\""),
    ] {
        let request = match path {
            "trips/8/pin" => Request::put(format!("/v1/spaces/lab/{path}")),
            _ => Request::get(format!("/v1/spaces/lab/{path}")),
        };
        let request = request.body(Body::empty()).expect("a request");
        let problem = rig.ask(request).await.problem(404, "unknown-memory");
        assert_eq!(problem["detail"], unknown);
    }
}

#[tokio::test]
async fn bounds_of_the_engine_are_conflicts() {
    let engine = EngineSettings {
        agents_max: 1,
        spaces_max: 1,
        ..EngineSettings::default()
    };
    let rig = rig_with(&settings(), engine);
    rig.samples("one", &steps(1, 0, 1)).await.good();
    rig.samples("two", &steps(1, 0, 1))
        .await
        .problem(409, "too-many-agents");
    let answer = rig.send(Method::PUT, "/v1/spaces/more", JSON, "{}").await;
    answer.problem(409, "too-many-spaces");
}
