//! Lasting errors of odometry that are found out late.

use cognitive_map::estimator::{Calibrated, Calibration};
use cognitive_map::keyframes::{KeyframeMap, KeyframeSettings, Moment};
use cognitive_map::{PoseNoise, StartPose};
use geometry::se3;
use nalgebra::{Isometry3, SVector, Vector3, Vector6};

/// Samples a second.
const RATE_HZ: u64 = 10;
/// What odometry gets wrong.
const LENGTH: f64 = 0.04;
const ANGLE: f64 = -0.08;
const BIAS_RAD_S: f64 = 0.01;

/// A walk whose errors are known from one sample on; answers the largest distances between refined
/// poses and truth, before that sample and after.
fn largest_errors(known_from: u64, keyframes_max: u32, sense: f64) -> [f64; 2] {
    let mut keyframes = KeyframeMap::new(KeyframeSettings {
        keyframes_max,
        ..KeyframeSettings::default()
    });
    let agent = keyframes.graph.enrol();
    let (mut truth, mut told) = (Isometry3::identity(), Isometry3::identity());
    let start = StartPose::new([0.0; 3], [0.0, 0.0, 0.0, 1.0], PoseNoise::none()).unwrap();
    let first = Moment {
        agent,
        seq: 0,
        stamp_ns: 0,
        pose: truth,
    };
    keyframes.start_pose(&first, &start);
    let mut path = vec![truth];
    for seq in 1..=600 {
        let phase = seq as f64 / 40.0;
        let (linear, angular) = (
            Vector3::new(0.05, 0.0, 0.0),
            Vector3::new(0.0, 0.0, sense * 0.06 * phase.sin()),
        );
        truth *= se3::exp(&linear, &angular);
        path.push(truth);
        let bias = Vector3::new(0.0, 0.0, sense * BIAS_RAD_S / RATE_HZ as f64);
        let is_known = seq >= known_from;
        let read = se3::exp(
            &(linear / (1.0 - sense * LENGTH)),
            &((angular + bias) / (1.0 - sense * ANGLE)),
        );
        let increment = if is_known {
            se3::exp(&linear, &angular)
        } else {
            read
        };
        let calibration = Calibration {
            length: sense * LENGTH,
            angle: sense * ANGLE,
            bias_rad_s: Vector3::new(0.0, 0.0, sense * BIAS_RAD_S),
            ..Calibration::default()
        };
        let calibrated = Calibrated {
            calibration: if is_known {
                calibration
            } else {
                Calibration::default()
            },
            states_noise: true,
            wander: SVector::repeat(1e-12),
            moving_s: 1.0 / RATE_HZ as f64,
            turned_rad: se3::log(&read).1,
        };
        told *= increment;
        let moment = Moment {
            agent,
            seq,
            stamp_ns: (seq * 1_000_000_000 / RATE_HZ).cast_signed(),
            pose: told,
        };
        let variance = Vector6::new(1e-6, 1e-6, 0.0, 0.0, 0.0, 1e-6);
        keyframes
            .graph
            .motion(&moment, &increment, &variance, &calibrated);
    }
    let mut largest = [0.0_f64; 2];
    for row in &keyframes.graph.refine().agents[0].poses {
        let seq = (row.stamp_ns.cast_unsigned() * RATE_HZ + 500_000_000) / 1_000_000_000;
        let off = (row.pose.translation.vector - path[seq as usize].translation.vector).norm();
        let side = &mut largest[usize::from(seq >= known_from)];
        *side = side.max(off);
    }
    largest
}

#[test]
fn what_is_learned_of_odometry_corrects_the_past() {
    for sense in [1.0, -1.0] {
        for keyframes_max in [4096, 96] {
            let [unknown, _] = largest_errors(601, keyframes_max, sense);
            assert!(unknown > 1.0, "the walk tells nothing: {unknown} m");
            let [before, after] = largest_errors(500, keyframes_max, sense);
            assert!(before < 0.03 * unknown, "{before} m of {unknown} m");
            assert!(after < 0.03 * unknown, "{after} m of {unknown} m");
        }
    }
}

#[test]
fn what_is_known_from_the_first_step_changes_nothing() {
    let [_, after] = largest_errors(1, 4096, 1.0);
    assert!(after < 1e-6, "{after} m");
}
