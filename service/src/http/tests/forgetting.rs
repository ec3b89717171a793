//! What a space that has forgotten something still tells, and what no longer.

use super::*;

const JSON: &str = "application/json";

/// A rig with the space `small`, in which a rover has gone far beyond the budgets.
async fn far_gone() -> Rig {
    let rig = rig();
    let settings = "{\"places_max\": 300, \"legs_max\": 40, \"strength_half_life_samples\": 100}";
    let created = rig
        .send(Method::PUT, "/v1/spaces/small", JSON, settings)
        .await;
    created.good();
    let path = "/v1/spaces/small/agents/rover/samples";
    let batch = Codec::Json.encode(&steps(1, 0, 1400));
    rig.send(Method::POST, path, JSON, batch).await.good();
    rig
}

#[tokio::test]
async fn what_is_forgotten_is_gone_and_not_unknown() {
    let rig = far_gone().await;
    let info = rig.get("/v1/spaces/small").await.good();
    assert_eq!(info["places"], 300);
    rig.get("/v1/spaces/small/places/0")
        .await
        .problem(410, "forgotten-memory");
    rig.get("/v1/spaces/small/trips/0")
        .await
        .problem(410, "forgotten-memory");
    rig.get("/v1/spaces/small/places/4000")
        .await
        .problem(404, "unknown-memory");
}

#[tokio::test]
async fn pages_and_exports_hold_what_is_left() {
    let rig = far_gone().await;
    let page = rig.get("/v1/spaces/small/places?limit=1000").await.good();
    let places = page["places"].as_array().expect("places");
    assert_eq!(places.len(), 300);
    let first = places[0]["id"].as_u64().expect("a number");
    assert!(first > 50, "the oldest have gone: {first}");
    for (place, id) in places.iter().zip(first..) {
        assert_eq!(place["id"], id);
        let strength = place["strength"].as_f64().expect("a number");
        assert!(0.0 < strength && strength <= 1.0, "{place}");
    }
    let next = rig
        .get("/v1/spaces/small/places?limit=5&after=3")
        .await
        .good();
    assert_eq!(next["places"][0]["id"], first);
    let export = rig.get("/v1/spaces/small/export").await.good();
    assert_eq!(export["places"], page["places"]);
    let trips = export["trips"].as_array().expect("trips");
    let legs = |trip: &Value| trip["legs"].as_array().map_or(0, Vec::len);
    let legs: usize = trips.iter().map(legs).sum();
    assert!(0 < legs && legs <= 40, "{legs}");
    let cloud = rig.get("/v1/spaces/small/export?format=ply").await;
    assert!(cloud.text().contains("element vertex 300\n"));
    let vertices = cloud.text().split("end_header\n").nth(1);
    assert_eq!(vertices.map(|lines| lines.lines().count()), Some(300));
}
