//! What a space's settings change of the keyframe graph.

use crate::as_read;
use cognitive_map::keyframes::{KeyframeMap, KeyframeSettings, Moment};
use nalgebra::{Isometry3, Vector3, Vector6};

/// Keyframes of a robot that goes straight ahead, or turns on the spot, in a hundred steps.
fn keyframes(spacing: (f64, f64), step: Vector6<f64>) -> usize {
    let mut map = KeyframeMap::new(KeyframeSettings {
        spacing,
        ..KeyframeSettings::default()
    });
    let agent = map.graph.enrol();
    map.graph.found(agent);
    let step = Isometry3::new(
        Vector3::new(step[0], step[1], step[2]),
        Vector3::new(step[3], step[4], step[5]),
    );
    let mut pose = Isometry3::identity();
    for seq in 1..=100 {
        pose *= step;
        let moment = Moment {
            agent,
            seq,
            stamp_ns: i64::try_from(seq).unwrap() * 100_000_000,
            pose,
        };
        let variance = Vector6::repeat(1e-6);
        map.graph.motion(&moment, &step, &variance, &as_read(&step));
    }
    map.graph.n_keyframes()
}

#[test]
fn keyframes_lie_as_far_apart_as_is_asked_for() {
    let ahead = Vector6::new(0.0501, 0.0, 0.0, 0.0, 0.0, 0.0);
    let turning = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0501);
    // Five metres, or five radians, and the first one.
    assert_eq!(keyframes((0.1, 0.1), ahead), 51);
    assert_eq!(keyframes((1.0, 0.1), ahead), 6);
    assert_eq!(keyframes((0.1, 0.1), turning), 51);
    assert_eq!(keyframes((0.1, 1.0), turning), 6);
    assert_eq!(keyframes((1.0, 0.1), turning), 51, "either brings one");
}
