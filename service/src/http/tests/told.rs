//! Landmarks that only a robot has seen that contradicts itself: nobody is told of them.

use super::*;

#[tokio::test]
async fn an_export_tells_the_landmarks_that_the_list_tells() {
    let rig = rig();
    // A robot whose sightings contradict one another: what it alone has seen is set aside.
    let mut state = 1_u64;
    let mut random = move || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 40) as f64 / f64::from(1 << 23) - 1.0
    };
    let samples = (0..1000_u64).map(|seq| {
        let place = [5.0 * random(), 5.0 * random(), 0.0];
        let body = match seq % 2 {
            0 => SampleBody::Increment(Increment {
                translation_m: place,
                rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
                noise: Some(cogmap_proto::MotionNoise {
                    translation_sd_m: [0.01; 3],
                    rotation_sd_rad: [0.01; 3],
                }),
            }),
            _ => SampleBody::Sighting(Sighting {
                target: Target::Landmark(format!("post {}", seq / 2 % 3)),
                relation: Relation::Position {
                    translation_m: place,
                    sd_m: [0.1; 3],
                },
            }),
        };
        let stamp_ns = i64::try_from(seq).expect("small") * 100_000_000;
        Sample { stamp_ns, body }
    });
    let batch = SampleBatch {
        session: 1,
        first_seq: 0,
        samples: samples.collect(),
    };
    rig.samples("liar", &batch).await.good();
    let listed = rig.get("/v1/spaces/lab/landmarks").await.good();
    assert_eq!(listed["landmarks"], serde_json::json!([]));
    let export = rig.get("/v1/spaces/lab/export").await.good();
    assert_eq!(export["landmarks"], listed["landmarks"]);
    // Another robot that sees truly is told.
    let start = SampleBody::StartPose(cogmap_proto::StartPose {
        translation_m: [0.0; 3],
        rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
        noise: None,
    });
    rig.samples("rover", &at(1, 0, start)).await.good();
    rig.samples("rover", &at(1, 1, post_ahead("dock")))
        .await
        .good();
    let listed = rig.get("/v1/spaces/lab/landmarks").await.good();
    assert_eq!(listed["landmarks"][0]["id"], "dock");
    let export = rig.get("/v1/spaces/lab/export").await.good();
    assert_eq!(export["landmarks"], listed["landmarks"]);
}
