//! Relaxing few keyframes comes to what relaxing all of them does.

use std::collections::BTreeMap;

use nalgebra::{Isometry3, Vector3, Vector6};
use random::Seeded;

use super::tuning;
use crate::estimator::Calibrated;
use crate::input::{Label, Relation, RelativePosition};
use crate::keyframes::graph::KeyframeGraph;
use crate::keyframes::moment::Moment;
use crate::keyframes::settings::KeyframeSettings;

/// Length of a step \[m\], steps along each side of a round, and steps between two looks.
const STEP_M: f64 = 0.25;
const SIDE_STEPS: u64 = 60;
const LOOK_EVERY: u64 = 2;
/// Deviations of a step \[m, rad\], and of where a beacon is seen \[m\].
const STEP_SD: (f64, f64) = (0.008, 0.006);
const SEEN_SD_M: f64 = 0.05;
/// Distance of beacons along each axis \[m\].
const BEACON_M: f64 = 2.0;

/// A robot that goes round and round and sees the nearest beacon now and then.
pub(in crate::keyframes) fn patrolled(steps: u64) -> KeyframeGraph {
    let mut graph = KeyframeGraph::new(KeyframeSettings::default());
    let agent = graph.enrol();
    graph.found(agent);
    let mut random = Seeded(1);
    let mut normal = |sd: f64| sd * random.normal();
    let (length_sd, turn_sd) = STEP_SD;
    let variance = [length_sd, length_sd, 1e-6, 1e-6, 1e-6, turn_sd].map(|sd: f64| sd * sd);
    let mut pose = Isometry3::identity();
    for step in 1..=steps {
        let turn = if step.is_multiple_of(SIDE_STEPS) {
            std::f64::consts::FRAC_PI_2
        } else {
            0.0
        };
        let motion = Isometry3::new(Vector3::x() * STEP_M, Vector3::z() * turn);
        let error = Isometry3::new(
            Vector3::new(normal(length_sd), normal(length_sd), 0.0),
            Vector3::z() * normal(turn_sd),
        );
        pose *= motion;
        // The estimate is the truth: what is left are the errors of motions and sightings.
        let moment = Moment {
            agent,
            seq: step,
            stamp_ns: i64::try_from(step).unwrap() * 1_000_000_000,
            pose,
        };
        graph.motion(
            &moment,
            &(motion * error),
            &Vector6::from(variance),
            &Calibrated::default(),
        );
        if step.is_multiple_of(LOOK_EVERY) {
            let beacon = (pose.translation.vector / BEACON_M).map(f64::round);
            let seen = pose.inverse_transform_point(&(beacon * BEACON_M).into());
            let seen = seen.coords + Vector3::new(normal(SEEN_SD_M), normal(SEEN_SD_M), 0.0);
            let sd = Vector3::new(SEEN_SD_M, SEEN_SD_M, 0.01);
            let seen = RelativePosition::new(seen.into(), sd.into()).unwrap();
            let label = Label::new(&format!("beacon {} {}", beacon.x, beacon.y)).unwrap();
            graph.landmark(
                &moment,
                &label,
                &Relation::Position(seen),
                &sd.component_mul(&sd),
            );
        }
    }
    graph
}

/// Above all the map does not turn: a robot that recognised its places so far still does.
#[test]
fn a_long_past_relaxes_to_nearly_what_the_whole_does() {
    let mut graph = patrolled(LOOK_EVERY * (tuning::COARSE_SIGHTED_MAX as u64 + 2000));
    let refined = graph.refine();
    let whole: BTreeMap<i64, Isometry3<f64>> = { refined.agents[0].poses.iter() }
        .map(|refined| (refined.stamp_ns, refined.pose))
        .collect();
    let sighted =
        { graph.chains.keyframes.iter() }.filter(|(_, keyframe)| keyframe.sightings != super::NONE);
    assert!(sighted.count() > tuning::COARSE_SIGHTED_MAX);
    graph.relax();
    let (mut sum, mut count) = (0.0, 0.0);
    for (_, keyframe) in graph.chains.keyframes.iter() {
        let pose = &whole[&keyframe.stamp_ns];
        sum += (keyframe.pose.translation.vector - pose.translation.vector).norm_squared();
        count += 1.0;
    }
    let off_m = f64::sqrt(sum / count);
    assert!(off_m < 0.025, "{off_m} m off");
}
