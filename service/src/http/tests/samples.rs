//! Samples that are refused.

use cogmap_proto::{ObjectMark, Orientation, TouchNoise};

use super::*;

#[tokio::test]
async fn samples_that_make_no_sense_are_listed_not_taken() {
    let rig = rig();
    let mut batch = steps(1, 0, 3);
    if let SampleBody::Increment(increment) = &mut batch.samples[1].body {
        increment.rotation_xyzw = [0.0; 4];
    }
    let answer = rig.samples("rover", &batch).await.good();
    assert_eq!(answer["watermark"]["durable"], 3);
    let rejected = &answer["watermark"]["rejected"][0];
    assert_eq!(rejected["reason"], "non_unit_quaternion", "{answer}");
    assert_eq!(rejected["range"], serde_json::json!({ "from": 1, "to": 2 }));
    assert_eq!(answer["refused"].as_array().map(Vec::len), Some(1));
}

#[tokio::test]
async fn marks_of_episodes_are_refused_by_their_field_and_its_limits() {
    let rig = rig();
    let learn = |spacing_m| {
        SampleBody::Object(ObjectMark::Learn {
            name: Some("cup".to_owned()),
            spacing_m,
            orientation: Orientation::Known {},
            noise: TouchNoise::default(),
        })
    };
    let identify = |orientation, position_sd_m| {
        let noise = TouchNoise {
            position_sd_m,
            ..TouchNoise::default()
        };
        SampleBody::Object(ObjectMark::Identify { orientation, noise })
    };
    let no_rotations = Orientation::Finite {
        rotations_xyzw: Vec::new(),
    };
    let marks = [
        (learn(0.0), "spacing_m 0.0: must be 1e-5 to 1000 m"),
        (
            identify(no_rotations, 0.001),
            "orientation {\"finite\":{\"rotations_xyzw\":[]}}: must have 1 to 1000 rotations",
        ),
        (
            identify(Orientation::Known {}, -1.0),
            "noise.position_sd_m -1.0: a standard deviation is negative",
        ),
    ];
    for (seq, (mark, told)) in (0..).zip(marks) {
        let answer = rig.samples("rover", &at(1, seq, mark)).await.good();
        let expected = format!("samples[0].body.object.{told}");
        assert_eq!(answer["refused"], serde_json::json!([expected]));
    }
}

#[tokio::test]
async fn samples_whose_time_goes_back_are_told_why_they_are_refused() {
    let rig = rig();
    let mut batch = steps(1, 0, 40);
    for sample in batch.samples.iter_mut().skip(1).step_by(2) {
        sample.stamp_ns = -7;
    }
    let answer = rig.samples("rover", &batch).await.good();
    let refused = answer["refused"].as_array().expect("a list");
    // The first ones, of more than are told of.
    assert_eq!(refused.len(), 16);
    let told = "samples[1].stamp_ns: -7 is before the stamp of an earlier sample";
    assert_eq!(refused[0], told, "{answer}");
    // One that is far ahead makes all that follow go back, in later requests, too.
    let mut ahead = steps(1, 40, 1);
    ahead.samples[0].stamp_ns = i64::MAX / 2;
    let answer = rig.samples("rover", &ahead).await.good();
    assert_eq!(answer["refused"], serde_json::json!([]), "{answer}");
    let answer = rig.samples("rover", &steps(1, 41, 3)).await.good();
    let refused = answer["refused"].as_array().expect("a list");
    assert_eq!(refused.len(), 3, "{answer}");
    let is_told = |line: &Value| {
        line.as_str()
            .is_some_and(|line| line.contains("earlier sample"))
    };
    assert!(refused.iter().all(is_told), "{answer}");
}
