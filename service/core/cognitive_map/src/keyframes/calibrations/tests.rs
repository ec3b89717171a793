//! What taught the calibration of odometry decides for how long it counts.

use nalgebra::{Isometry3, SVector, Vector3, Vector6};
use place_recognition::{SampleKey, ViewMatch};

use crate::estimator::{Calibrated, Calibration, ExternalEstimate};
use crate::keyframes::graph::KeyframeGraph;
use crate::keyframes::moment::Moment;
use crate::keyframes::relaxation::Correction;
use crate::keyframes::relaxation_outcome::RelaxationOutcome;
use crate::keyframes::settings::KeyframeSettings;
use geometry::{PoseCovariance, se3};

const STEPS: u64 = 60;
const AHEAD: Vector3<f64> = Vector3::new(1.0, 0.0, 0.0);
const BIAS_RAD_S: f64 = 0.01;

/// A robot that reads that it goes straight on, one metre a second, and takes that for a bend by
/// what it has learned of its gyroscope.
fn bent(sense: f64) -> KeyframeGraph {
    let mut graph = KeyframeGraph::new(KeyframeSettings::default());
    let agent = graph.enrol();
    graph.found(agent);
    let bias_rad_s = Vector3::new(0.0, 0.0, sense * BIAS_RAD_S);
    let increment = se3::exp(&AHEAD, &-bias_rad_s);
    let calibrated = Calibrated {
        calibration: Calibration {
            bias_rad_s,
            ..Calibration::default()
        },
        wander: SVector::repeat(1e-12),
        moving_s: 1.0,
        ..Calibrated::default()
    };
    let mut pose = Isometry3::identity();
    for seq in 1..=STEPS {
        pose *= increment;
        let moment = Moment {
            agent,
            seq,
            stamp_ns: i64::try_from(seq).unwrap() * 1_000_000_000,
            pose,
        };
        graph.motion(&moment, &increment, &Vector6::repeat(1e-4), &calibrated);
    }
    graph
}

/// A relaxation that corrects the robot, by matches or by none.
fn corrected(graph: &mut KeyframeGraph, matches: Vec<ViewMatch>) {
    let estimate = ExternalEstimate {
        pose: Isometry3::identity(),
        covariance: PoseCovariance::from_sd(&[0.1; 6].into()),
        calibration: None,
        prevails: true,
    };
    let outcome = RelaxationOutcome {
        matches: Some(matches),
        corrections: vec![Correction { agent: 0, estimate }],
        ..RelaxationOutcome::default()
    };
    graph.bring_into_force(&outcome);
}

fn a_match() -> ViewMatch {
    let sample = |seq| SampleKey {
        agent: 0,
        session: 0,
        seq,
    };
    ViewMatch {
        now: sample(STEPS),
        then: sample(1),
        range_m: 2.0,
        sd_m: 1.0,
        depth: 1.0,
    }
}

/// How far to the left the refined way ends \[m\].
fn to_the_left(graph: &KeyframeGraph) -> f64 {
    let refined = graph.refine();
    let last = refined.agents[0].poses.last().unwrap();
    last.pose.translation.y
}

#[test]
fn what_matches_taught_of_odometry_is_given_up_with_them() {
    for sense in [1.0, -1.0] {
        let mut graph = bent(sense);
        let off = to_the_left(&graph) * sense;
        assert!(
            off < -10.0,
            "what was learned while it stood counts: {off} m"
        );

        corrected(&mut graph, vec![a_match()]);
        graph.matches = Vec::new().into();
        let off = to_the_left(&graph);
        assert!(
            off.abs() < 1e-6,
            "what was learned by matches does not: {off} m"
        );

        corrected(&mut graph, Vec::new());
        let off = to_the_left(&graph) * sense;
        assert!(off < -10.0, "what was learned since counts: {off} m");
    }
}
