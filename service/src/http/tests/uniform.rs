//! One mistake has one answer, wherever it is made.

use cogmap_proto::limits::LOCALIZE_SAMPLES_MAX;
use cogmap_proto::{Descriptor, Level, LocalizeQuery};

use super::*;

const JSON: &str = "application/json";
const FORM: &str = "application/x-www-form-urlencoded";

fn level(channel: &str) -> SampleBody {
    SampleBody::Level(Level {
        channel: channel.to_owned(),
        value: 1.0,
        offset_m: [0.0; 3],
        normal: None,
    })
}

async fn post(rig: &Rig, path: &str, body: &Value) -> Answer {
    let path = format!("/v1/spaces/lab/{path}");
    rig.send(Method::POST, &path, JSON, body.to_string()).await
}

/// A rover that has driven and felt something.
async fn driven() -> Rig {
    let rig = rig();
    rig.samples("rover", &steps(1, 0, 30)).await.good();
    rig.samples("rover", &at(1, 30, level("touch")))
        .await
        .good();
    rig
}

#[tokio::test]
async fn an_agent_that_is_not_there_is_unknown_wherever_it_is_named() {
    let rig = driven().await;
    for path in [
        "agents/nobody",
        "agents/nobody/grid",
        "agents/nobody/object",
        "agents/nobody/trajectory",
        "trips?agent=nobody",
        "events?agent=nobody",
        "export?format=tum&agent=nobody",
    ] {
        let answer = rig.get(&format!("/v1/spaces/lab/{path}")).await;
        let problem = answer.problem(404, "unknown-agent");
        let detail = problem["detail"].as_str().expect("a text");
        assert!(detail.contains("nobody"), "{path}: {detail}");
    }
    let query = serde_json::json!({ "agent": "nobody" });
    post(&rig, "recall", &query)
        .await
        .problem(404, "unknown-agent");
    // One that is there and has done nothing of the kind is no mistake.
    let trips = rig.get("/v1/spaces/lab/trips?agent=rover").await.good();
    assert!(trips["trips"].is_array());
}

#[tokio::test]
async fn a_name_that_nobody_can_have_breaks_the_same_rule_in_every_filter() {
    let rig = driven().await;
    for path in [
        "trips?agent=a%20b",
        "events?agent=a%20b",
        "export?format=tum&agent=a%20b",
    ] {
        let answer = rig.get(&format!("/v1/spaces/lab/{path}")).await;
        answer.problem(422, "invalid-query");
    }
    let query = serde_json::json!({ "agent": "a b" });
    post(&rig, "recall", &query)
        .await
        .problem(422, "invalid-query");
}

#[tokio::test]
async fn a_channel_that_is_not_there_is_unknown_wherever_it_is_named() {
    let rig = driven().await;
    let recall = |channel: &str| serde_json::json!({ "percept": level(channel) });
    post(&rig, "recall", &recall("touch")).await.good();
    post(&rig, "recall", &recall("tuch"))
        .await
        .problem(404, "unknown-channel");
    let still = serde_json::json!({
        "translation_m": [0, 0, 0], "rotation_xyzw": [0, 0, 0, 1]
    });
    let predict =
        |channel: &str| serde_json::json!({ "motion": { "increment": still }, "channel": channel });
    let path = "agents/rover/predict";
    post(&rig, path, &predict("touch")).await.good();
    post(&rig, path, &predict("tuch"))
        .await
        .problem(404, "unknown-channel");
    post(&rig, path, &predict("my nose"))
        .await
        .problem(422, "invalid-query");
    post(&rig, "recall", &recall("my nose"))
        .await
        .problem(422, "invalid-query");
}

#[tokio::test]
async fn names_of_channels_are_checked_as_documented_on_every_route() {
    let rig = driven().await;
    let vector = vec![1.0; 8];
    let seen = |channel: &str| {
        let channel = channel.to_owned();
        let vector = vector.clone();
        SampleBody::Descriptor(Descriptor { channel, vector })
    };
    let wrong = "my channel!";
    for (seq, body) in (31..).zip([level(wrong), seen(wrong)]) {
        let answer = rig.samples("rover", &at(1, seq, body)).await.good();
        let rejected = answer["watermark"]["rejected"].as_array().expect("a list");
        let last = rejected.last().expect("it is refused");
        assert_eq!(last["reason"], "invalid_label", "{answer}");
        // Samples that are refused in a row for one reason are one range.
        assert_eq!(last["range"]["to"], seq + 1, "{answer}");
    }
    let samples = serde_json::json!({ "samples": at(1, 0, level(wrong)).samples });
    post(&rig, "localize", &samples)
        .await
        .problem(422, "invalid-query");
    let contacts = serde_json::json!({ "contacts": [
        { "position_m": [0, 0, 0], "levels": [{ "channel": wrong, "value": 1 }] }
    ] });
    post(&rig, "objects/identify", &contacts)
        .await
        .problem(422, "invalid-query");
    let taught = rig
        .send(
            Method::PUT,
            "/v1/spaces/lab/objects/cup",
            JSON,
            contacts.to_string(),
        )
        .await;
    taught.problem(422, "invalid-query");
}

#[tokio::test]
async fn a_number_beyond_its_bounds_breaks_a_rule_in_the_path_and_in_the_body() {
    let rig = driven().await;
    for limit in [0, 1001] {
        for list in [
            "agents",
            "places",
            "trips",
            "landmarks",
            "objects",
            "agents/rover/trajectory",
        ] {
            let answer = rig
                .get(&format!("/v1/spaces/lab/{list}?limit={limit}"))
                .await;
            let problem = answer.problem(422, "invalid-query");
            let detail = problem["detail"].as_str().expect("a text");
            assert!(detail.contains(&format!("not {limit}")), "{list}: {detail}");
        }
        let query = serde_json::json!({ "limit": limit });
        let problem = post(&rig, "recall", &query)
            .await
            .problem(422, "invalid-query");
        let detail = problem["detail"].as_str().expect("a text");
        assert!(detail.contains(&format!("not {limit}")), "{detail}");
    }
    // Too few and too many samples are the same mistake in a batch and in a question.
    let marks = |count| vec![at(1, 0, end_of_trip()).samples[0].clone(); count];
    for count in [0, LOCALIZE_SAMPLES_MAX + 1] {
        let samples = marks(count);
        let query = Codec::Json.encode(&LocalizeQuery { samples });
        let answer = rig
            .send(Method::POST, "/v1/spaces/lab/localize", JSON, query)
            .await;
        answer.problem(422, "invalid-query");
        let batch = SampleBatch {
            session: 2,
            first_seq: 0,
            samples: marks(count),
        };
        rig.samples("rover", &batch)
            .await
            .problem(422, "invalid-query");
    }
}

#[tokio::test]
async fn a_body_that_cannot_be_read_is_refused_by_its_field_and_value() {
    let rig = driven().await;
    let cases = [
        (
            "recall",
            "{\"position_m\": [0, \"x\", 0]}",
            "position_m[1]",
            "\"x\"",
        ),
        (
            "recall",
            "{\"percept\": {\"level\": {\"channel\": 7}}}",
            "percept.level.channel",
            "7",
        ),
        (
            "agents/rover/samples",
            "{\"session\": 1, \"first_seq\": 0, \"samples\": [{\"stamp_ns\": 0, \"body\": \
             {\"level\": {\"channel\": \"touch\", \"value\": \"warm\"}}}]}",
            "samples[0].body.level.value",
            "\"warm\"",
        ),
        (
            "localize",
            "{\"samples\": [{\"stamp_ns\": \"now\", \"body\": {\"marker\": {\"label\": \"a\"}}}]}",
            "samples[0].stamp_ns",
            "\"now\"",
        ),
    ];
    for (path, body, field, value) in cases {
        let path = format!("/v1/spaces/lab/{path}");
        let answer = rig.send(Method::POST, &path, JSON, body).await;
        let problem = answer.problem(400, "malformed-body");
        let detail = problem["detail"].as_str().expect("a text");
        assert!(
            detail.contains(field) && detail.contains(value),
            "{path}: {detail}"
        );
    }
    let settings = "{\"odometry_noise\": {\"length_error_sd\": \"much\"}}";
    let answer = rig
        .send(Method::PUT, "/v1/spaces/new", JSON, settings)
        .await;
    let problem = answer.problem(400, "malformed-body");
    let detail = problem["detail"].as_str().expect("a text");
    assert!(
        detail.contains("odometry_noise.length_error_sd"),
        "{detail}"
    );
}

#[tokio::test]
async fn json_is_read_whatever_curl_calls_it() {
    let rig = driven().await;
    let path = "/v1/spaces/lab/recall";
    for media_type in [FORM, "application/X-WWW-form-urlencoded; charset=utf-8", ""] {
        rig.send(Method::POST, path, media_type, "{\"limit\": 1}")
            .await
            .good();
    }
    let unnamed = || Request::post(path).body(Body::from("{\"limit\": 1}"));
    rig.ask(unnamed().expect("a request")).await.good();
    let batch = Codec::Json.encode(&at(1, 31, end_of_trip()));
    let samples = "/v1/spaces/lab/agents/rover/samples";
    rig.send(Method::POST, samples, FORM, batch).await.good();
    let put = rig.send(Method::PUT, "/v1/spaces/new", FORM, "{\"seed\": 1}");
    assert_eq!(put.await.status, 201);
    // A form is none, and is refused as what it is.
    rig.send(Method::POST, path, FORM, "limit=1")
        .await
        .problem(400, "malformed-body");
    // A page of another origin could send these without being asked: it has to say that it is JSON,
    // and which page it is is asked first.
    for (header, value, status, kind) in [
        ("origin", "http://evil.test", 403, "foreign-origin"),
        (
            "sec-fetch-site",
            "cross-site",
            415,
            "unsupported-media-type",
        ),
    ] {
        for media_type in [Some(FORM), None] {
            let mut request = Request::post(path).header(header, value);
            if let Some(media_type) = media_type {
                request = request.header("content-type", media_type);
            }
            let request = request.body(Body::from("{\"limit\": 1}"));
            let answer = rig.ask(request.expect("a request")).await;
            answer.problem(status, kind);
        }
    }
}

#[tokio::test]
async fn parameters_of_another_form_are_refused_and_not_ignored() {
    let rig = driven().await;
    for query in [
        "agent=rover",
        "format=ply&agent=rover",
        "format=g2o&session=1",
        "encoding=binary",
        "format=tum&agent=rover&encoding=ascii",
        "format=g2o&since_revision=3",
        "format=ply&since_revision=3",
        "format=ply&encoding=ascii&since_revision=3",
    ] {
        let answer = rig.get(&format!("/v1/spaces/lab/export?{query}")).await;
        answer.problem(422, "invalid-query");
    }
}

#[tokio::test]
async fn a_body_that_breaks_a_rule_is_refused_by_its_field_and_value() {
    let rig = driven().await;
    let sample = |body: &str| format!("{{\"samples\": [{{\"stamp_ns\": 0, \"body\": {body}}}]}}");
    let turned = "{\"increment\": {\"translation_m\": [0, 0, 0], \"rotation_xyzw\": [0, 0, 0, 2]}}";
    let cases = [
        (
            "localize",
            sample(turned),
            "samples[0].body.increment.rotation_xyzw [0.0, 0.0, 0.0, 2.0]",
        ),
        (
            "localize",
            sample("{\"descriptor\": {\"channel\": \"view\", \"vector\": [1, 2]}}"),
            "samples[0].body.descriptor.vector of 2 numbers",
        ),
        (
            "localize",
            sample(
                "{\"velocity\": {\"linear_m_s\": [0, 0, 0], \"angular_rad_s\": [0, 0, 0], \
                \"duration_s\": -1}}",
            ),
            "samples[0].body.velocity.duration_s -1.0",
        ),
        (
            "agents/rover/predict",
            format!("{{\"motion\": {turned}}}"),
            "motion.increment.rotation_xyzw [0.0, 0.0, 0.0, 2.0]",
        ),
        (
            "objects/identify",
            "{\"contacts\": [{\"position_m\": [0, 0, 1e9]}]}".to_owned(),
            "contacts[0].position_m [0.0, 0.0, 1000000000.0]",
        ),
        (
            "objects/identify",
            "{\"contacts\": [{\"position_m\": [0, 0, 0]}], \"noise\": {\"level_sd\": -1}}"
                .to_owned(),
            "noise.level_sd -1.0",
        ),
        (
            "recall",
            "{\"percept\": {\"descriptor\": {\"channel\": \"view\", \"vector\": [1]}}}".to_owned(),
            "percept.descriptor.vector of 1 numbers",
        ),
    ];
    for (path, body, named) in cases {
        let path = format!("/v1/spaces/lab/{path}");
        let problem = rig.send(Method::POST, &path, JSON, body).await;
        let problem = problem.problem(422, "invalid-query");
        let detail = problem["detail"].as_str().expect("a text");
        assert!(detail.starts_with(named), "{path}: {detail}");
    }
}
