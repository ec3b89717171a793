//! What the interface answers when all is well.

use cogmap_proto::limits::PAGE_ITEMS_MAX;
use pose_graph::g2o::G2oGraph;

use super::*;

const JSON: &str = "application/json";

/// A rig whose rover has gone five metres, seen two posts, and ended its trip.
pub(super) async fn travelled() -> Rig {
    let rig = rig();
    rig.samples("rover", &steps(1, 0, 50)).await.good();
    rig.samples("rover", &at(1, 50, post_ahead("post/b")))
        .await
        .good();
    rig.samples("rover", &at(1, 51, post_ahead("post a")))
        .await
        .good();
    rig.samples("rover", &at(1, 52, end_of_trip())).await.good();
    rig
}

#[tokio::test]
async fn a_space_is_created_once_found_again_and_deleted() {
    let rig = rig();
    let path = "/v1/spaces/new";
    let created = rig.send(Method::PUT, path, JSON, "{\"seed\": 7}").await;
    assert_eq!(
        (created.status.as_u16(), created.header("location")),
        (201, path)
    );
    let info = created.good();
    assert_eq!(
        (&info["name"], &info["settings"]["seed"]),
        (&"new".into(), &7.into())
    );
    assert_eq!(
        info["settings"]["grid_modules"], 6,
        "the other fields have their defaults"
    );
    assert!(
        info["digest"]
            .as_str()
            .is_some_and(|digest| digest.len() >= 16),
        "{info}"
    );
    assert_eq!(
        rig.send(Method::PUT, path, JSON, "{\"seed\": 7}")
            .await
            .status,
        200
    );
    let other = rig.send(Method::PUT, path, JSON, "{\"seed\": 8}").await;
    other.problem(409, "other-settings");
    let names = rig.get("/v1/spaces").await.good();
    assert_eq!(
        (&names["spaces"][0]["name"], &names["spaces"][1]["name"]),
        (&"lab".into(), &"new".into())
    );
    let gone = Request::delete(path)
        .body(Body::empty())
        .expect("a request");
    assert_eq!(rig.ask(gone).await.status, 204);
    rig.get(path).await.problem(404, "unknown-space");
}

#[tokio::test]
async fn a_space_without_a_body_has_the_default_settings() {
    let rig = rig();
    let bare = Request::put("/v1/spaces/bare")
        .body(Body::empty())
        .expect("a request");
    let info = rig.ask(bare).await.good();
    let settings: SpaceSettings =
        serde_json::from_value(info["settings"].clone()).expect("settings");
    assert_eq!(settings, SpaceSettings::default());
    let spaces = rig.send(Method::PUT, "/v1/spaces/typed", JSON, "").await;
    assert_eq!(spaces.status, 201, "an empty body of any type is no body");
}

#[tokio::test]
async fn samples_come_in_every_codec_and_are_answered_when_durable() {
    let rig = rig();
    let path = "/v1/spaces/lab/agents/rover/samples";
    for (first, codec) in [(0, Codec::Json), (10, Codec::Cbor), (20, Codec::Postcard)] {
        let body = codec.encode(&steps(1, first, 10));
        let answer = rig
            .send(Method::POST, path, codec.encoding(), body)
            .await
            .good();
        assert_eq!(answer["watermark"]["durable"], first + 10, "{answer}");
        assert_eq!(answer["duplicates"], 0);
    }
    let again = rig.samples("rover", &steps(1, 25, 10)).await.good();
    assert_eq!(
        (&again["duplicates"], &again["watermark"]["durable"]),
        (&5.into(), &35.into())
    );
}

#[tokio::test]
async fn an_agent_is_where_it_went() {
    let rig = travelled().await;
    let agent = rig.get("/v1/spaces/lab/agents/rover").await.good();
    let x = agent["estimate"]["translation_m"][0]
        .as_f64()
        .expect("a number");
    assert!((x - 5.0).abs() < 1e-9, "{agent}");
    assert_eq!(agent["watermark"]["durable"], 53);
    let page = rig.get("/v1/spaces/lab/agents").await.good();
    assert_eq!(
        (&page["agents"][0]["name"], &page["next"]),
        (&"rover".into(), &Value::Null)
    );
    let grid = rig.get("/v1/spaces/lab/agents/rover/grid").await.good();
    assert_eq!(grid["modules"].as_array().map(Vec::len), Some(6));
    assert!(
        (grid["decoded_m"][0].as_f64().expect("a number") - 5.0).abs() < 1e-6,
        "{grid}"
    );
}

#[tokio::test]
async fn agents_are_paged_by_name() {
    let rig = rig();
    for name in ["c", "a", "b"] {
        rig.samples(name, &steps(1, 0, 1)).await.good();
    }
    let page = rig.get("/v1/spaces/lab/agents?limit=2").await.good();
    assert_eq!(
        (&page["agents"][0]["name"], &page["next"]),
        (&"a".into(), &"b".into())
    );
    let page = rig
        .get("/v1/spaces/lab/agents?limit=2&after=b")
        .await
        .good();
    assert_eq!(
        (&page["agents"][0]["name"], &page["next"]),
        (&"c".into(), &Value::Null)
    );
}

#[tokio::test]
async fn places_are_paged_and_filtered_by_box_and_stamp() {
    let rig = travelled().await;
    let all = rig.get("/v1/spaces/lab/places?limit=1000").await.good();
    let all = all["places"].as_array().expect("places").clone();
    assert!(all.len() > 5, "{} places", all.len());
    let mut paged = Vec::new();
    let mut after = String::new();
    loop {
        let page = rig
            .get(&format!("/v1/spaces/lab/places?limit=3{after}"))
            .await
            .good();
        paged.extend(page["places"].as_array().expect("places").clone());
        match page["next"].as_u64() {
            Some(next) => after = format!("&after={next}"),
            None => break,
        }
    }
    assert_eq!(paged, all);
    let boxed = rig
        .get("/v1/spaces/lab/places?min_m=1.05,-1,-1&max_m=2.55,1e0,1")
        .await
        .good();
    let boxed = boxed["places"].as_array().expect("places");
    let x = |place: &Value| place["translation_m"][0].as_f64().expect("a number");
    let expected: Vec<_> = all
        .iter()
        .filter(|place| (1.05..=2.55).contains(&x(place)))
        .cloned()
        .collect();
    assert!(!expected.is_empty());
    assert_eq!(*boxed, expected);
    let late = rig
        .get("/v1/spaces/lab/places?since_ns=3000000000")
        .await
        .good();
    let late = late["places"].as_array().expect("places");
    assert!(!late.is_empty() && late.len() < all.len());
    let one = rig.get("/v1/spaces/lab/places/2").await.good();
    assert_eq!(one, all[2]);
    let after_all = rig
        .get("/v1/spaces/lab/places?after=18446744073709551615")
        .await
        .good();
    assert_eq!(after_all["places"], serde_json::json!([]));
}

#[tokio::test]
async fn trips_and_landmarks_are_remembered() {
    let rig = travelled().await;
    let trips = rig.get("/v1/spaces/lab/trips").await.good();
    assert_eq!(trips["trips"].as_array().map(Vec::len), Some(1));
    assert_eq!(
        (&trips["trips"][0]["agent"], &trips["trips"][0]["ended"]),
        (&"rover".into(), &"marker".into())
    );
    let trip = rig.get("/v1/spaces/lab/trips/0").await.good();
    assert_eq!(trip["trip"], trips["trips"][0]);
    assert_eq!(
        trip["legs"].as_array().map(|legs| legs.len() as u64),
        trip["trip"]["leg_count"].as_u64()
    );
    rig.get("/v1/spaces/lab/trips?agent=nobody")
        .await
        .problem(404, "unknown-agent");
    assert_eq!(
        rig.get("/v1/spaces/lab/trips?agent=rover").await.good(),
        trips
    );
    let later = rig
        .get("/v1/spaces/lab/trips?since_ns=60000000000")
        .await
        .good();
    assert_eq!(later["trips"], serde_json::json!([]));

    let page = rig.get("/v1/spaces/lab/landmarks?limit=1").await.good();
    assert_eq!(
        (&page["landmarks"][0]["id"], &page["next"]),
        (&"post a".into(), &"post a".into())
    );
    let page = rig
        .get("/v1/spaces/lab/landmarks?limit=1&after=post%20a")
        .await
        .good();
    assert_eq!(
        (&page["landmarks"][0]["id"], &page["next"]),
        (&"post/b".into(), &Value::Null)
    );
    let one = rig.get("/v1/spaces/lab/landmarks/post%2Fb").await.good();
    assert_eq!(one, page["landmarks"][0]);
}

#[tokio::test]
async fn recall_answers_by_position() {
    let rig = travelled().await;
    let query = "{\"position_m\": [2, 0, 0], \"limit\": 2}";
    let answer = rig
        .send(Method::POST, "/v1/spaces/lab/recall", JSON, query)
        .await
        .good();
    let places = answer["places"].as_array().expect("places");
    assert_eq!(places.len(), 2);
    assert!(
        places[0]["distance_m"].as_f64() <= places[1]["distance_m"].as_f64(),
        "{answer}"
    );
}

#[tokio::test]
async fn matches_with_samples_that_nobody_remembers_are_counted() {
    let rig = travelled().await;
    let seen_again = |seq| {
        SampleBody::Sighting(Sighting {
            target: Target::OwnSample(seq),
            relation: Relation::Position {
                translation_m: [0.1, 0.0, 0.0],
                sd_m: [0.1; 3],
            },
        })
    };
    for (seq, target, forgotten) in [(53, 20, 0), (54, 1_000_000, 1), (55, 2_000_000, 2)] {
        let sighting = at(1, seq, seen_again(target));
        rig.samples("rover", &sighting).await.good();
        let agent = rig.get("/v1/spaces/lab/agents/rover").await.good();
        assert_eq!(agent["forgotten_matches"], forgotten, "{agent}");
    }
}

#[tokio::test]
async fn exports_hold_everything() {
    let rig = travelled().await;
    let export = rig.get("/v1/spaces/lab/export").await;
    assert_eq!(
        export.header("content-disposition"),
        "attachment; filename=\"lab.json\""
    );
    let export = export.good();
    assert_eq!(export["space"], rig.get("/v1/spaces/lab").await.good());
    let places = rig.get("/v1/spaces/lab/places?limit=1000").await.good();
    assert_eq!(export["places"], places["places"]);
    let trip = rig.get("/v1/spaces/lab/trips/0").await.good();
    assert_eq!(export["trips"][0], trip);
    let mut agents = rig.get("/v1/spaces/lab/agents").await.good()["agents"].take();
    for agent in agents.as_array_mut().expect("a list") {
        agent["heard_ago_s"] = Value::Null; // that is of the moment
    }
    assert_eq!(export["agents"], agents);
    // One chain of places.
    let ways = export["ways"].as_array().expect("ways");
    assert_eq!(
        Some(ways.len() + 1),
        export["places"].as_array().map(Vec::len)
    );
    for way in ways {
        assert_eq!(
            (&way["there"]["times"], &way["back"]["times"]),
            (&1.into(), &0.into())
        );
        assert_eq!(way["disagrees"], false);
    }
    let ids = [&export["landmarks"][0]["id"], &export["landmarks"][1]["id"]];
    assert_eq!(ids, ["post/b", "post a"]);

    let cloud = rig.get("/v1/spaces/lab/export?format=ply").await;
    let count = places["places"].as_array().map_or(0, Vec::len);
    assert!(
        cloud.text().contains(&format!("element vertex {count}\n")),
        "{}",
        cloud.text()
    );
    let (_, lines) = cloud.text().split_once("end_header\n").expect("a header");
    assert_eq!(lines.lines().count(), count);
    let tum = rig
        .get("/v1/spaces/lab/export?format=tum&agent=rover")
        .await;
    assert_eq!(tum.text().lines().count(), 52);

    let g2o = rig.get("/v1/spaces/lab/export?format=g2o").await;
    assert_eq!(
        g2o.header("content-disposition"),
        "attachment; filename=\"lab.g2o\""
    );
    let graph = G2oGraph::read(g2o.text()).expect("the format");
    let way_m = { graph.edges().iter() }.map(|edge| edge.transform.translation.vector.norm());
    assert!((way_m.sum::<f64>() - 5.0).abs() < 1e-6, "{}", g2o.text());
    assert_eq!(graph.point_edges().len(), 2, "two posts were seen");
}

#[tokio::test]
async fn an_export_of_many_pages_joins_them() {
    let rig = rig();
    let count = PAGE_ITEMS_MAX as u64 + 500;
    rig.samples("rover", &steps(1, 0, count)).await.good();
    let tum = rig
        .get("/v1/spaces/lab/export?format=tum&agent=rover")
        .await;
    assert_eq!(tum.text().lines().count() as u64, count);
    let export = rig.get("/v1/spaces/lab/export").await.good();
    let places = export["places"].as_array().expect("places");
    assert!(
        places.len() > 256,
        "{} places are no two chunks",
        places.len()
    );
    assert!(
        places
            .iter()
            .enumerate()
            .all(|(at, place)| place["id"] == at)
    );
}

#[tokio::test]
async fn the_service_tells_of_its_health_and_metrics() {
    let rig = rig();
    assert_eq!(rig.get("/healthz").await.good()["status"], "ok");
    assert_eq!(rig.get("/readyz").await.good()["status"], "ok");
    let metrics = rig.get("/metrics").await;
    assert_eq!(
        metrics.header("content-type"),
        "text/plain; version=0.0.4; charset=utf-8"
    );
}

#[tokio::test]
async fn the_pages_need_no_other_host() {
    let rig = rig();
    let front = rig.get("/").await;
    assert_eq!(front.header("content-type"), "text/html; charset=utf-8");
    assert!(!front.text().contains("src=\"http") && !front.text().contains("href=\"http"));
    let docs = rig.get("/docs").await;
    assert_eq!(
        (docs.status.as_u16(), docs.header("location")),
        (303, "/docs/")
    );
    assert!(rig.get("/docs/").await.text().contains("swagger-ui"));
    assert_eq!(rig.get("/docs/swagger-ui.css").await.status, 200);
    let start = rig.get("/docs/swagger-initializer.js").await;
    assert!(start.text().contains("/openapi.json"), "{}", start.text());
}

/// Every reference in `value` must lead somewhere.
fn assert_references(root: &Value, value: &Value) {
    match value {
        Value::Object(object) => {
            if let Some(Value::String(reference)) = object.get("$ref") {
                let pointer = reference.strip_prefix('#').expect("within the document");
                assert!(root.pointer(pointer).is_some(), "{reference} leads nowhere");
            }
            object
                .values()
                .for_each(|below| assert_references(root, below));
        }
        Value::Array(items) => items
            .iter()
            .for_each(|below| assert_references(root, below)),
        _ => {}
    }
}

/// All operations, by method and path.
const OPERATIONS: [&str; 48] = [
    "DELETE /v1/spaces/{space}",
    "DELETE /v1/spaces/{space}/agents/{agent}",
    "DELETE /v1/spaces/{space}/agents/{agent}/route",
    "DELETE /v1/spaces/{space}/blockages/{id}",
    "DELETE /v1/spaces/{space}/objects/{name}",
    "DELETE /v1/spaces/{space}/trips/{id}/pin",
    "GET /healthz",
    "GET /metrics",
    "GET /readyz",
    "GET /v1",
    "GET /v1/cluster",
    "GET /v1/spaces",
    "GET /v1/spaces/{space}",
    "GET /v1/spaces/{space}/agents",
    "GET /v1/spaces/{space}/agents/{agent}",
    "GET /v1/spaces/{space}/agents/{agent}/at",
    "GET /v1/spaces/{space}/agents/{agent}/grid",
    "GET /v1/spaces/{space}/agents/{agent}/object",
    "GET /v1/spaces/{space}/agents/{agent}/route",
    "GET /v1/spaces/{space}/agents/{agent}/trajectory",
    "GET /v1/spaces/{space}/blockages",
    "GET /v1/spaces/{space}/channels",
    "GET /v1/spaces/{space}/events",
    "GET /v1/spaces/{space}/export",
    "GET /v1/spaces/{space}/landmarks",
    "GET /v1/spaces/{space}/landmarks/{id}",
    "GET /v1/spaces/{space}/live",
    "GET /v1/spaces/{space}/objects",
    "GET /v1/spaces/{space}/objects/{name}",
    "GET /v1/spaces/{space}/places",
    "GET /v1/spaces/{space}/places/{id}",
    "GET /v1/spaces/{space}/places/{id}/percepts",
    "GET /v1/spaces/{space}/routes",
    "GET /v1/spaces/{space}/trips",
    "GET /v1/spaces/{space}/trips/{id}",
    "POST /v1/spaces/{space}/agents/{agent}/predict",
    "POST /v1/spaces/{space}/agents/{agent}/samples",
    "POST /v1/spaces/{space}/blockages",
    "POST /v1/spaces/{space}/felt",
    "POST /v1/spaces/{space}/localize",
    "POST /v1/spaces/{space}/objects/identify",
    "POST /v1/spaces/{space}/recall",
    "POST /v1/spaces/{space}/route",
    "POST /v1/spaces/{space}/sequence",
    "PUT /v1/spaces/{space}",
    "PUT /v1/spaces/{space}/agents/{agent}/route",
    "PUT /v1/spaces/{space}/objects/{name}",
    "PUT /v1/spaces/{space}/trips/{id}/pin",
];

#[tokio::test]
async fn the_description_lists_every_route_with_every_status() {
    let described = rig().get("/openapi.json").await.good();
    assert_eq!(described["openapi"], "3.1.0");
    assert_references(&described, &described);
    let mut operations: Vec<String> = Vec::new();
    for (path, item) in described["paths"].as_object().expect("paths") {
        for (method, operation) in item.as_object().expect("operations") {
            operations.push(format!("{} {path}", method.to_uppercase()));
            let responses = operation["responses"].as_object().expect("responses");
            for status in ["400", "401", "405", "421", "500", "503", "504"] {
                let content = &responses[status]["content"];
                assert!(
                    content["application/problem+json"].is_object(),
                    "{path} {status}"
                );
            }
        }
    }
    operations.sort();
    assert_eq!(operations, OPERATIONS);
    let limit = &described["components"]["schemas"]["RecallQuery"]["properties"]["limit"];
    assert_eq!(
        (&limit["minimum"], &limit["maximum"]),
        (&1.into(), &1000.into()),
        "{limit}"
    );
}
