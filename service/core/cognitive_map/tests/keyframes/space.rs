//! Closures of a robot that leaves the plane.

use crate::as_read;
use cognitive_map::keyframes::{KeyframeMap, KeyframeSettings, Moment};
use cognitive_map::{PoseNoise, Relation, RelativePose, StartPose};
use geometry::se3;
use nalgebra::{Isometry3, Vector3, Vector6};
use random::Seeded;

/// Poses of a turn of the helix, and turns.
const TURN: u64 = 16;
const TURNS: u64 = 10;
/// Deviations of motions and of closures, along and about each axis \[m, rad\].
const SD: [f64; 6] = [0.05, 0.05, 0.05, 0.01, 0.01, 0.01];

/// A motion that is off by these deviations.
fn noisy(motion: &Isometry3<f64>, random: &mut Seeded) -> Isometry3<f64> {
    let off = Vector6::from_fn(|k, _| SD[k] * random.normal());
    let (linear, angular) = se3::split(&off);
    motion * se3::exp(&linear, &angular)
}

fn moment(seq: u64, pose: &Isometry3<f64>) -> Moment {
    Moment {
        agent: 0,
        seq,
        stamp_ns: i64::try_from(seq).unwrap() * 1_000_000_000,
        pose: *pose,
    }
}

/// A robot climbs in a helix. It sees from each pose the one a turn below, with the noise of its
/// motions. In the plane alone, hardly one of these closures is evident.
#[test]
fn single_closures_hold_a_helix_together() {
    let mut random = Seeded(7);
    let mut keyframes = KeyframeMap::new(KeyframeSettings::default());
    keyframes.graph.enrol();
    let start = StartPose::new([0.0; 3], [0.0, 0.0, 0.0, 1.0], PoseNoise::none()).unwrap();
    let mut told = Isometry3::identity();
    keyframes.start_pose(&moment(0, &told), &start);
    let turn = std::f64::consts::TAU / TURN as f64;
    let step = Isometry3::new(Vector3::new(1.0, 0.0, 0.25), Vector3::z() * turn);
    let mut truth = vec![told];
    let variance = Vector6::from_fn(|k, _| SD[k] * SD[k]);
    for seq in 1..=TURN * TURNS {
        let read = noisy(&step, &mut random);
        truth.push(truth[truth.len() - 1] * step);
        told *= read;
        let now = moment(seq, &told);
        let graph = &mut keyframes.graph;
        graph.motion(&now, &read, &variance, &as_read(&read));
        if seq > TURN {
            let is = |seq: u64| truth[usize::try_from(seq).unwrap()];
            let seen = noisy(&is(seq).inv_mul(&is(seq - TURN)), &mut random);
            let noise = PoseNoise::new([SD[0]; 3], [SD[3]; 3]).unwrap();
            let position = seen.translation.vector.into();
            let relation = RelativePose::new(position, seen.rotation.coords.into(), noise);
            assert!(graph.closure(&now, seq - TURN, &Relation::Pose(relation.unwrap())));
        }
        if keyframes.graph.is_due() {
            for correction in keyframes.graph.relax() {
                told = correction.estimate.pose;
            }
        }
    }
    let refined = keyframes.graph.refine();
    let off = { refined.agents[0].poses.iter().zip(&truth) }
        .map(|(refined, truth)| {
            (refined.pose.translation.vector - truth.translation.vector).norm_squared()
        })
        .sum::<f64>();
    let rms_m = (off / truth.len() as f64).sqrt();
    assert!(rms_m < 1.2, "{rms_m} m");
}
