//! Where samples were taken: found, not known, and not asked in a way that makes sense.

use cogmap_proto::{Descriptor, Level, Localization, LocalizeQuery, ObjectMark, StartPose, Status};

use super::*;

const PATH: &str = "/v1/spaces/lab/localize";
const JSON: &str = "application/json";
/// Where posts stand \[m\].
const POSTS_M: [[f64; 3]; 5] = [
    [0.0, 3.0, 0.5],
    [4.0, -2.0, 1.0],
    [8.0, 2.5, 0.0],
    [2.0, 1.0, 2.0],
    [6.0, -3.0, 1.5],
];

/// A post as it is seen from a body that stands here and is turned by a quarter to the left so many
/// times.
fn post(number: usize, from_m: [f64; 3], quarters: u8) -> SampleBody {
    let [x, y, z] = POSTS_M[number];
    let mut ahead = [x - from_m[0], y - from_m[1], z - from_m[2]];
    for _ in 0..quarters {
        ahead = [ahead[1], -ahead[0], ahead[2]];
    }
    SampleBody::Sighting(Sighting {
        target: Target::Landmark(format!("post {number}")),
        relation: Relation::Position {
            translation_m: ahead,
            sd_m: [0.02; 3],
        },
    })
}

/// A rig whose rover has gone eight metres along x, and seen all posts now and then.
async fn explored() -> Rig {
    let rig = rig();
    let mut batch = steps(1, 0, 80);
    let mut samples = Vec::new();
    for (step, sample) in (1..).zip(batch.samples.drain(..)) {
        let stamp_ns = sample.stamp_ns;
        samples.push(sample);
        if step % 8 == 0 {
            let here = [0.1 * f64::from(step), 0.0, 0.0];
            let seen = (0..POSTS_M.len()).map(|number| post(number, here, 0));
            samples.extend(seen.map(|body| Sample { stamp_ns, body }));
        }
    }
    batch.samples = samples;
    rig.samples("rover", &batch).await.good();
    rig
}

/// Half a metre, step by step, by a robot that set out here and looks along y; it sees posts after
/// each step.
fn walk(from_m: [f64; 3], posts: &[usize]) -> LocalizeQuery {
    let mut samples = Vec::new();
    for step in steps(1, 0, 5).samples {
        let stamp_ns = step.stamp_ns;
        samples.push(step);
        let moved = samples
            .iter()
            .filter(|sample| matches!(sample.body, SampleBody::Increment(_)));
        let way_m = 0.1 * moved.count() as f64;
        let here = [from_m[0], from_m[1] + way_m, from_m[2]];
        samples.extend(posts.iter().map(|&number| Sample {
            stamp_ns,
            body: post(number, here, 1),
        }));
    }
    LocalizeQuery { samples }
}

async fn localized(rig: &Rig, query: &LocalizeQuery) -> Localization {
    let answer = rig.send(Method::POST, PATH, JSON, Codec::Json.encode(query));
    serde_json::from_value(answer.await.good()).expect("the answer that is described")
}

#[tokio::test]
async fn samples_of_nobody_are_found_in_the_map_and_change_nothing() {
    let rig = explored().await;
    let before = rig.get("/v1/spaces/lab").await.good();
    let found = localized(&rig, &walk([5.0, -1.0, 0.0], &[0, 1, 2, 3, 4])).await;
    assert_eq!(found.status, Status::Localized, "{found:?}");
    assert_eq!(
        (
            found.space.as_str(),
            found.frame.as_str(),
            before["map_revision"].as_u64()
        ),
        ("lab", "map", Some(found.map_revision))
    );
    let pose = found.pose.expect("a pose");
    let off = [5.0, -0.5, 0.0];
    for (axis, (at, is)) in off.into_iter().zip(pose.translation_m).enumerate() {
        assert!((at - is).abs() < 0.1, "axis {axis}: {is} m, not {at} m");
    }
    // It looks along y: a quarter to the left.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    assert!(
        (pose.rotation_xyzw[2].abs() - half).abs() < 0.02,
        "{pose:?}"
    );
    assert!(pose.covariance[0] > 0.0);
    assert!(found.found_after.is_some_and(|index| index < 30));
    assert_eq!(rig.get("/v1/spaces/lab").await.good(), before);
    let agents = rig.get("/v1/spaces/lab/agents").await.good();
    assert_eq!(agents["agents"].as_array().map(Vec::len), Some(1));
}

#[tokio::test]
async fn what_the_map_does_not_know_is_found_nowhere() {
    let rig = explored().await;
    for posts in [&[][..], &[0], &[3, 1]] {
        let lost = localized(&rig, &walk([5.0, -1.0, 0.0], posts)).await;
        assert_eq!(
            (lost.status, lost.pose, lost.found_after),
            (Status::Lost, None, None)
        );
    }
    // A space in which nothing has happened has no frame to be found in.
    let empty = self::rig();
    let lost = localized(&empty, &walk([5.0, -1.0, 0.0], &[0, 1, 2])).await;
    assert_eq!((lost.status, lost.map_revision), (Status::Lost, 0));
}

#[tokio::test]
async fn samples_that_make_no_sense_here_are_refused_by_their_place_in_the_list() {
    let rig = explored().await;
    let sample = |stamp_ns, body| Sample { stamp_ns, body };
    let told = SampleBody::StartPose(StartPose {
        translation_m: [0.0; 3],
        rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
        noise: None,
    });
    let short = SampleBody::Descriptor(Descriptor {
        channel: "view".to_owned(),
        vector: vec![1.0; 2],
    });
    let felt = SampleBody::Level(Level {
        channel: "touch".to_owned(),
        value: 1.0,
        offset_m: [0.0; 3],
        normal: None,
    });
    let refused = [
        (sample(0, SampleBody::Object(ObjectMark::End {})), "object"),
        (sample(0, told), "start pose"),
        (sample(0, short), "descriptor"),
        (sample(-1, felt), "backwards"),
    ];
    for (second, why) in refused {
        let samples = vec![sample(0, end_of_trip()), second];
        let body = Codec::Json.encode(&LocalizeQuery { samples });
        let answer = rig.send(Method::POST, PATH, JSON, body).await;
        let problem = answer.problem(422, "invalid-query");
        let detail = problem["detail"].as_str().expect("a text");
        assert!(
            detail.starts_with("samples[1]") && detail.contains(why),
            "{detail}"
        );
    }
    let empty = rig
        .send(Method::POST, PATH, JSON, "{\"samples\": []}")
        .await;
    empty.problem(422, "invalid-query");
    let misspelt = rig.send(Method::POST, PATH, JSON, "{\"sample\": []}").await;
    misspelt.problem(400, "malformed-body");
    let nowhere = walk([0.0; 3], &[]);
    let nowhere = rig.send(
        Method::POST,
        "/v1/spaces/attic/localize",
        JSON,
        Codec::Json.encode(&nowhere),
    );
    nowhere.await.problem(404, "unknown-space");
}

#[tokio::test]
async fn more_than_there_is_room_for_are_told_to_come_back() {
    let rig = explored().await;
    let space = rig.engine.space("lab").expect("it is there");
    let taken: Vec<_> = std::iter::from_fn(|| space.question_room().enter().ok()).collect();
    assert!(!taken.is_empty());
    let query = walk([5.0, -1.0, 0.0], &[0, 1, 2]);
    let busy = rig
        .send(Method::POST, PATH, JSON, Codec::Json.encode(&query))
        .await;
    busy.problem(503, "busy");
    assert_eq!(busy.header("retry-after"), "1");
    let touched = r#"{"contacts":[{"position_m":[0.0,0.0,0.0]}]}"#;
    let identify = "/v1/spaces/lab/objects/identify";
    let busy = rig.send(Method::POST, identify, JSON, touched).await;
    busy.problem(503, "busy");
    drop(taken);
    rig.send(Method::POST, identify, JSON, touched).await.good();
    localized(&rig, &query).await;
}

#[tokio::test]
async fn a_newcomer_is_not_in_the_frame_of_the_map() {
    let rig = rig();
    for agent in ["rover", "newcomer"] {
        rig.samples(agent, &steps(1, 0, 3)).await.good();
    }
    for (agent, status, frame) in [
        ("rover", "localized", "map"),
        ("newcomer", "lost", "unplaced"),
    ] {
        let path = format!("/v1/spaces/lab/agents/{agent}");
        let estimate = rig.get(&path).await.good()["estimate"].clone();
        assert_eq!(
            (&estimate["status"], &estimate["frame"]),
            (&status.into(), &frame.into())
        );
    }
}
