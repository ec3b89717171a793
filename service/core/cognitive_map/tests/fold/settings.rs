//! What each setting changes, and that the defaults change nothing.

use cognitive_map::{CognitiveMap, EventKind, SettingsValues};

use crate::journal::{Robot, motion, settings, sighting, start_pose};
use crate::objects::{RODS, UP, feel, identify, taught};

/// A robot beside a landmark that it knows well, in a space with a setting changed.
fn beside_a_post(change: impl FnOnce(&mut SettingsValues)) -> (CognitiveMap, Robot) {
    let mut map = CognitiveMap::new(settings(change));
    let mut robot = Robot::enrol(&mut map);
    robot.sample(&mut map, start_pose([0.0; 3], [0.0; 3]));
    for _ in 0..20 {
        robot.sample(&mut map, sighting("post", [3.0, 0.0, 0.0], 0.1));
    }
    robot.sample(&mut map, motion([0.5, 0.0, 0.0], [0.0; 3]));
    (map, robot)
}

/// Stores of earlier versions hold maps under this digest: their checkpoints are read only by a
/// space with the same one.
#[test]
fn a_new_map_with_the_defaults_has_the_digest_that_it_always_had() {
    let map = CognitiveMap::new(settings(|_| ()));
    assert_eq!(map.digest().to_string(), "b3d5e5575b3d290ee6b3255ec9ef103c");
}

#[test]
fn every_setting_that_was_a_constant_counts_for_the_digest() {
    let changes: [fn(&mut SettingsValues); 9] = [
        |values| values.sighting_gate_sd = 3.0,
        |values| values.sighting_huber_sd = 3.0,
        |values| values.closure_gate_chi2 = 3.0,
        |values| values.keyframe_spacing_m = 0.5,
        |values| values.keyframe_spacing_rad = 0.5,
        |values| values.restart_sd_m = 0.75,
        |values| values.restart_sd_rad = 0.75,
        |values| values.object_answer_probability = 0.75,
        |values| values.learns_unknown_objects = false,
    ];
    let mut digests: Vec<_> = changes
        .map(|change| CognitiveMap::new(settings(change)).digest().to_string())
        .into();
    digests.push(CognitiveMap::new(settings(|_| ())).digest().to_string());
    digests.sort();
    digests.dedup();
    assert_eq!(digests.len(), 10, "{digests:?}");
}

#[test]
fn a_tighter_gate_refuses_a_sighting_that_the_default_takes() {
    let refused = |gate_sd| {
        let (mut map, mut robot) = beside_a_post(|values| values.sighting_gate_sd = gate_sd);
        let before = map.agent(robot.id).unwrap().evidence().refused;
        // A third of a metre beside where it stands.
        robot.sample(&mut map, sighting("post", [2.5, 0.33, 0.0], 0.1));
        map.agent(robot.id).unwrap().evidence().refused - before
    };
    assert_eq!((refused(4.0), refused(1.5)), (0, 1));
}

#[test]
fn a_tighter_huber_threshold_lets_an_outlier_move_less() {
    let moved_m = |huber_sd| {
        let (mut map, mut robot) = beside_a_post(|values| values.sighting_huber_sd = huber_sd);
        let before = robot.position(&map);
        robot.sample(&mut map, sighting("post", [2.5, 0.33, 0.0], 0.1));
        (robot.position(&map) - before).norm()
    };
    let (tight, wide) = (moved_m(0.5), moved_m(100.0));
    assert!(tight < 0.7 * wide, "{tight} {wide}");
    assert!(tight > 0.0);
}

#[test]
fn a_robot_that_restarts_where_it_stopped_stays_sure() {
    let sd = |sd_m, sd_rad| {
        let (mut map, mut robot) = beside_a_post(|values| {
            values.restart_sd_m = sd_m;
            values.restart_sd_rad = sd_rad;
        });
        let before = map.covariance(robot.id).unwrap();
        robot.session += 1;
        robot.seq = 0;
        robot.sample(&mut map, motion([0.0; 3], [0.0; 3]));
        let after = map.covariance(robot.id).unwrap();
        [0, 5].map(|k| {
            (after.matrix()[(k, k)] - before.matrix()[(k, k)])
                .max(0.0)
                .sqrt()
        })
    };
    let [x_m, yaw_rad] = sd(1.0, 0.5);
    assert!(
        (x_m - 1.0).abs() < 1e-6 && (yaw_rad - 0.5).abs() < 1e-6,
        "{x_m} {yaw_rad}"
    );
    let [x_m, yaw_rad] = sd(0.1, 0.02);
    assert!(
        (x_m - 0.1).abs() < 1e-6 && (yaw_rad - 0.02).abs() < 1e-6,
        "{x_m} {yaw_rad}"
    );
    let [x_m, yaw_rad] = sd(0.0, 0.0);
    assert!(x_m < 1e-6 && yaw_rad < 1e-6, "{x_m} {yaw_rad}");
}

#[test]
fn an_answer_about_an_object_waits_for_the_probability_that_is_asked_for() {
    let contacts = |probability| {
        let (mut map, mut hand) = taught(settings(|values| {
            values.object_answer_probability = probability;
        }));
        hand.sample(&mut map, identify());
        let knife = &RODS[1].1;
        (1..=UP.len()).find(|&count| {
            // Each touch begins where the one before has ended.
            let from = count.saturating_sub(2);
            let events = feel(&mut map, &mut hand, knife, &UP[from..count]);
            let is_answer = |event: &EventKind| matches!(event, EventKind::ObjectRecognised { .. });
            events.iter().any(is_answer)
        })
    };
    let (soon, usual, late) = (contacts(0.6), contacts(0.995), contacts(0.999_99));
    assert!(soon < usual && usual < late, "{soon:?} {usual:?} {late:?}");
    assert!(late.is_some());
}
