//! Agents are removed, and sessions of the future refused.

use super::*;

impl Rig {
    async fn delete(&self, path: &str) -> Answer {
        let request = Request::delete(path).body(Body::empty());
        self.ask(request.expect("a request")).await
    }
}

#[tokio::test]
async fn a_removed_agent_is_told_from_an_unknown_one_and_its_name_is_free() {
    let rig = rig();
    rig.samples("rover", &steps(7, 0, 30)).await.good();
    let path = "/v1/spaces/lab/agents/rover";
    assert_eq!(rig.delete(path).await.status, 204);
    let gone = rig.get(path).await.problem(410, "removed-agent");
    assert!(
        gone["detail"]
            .as_str()
            .is_some_and(|text| text.contains("rover"))
    );
    rig.delete(path).await.problem(410, "removed-agent");
    rig.delete("/v1/spaces/lab/agents/nobody")
        .await
        .problem(404, "unknown-agent");
    rig.delete("/v1/spaces/void/agents/rover")
        .await
        .problem(404, "unknown-space");
    let agents = rig.get("/v1/spaces/lab/agents").await.good();
    assert_eq!(agents["agents"].as_array().map(Vec::len), Some(0));
    assert_eq!(rig.get("/v1/spaces/lab").await.good()["agents"], 0);
    // Its past stays: places with their founder, and its way by the session's number.
    let places = rig.get("/v1/spaces/lab/places").await.good();
    assert_eq!(places["places"][0]["founder"], "rover");
    let recalled = rig
        .send(
            Method::POST,
            "/v1/spaces/lab/recall",
            "application/json",
            r#"{"agent": "rover"}"#,
        )
        .await
        .good();
    assert!(
        recalled["places"]
            .as_array()
            .is_some_and(|places| !places.is_empty())
    );
    let trips = rig.get("/v1/spaces/lab/trips?agent=rover").await.good();
    assert_eq!(trips["trips"][0]["agent"], "rover");
    let tum = "/v1/spaces/lab/export?format=tum&agent=rover";
    rig.get(tum).await.problem(410, "removed-agent");
    assert_eq!(rig.get(&format!("{tum}&session=7")).await.status, 200);
    rig.get(&format!("{path}/trajectory"))
        .await
        .problem(410, "removed-agent");
    let way = rig
        .get(&format!("{path}/trajectory?session=7"))
        .await
        .good();
    assert!(
        way["poses"]
            .as_array()
            .is_some_and(|poses| poses.len() > 10)
    );
    // A smaller session than before: another agent.
    let answer = rig.samples("rover", &steps(1, 0, 2)).await.good();
    assert_eq!(answer["watermark"]["session"], 1);
    assert_eq!(rig.get(path).await.good()["watermark"]["durable"], 2);
}

#[tokio::test]
async fn a_session_of_the_future_is_refused_by_name() {
    let rig = rig();
    let problem = rig.samples("rover", &steps(u64::MAX - 1, 0, 2)).await;
    let problem = problem.problem(422, "session-in-future");
    assert!(
        problem["detail"]
            .as_str()
            .is_some_and(|text| text.contains("Unix time"))
    );
    rig.get("/v1/spaces/lab/agents/rover")
        .await
        .problem(404, "unknown-agent");
    rig.samples("rover", &steps(1, 0, 2)).await.good();
}

#[tokio::test]
async fn requests_for_other_hosts_are_refused_but_for_health() {
    let rig = rig();
    let ask = async |method: Method, path: &str, headers: &[(&str, &str)]| {
        let mut request = Request::builder().method(method).uri(path);
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        rig.ask(request.body(Body::empty()).expect("a request"))
            .await
    };
    let rebound = [("host", "evil.example:8080")];
    for path in ["/v1/spaces", "/", "/metrics", "/v1/spaces/lab"] {
        let answer = ask(Method::GET, path, &rebound).await;
        let problem = answer.problem(421, "unknown-host");
        assert!(
            problem["detail"]
                .as_str()
                .is_some_and(|text| text.contains("http.hosts"))
        );
    }
    for path in ["/healthz", "/readyz"] {
        assert_eq!(ask(Method::GET, path, &rebound).await.status, 200);
    }
    let foreign = [
        ("host", "127.0.0.1:8080"),
        ("origin", "http://evil.example"),
    ];
    let answer = ask(Method::DELETE, "/v1/spaces/lab", &foreign).await;
    answer.problem(403, "foreign-origin");
    let own = [
        ("host", "127.0.0.1:8080"),
        ("origin", "http://127.0.0.1:8080"),
    ];
    assert_eq!(
        ask(Method::DELETE, "/v1/spaces/lab", &own).await.status,
        204
    );
}
