use geometry::se3;
use nalgebra::Vector6;
use pose_graph::{Freedom, Kernel, Link, PoseGraph, PoseInformation, RelaxationSettings};
use proptest::prelude::*;

use super::*;

fn pose(twist: [f64; 6]) -> Isometry3<f64> {
    let twist = Vector6::from(twist);
    se3::exp(
        &twist.fixed_rows::<3>(0).into(),
        &twist.fixed_rows::<3>(3).into(),
    )
}

fn off(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    let (length, angle) = se3::log(&a.inv_mul(b));
    length.norm() + angle.norm()
}

fn motions(twists: &[[f64; 6]], sd: &[f64]) -> Vec<Motion> {
    let motion = |(&twist, &sd): (&[f64; 6], &f64)| {
        let covariance = PoseCovariance::from_sd(&Vector6::repeat(sd));
        (pose(twist), covariance)
    };
    twists.iter().zip(sd).map(motion).collect()
}

/// Twists of a step forward, turning about any axis.
fn steps() -> impl Strategy<Value = Vec<[f64; 6]>> {
    let step = [
        0.05..0.5,
        -0.1..0.1,
        -0.1..0.1,
        -0.2..0.2,
        -0.2..0.2,
        -0.4..0.4,
    ];
    prop::collection::vec(step, 1..12)
}

proptest! {
    /// Motions that lead exactly to the end are followed, wherever they begin.
    #[test]
    fn what_misses_nothing_stays(steps in steps(), at in prop::array::uniform6(-2.0..2.0)) {
        let motions = motions(&steps, &vec![0.01; steps.len()]);
        let from = pose(at);
        let mut path = vec![];
        let mut end = from;
        for (motion, _) in &motions {
            end *= motion;
            path.push(end);
        }
        let between = bridge(&from, &motions, &end);
        prop_assert_eq!(between.len() + 1, motions.len());
        for (found, expected) in between.iter().zip(&path) {
            prop_assert!(off(found, expected) < 1e-9);
        }
    }

    /// The most likely poses, as the pose graph finds them.
    #[test]
    fn poses_are_the_most_likely(
        steps in steps(),
        sds in prop::collection::vec(0.005..0.02, 12),
        missed in prop::array::uniform6(-0.03..0.03),
    ) {
        let motions = motions(&steps, &sds);
        let from = pose([1.0, -2.0, 0.5, 0.1, 0.2, 2.0]);
        let mut path = vec![from];
        for (motion, _) in &motions {
            path.push(path[path.len() - 1] * motion);
        }
        let to = path[path.len() - 1] * pose(missed);
        let expected = most_likely(&path, &motions, &to);
        let found = bridge(&from, &motions, &to);
        let length = off(&path[path.len() - 1], &to);
        for (found, expected) in found.iter().zip(&expected) {
            prop_assert!(off(found, expected) < 0.05 * length + 1e-9);
        }
    }
}

/// The poses between of a pose graph whose ends are held.
fn most_likely(
    path: &[Isometry3<f64>],
    motions: &[Motion],
    to: &Isometry3<f64>,
) -> Vec<Isometry3<f64>> {
    let mut graph = PoseGraph::new();
    let last = path.len() - 1;
    let nodes: Vec<_> = (0..=last)
        .map(|k| match k {
            0 => graph.add_pose(path[0], Freedom::Held),
            k if k == last => graph.add_pose(*to, Freedom::Held),
            k => graph.add_pose(path[k], Freedom::Full),
        })
        .collect();
    for (ends, (motion, covariance)) in nodes.windows(2).zip(motions) {
        let information = covariance.matrix().try_inverse().expect("positive");
        let link = Link::Between {
            from: ends[0],
            to: ends[1],
            transform: *motion,
            information: PoseInformation::new(&information).expect("positive"),
        };
        graph.add_link(link, Kernel::Gaussian).expect("two nodes");
    }
    graph.relax(&RelaxationSettings::default());
    nodes[1..last]
        .iter()
        .map(|node| *graph.pose(*node))
        .collect()
}

/// A robot whose every step turns by the same too much comes back nearly onto the true arc, off
/// which it was by 0.35 m and 0.2 rad.
#[test]
fn a_lasting_veer_is_undone() {
    let covariance = PoseCovariance::from_sd(&Vector6::new(1e-3, 1e-3, 1e-3, 0.01, 0.01, 0.01));
    let motions = vec![(pose([0.2, 0.0, 0.0, 0.0, 0.0, 0.11]), covariance); 20];
    let mut truth = vec![Isometry3::identity()];
    for _ in 0..20 {
        truth.push(truth[truth.len() - 1] * pose([0.2, 0.0, 0.0, 0.0, 0.0, 0.1]));
    }
    let found = bridge(&truth[0], &motions, &truth[20]);
    for (found, expected) in found.iter().zip(&truth[1..]) {
        assert!(off(found, expected) < 0.03, "{found} {expected}");
    }
}

#[test]
fn exact_motions_share_evenly() {
    let known = (pose([1.0, 0.0, 0.0, 0.0, 0.0, 0.0]), PoseCovariance::zero());
    for end in [3.6, 4.4] {
        let to = Isometry3::translation(end, 0.0, 0.0);
        let found = bridge(&Isometry3::identity(), &[known; 4], &to);
        for (pose, number) in found.iter().zip(1..) {
            let expected = Isometry3::translation(0.25 * end * f64::from(number), 0.0, 0.0);
            assert!(off(pose, &expected) < 1e-9);
        }
    }
}

/// Half a turn is missed: whichever way is taken, nothing is lost in numbers.
#[test]
fn a_way_that_misses_by_half_a_turn_stays_finite() {
    let covariance = PoseCovariance::from_sd(&Vector6::repeat(0.01));
    let motions = vec![(pose([0.3, 0.0, 0.0, 0.0, 0.0, 0.1]), covariance); 10];
    let to = pose([1.0, 2.0, 0.0, 0.0, 0.0, 1.0 - std::f64::consts::PI]);
    for pose in bridge(&Isometry3::identity(), &motions, &to) {
        assert!(pose.translation.vector.norm() < 10.0);
    }
}

#[test]
fn one_motion_has_nothing_between() {
    let known = (pose([1.0; 6]), PoseCovariance::zero());
    assert!(bridge(&Isometry3::identity(), &[known], &Isometry3::identity()).is_empty());
    assert!(bridge(&Isometry3::identity(), &[], &Isometry3::identity()).is_empty());
}
