//! The index, and requests that lead nowhere.

use super::*;

#[tokio::test]
async fn the_index_names_what_there_is_and_every_address_in_it_leads_somewhere() {
    let rig = rig();
    let index = rig.get("/v1").await.good();
    assert_eq!(index["service"], "cogmap");
    assert_eq!(index["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(
        index["spaces"],
        serde_json::json!([{ "name": "lab", "href": "/v1/spaces/lab" }])
    );
    let links = index["links"].as_object().expect("links").values();
    let hrefs = links.chain([&index["spaces"][0]["href"]]);
    let hrefs: Vec<_> = hrefs.map(|href| href.as_str().expect("a text")).collect();
    assert!(hrefs.len() >= 6, "{hrefs:?}");
    for href in hrefs {
        let answer = rig.get(href).await;
        assert_eq!(answer.status, 200, "{href}");
    }
}

#[tokio::test]
async fn an_unknown_path_is_told_what_is_near_it() {
    let rig = rig();
    for (path, near) in [
        ("/v1/space", "/v1/spaces"),
        ("/v1/spaces/lab/agent", "/v1/spaces/lab/agents"),
        (
            "/v1/spaces/lab/agents/ada/trajektory",
            "/v1/spaces/lab/agents/ada/trajectory",
        ),
        ("/v1/spaces/lab/recal", "/v1/spaces/lab/recall"),
        ("/spaces/lab/places", "/v1/spaces/lab/places"),
        ("/health", "/healthz"),
        ("/openapi.jsn", "/openapi.json"),
    ] {
        let problem = rig.get(path).await.problem(404, "unknown-route");
        let detail = problem["detail"].as_str().expect("a text");
        let named = detail.split("near it: ").nth(1).unwrap_or_default();
        assert_eq!(named.split(", ").next(), Some(near), "{path}: {detail}");
    }
    let far = rig
        .get("/some/where/else")
        .await
        .problem(404, "unknown-route");
    let detail = far["detail"].as_str().expect("a text");
    assert!(
        detail.contains("/docs/") && !detail.contains("near"),
        "{detail}"
    );
    let long = format!("/{}", "a".repeat(4000));
    rig.get(&long).await.problem(404, "unknown-route");
}

#[tokio::test]
async fn a_slash_at_the_end_leads_to_the_same_path_without_it() {
    let rig = rig();
    for (path, there) in [
        ("/v1/", "/v1"),
        ("/v1/spaces/", "/v1/spaces"),
        (
            "/v1/spaces/lab/places/?limit=3",
            "/v1/spaces/lab/places?limit=3",
        ),
        ("/healthz/", "/healthz"),
    ] {
        let answer = rig.get(path).await;
        assert_eq!(
            (answer.status.as_u16(), answer.header("location")),
            (308, there)
        );
    }
    let posted = rig.send(
        Method::POST,
        "/v1/spaces/lab/recall/",
        "application/json",
        "{}",
    );
    let posted = posted.await;
    assert_eq!(
        (posted.status.as_u16(), posted.header("location")),
        (308, "/v1/spaces/lab/recall")
    );
    rig.get("/nowhere/").await.problem(404, "unknown-route");
    rig.get("//").await.problem(404, "unknown-route");
    assert_eq!(rig.get("/docs/").await.status, 200);
}

#[tokio::test]
async fn options_and_head_are_answered() {
    let rig = rig();
    for (path, allowed) in [
        ("/v1", "GET,HEAD"),
        ("/v1/spaces/lab", "GET,HEAD,PUT,DELETE"),
        ("/v1/spaces/lab/recall", "POST"),
    ] {
        let request = Request::options(path).body(Body::empty());
        let answer = rig.ask(request.expect("a request")).await;
        assert_eq!(
            (answer.status.as_u16(), answer.header("allow")),
            (204, allowed)
        );
        assert!(answer.body.is_empty());
    }
    for path in ["/v1", "/v1/spaces/lab", "/healthz", "/openapi.json"] {
        let request = Request::head(path).body(Body::empty());
        let response = rig.router.clone().oneshot(request.expect("a request"));
        let response = response.await.expect("infallible");
        assert_eq!(response.status(), 200, "{path}");
        let body = to_bytes(response.into_body(), usize::MAX).await;
        assert!(body.expect("the body ends well").is_empty(), "{path}");
    }
}

#[tokio::test]
async fn every_problem_that_an_answer_can_be_is_in_the_description() {
    let openapi = openapi(false);
    let kinds = &openapi["components"]["schemas"]["Problem"]["properties"]["type"]["enum"];
    let kinds: Vec<_> = kinds.as_array().expect("a list").iter().collect();
    assert_eq!(kinds.len(), Kind::ALL.len());
    for kind in Kind::ALL {
        let name = format!("/problems/{}", kind.name());
        assert!(kinds.iter().any(|known| **known == *name), "{name}");
    }
}

#[tokio::test]
async fn every_example_of_a_body_is_taken() {
    let rig = rig();
    rig.samples("ada", &steps(1, 0, 30)).await.good();
    let level = SampleBody::Level(cogmap_proto::Level {
        channel: "touch".to_owned(),
        value: 0.5,
        offset_m: [0.0; 3],
        normal: None,
    });
    rig.samples("ada", &at(1, 30, level)).await.good();
    let openapi = openapi(false);
    let mut asked = 0;
    for (path, item) in openapi["paths"].as_object().expect("paths") {
        for (method, operation) in item.as_object().expect("operations") {
            assert!(operation["operationId"].is_string(), "{method} {path}");
            let Some(body) = operation.get("requestBody") else {
                continue;
            };
            let example = &body["content"]["application/json"]["example"];
            assert!(example.is_object(), "{method} {path} has no example");
            let path = path
                .replace(
                    "{space}",
                    if method == "put" && path.ends_with("{space}") {
                        "new"
                    } else {
                        "lab"
                    },
                )
                .replace("{agent}", "ada")
                .replace("{name}", "cup");
            let method: Method = method.to_ascii_uppercase().parse().expect("a method");
            let answer = rig
                .send(method, &path, "application/json", example.to_string())
                .await;
            assert!(answer.status.is_success(), "{path}: {answer:?}");
            asked += 1;
        }
    }
    assert_eq!(asked, 12, "operations with a body");
}
