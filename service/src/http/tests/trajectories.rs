//! Where agents were, as it was known then and as it is known now.

use super::resources::travelled;
use super::*;

#[tokio::test]
async fn the_past_is_refined_for_who_asks() {
    let rig = travelled().await;
    let path = "/v1/spaces/lab/agents/rover/trajectory?kind=refined";
    let revision = rig.get("/v1/spaces/lab").await.good()["map_revision"].clone();
    let mut stamps = Vec::new();
    let mut from = String::new();
    loop {
        let page = rig.get(&format!("{path}&limit=5{from}")).await.good();
        assert_eq!(
            (&page["kind"], &page["map_revision"]),
            (&"refined".into(), &revision)
        );
        let poses = page["poses"].as_array().expect("poses");
        stamps.extend(
            poses
                .iter()
                .map(|pose| pose["stamp_ns"].as_i64().expect("a stamp")),
        );
        match page["next_from_ns"].as_i64() {
            Some(next) => from = format!("&from_ns={next}"),
            None => break,
        }
    }
    assert!(stamps.len() > 10 && stamps.is_sorted(), "{stamps:?}");
    let part = rig
        .get(&format!("{path}&from_ns=1000000000&to_ns=2000000000"))
        .await
        .good();
    let back = rig.get(&format!("{path}&from_ns=2&to_ns=1")).await;
    back.problem(422, "invalid-query");
    let part = part["poses"].as_array().expect("poses");
    assert!(!part.is_empty() && part.len() < stamps.len());
    let tum = rig.get(&format!("{path}&format=tum&limit=2")).await;
    assert_eq!(tum.text().lines().count(), 2);
    let next = tum.header("link").to_owned();
    assert!(
        next.contains("kind=refined") && !next.contains("session"),
        "{next}"
    );
    let of_session = rig.get(&format!("{path}&session=1")).await;
    assert_eq!(of_session.status, 422);
}

#[tokio::test]
async fn a_trajectory_comes_in_pages_as_json_and_as_tum() {
    let rig = travelled().await;
    let path = "/v1/spaces/lab/agents/rover/trajectory";
    let mut stamps = Vec::new();
    let mut from = String::new();
    loop {
        let page = rig.get(&format!("{path}?limit=20{from}")).await.good();
        assert_eq!(
            (&page["frame"], &page["kind"]),
            (&"map".into(), &"causal".into())
        );
        let poses = page["poses"].as_array().expect("poses");
        assert!(poses.len() <= 20);
        stamps.extend(
            poses
                .iter()
                .map(|pose| pose["stamp_ns"].as_i64().expect("a stamp")),
        );
        match page["next_from_ns"].as_i64() {
            Some(next) => from = format!("&from_ns={next}"),
            None => break,
        }
    }
    assert_eq!(
        stamps,
        (0..52).map(|step| step * 100_000_000).collect::<Vec<i64>>(),
        "fifty motions, and two sightings after them"
    );

    let tum = rig
        .get(&format!("{path}?format=tum&limit=2&from_ns=100000000"))
        .await;
    assert_eq!(tum.header("content-type"), "text/plain; charset=utf-8");
    let lines: Vec<_> = tum.text().lines().collect();
    assert_eq!(lines.len(), 2);
    assert!(lines[0].starts_with("0.100000000 0.2 0 0 "), "{lines:?}");
    let next = "?format=tum&limit=2&session=1&from_ns=300000000>; rel=\"next\"";
    assert_eq!(tum.header("link"), format!("<{path}{next}"));

    let request = Request::get(path).header("accept", "text/plain;q=0.9");
    let accepted = rig
        .ask(request.body(Body::empty()).expect("a request"))
        .await;
    assert_eq!(accepted.text().lines().count(), 52);
    let part = rig
        .get(&format!("{path}?from_ns=100000000&to_ns=300000000"))
        .await
        .good();
    assert_eq!(part["poses"].as_array().map(Vec::len), Some(2));
}
