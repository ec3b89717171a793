use geometry::PoseCovariance;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::*;
use crate::elimination::CliqueTree;
use crate::{Freedom, Kernel, Link, PoseGraph, PoseInformation};

/// A loop of poses whose links contradict one another, and two poses that only one another know.
fn contradicting() -> PoseGraph {
    let step = |number: usize, by: f64| {
        let turn = Vector3::new(0.1 * by, -0.2, 0.9 + 0.05 * by) * (number as f64).cos();
        Isometry3::from_parts(
            Vector3::new(1.0 + by, 0.3 * by, -0.1).into(),
            UnitQuaternion::from_scaled_axis(turn),
        )
    };
    let information =
        PoseInformation::of_covariance(&PoseCovariance::from_sd(&Vector6::repeat(0.1)));
    let information = information.expect("a covariance");
    let mut map = PoseGraph::new();
    let mut pose = Isometry3::identity();
    let mut nodes = vec![map.add_pose(pose, Freedom::Held)];
    for number in 1..8 {
        pose *= step(number, 0.2);
        nodes.push(map.add_pose(pose, Freedom::Full));
    }
    let pairs = [
        (0, 1),
        (1, 2),
        (2, 3),
        (3, 4),
        (4, 5),
        (5, 0),
        (1, 4),
        (6, 7),
    ];
    for (number, (from, to)) in pairs.into_iter().enumerate() {
        let link = Link::Between {
            from: nodes[from],
            to: nodes[to],
            transform: step(number, -0.3),
            information,
        };
        map.add_link(link, Kernel::Gaussian)
            .expect("a link of its nodes");
    }
    map
}

#[test]
fn a_step_of_any_length_is_expected_to_bring_what_the_equations_say() {
    let map = contradicting();
    let poses: Vec<_> = map.nodes.iter().map(|node| node.pose).collect();
    let equations = NormalEquations::new(&map, &poses, 1.0);
    let mut tree = CliqueTree::structured(&equations, poses.len());
    let n_undetermined = tree.refactor(&equations, &tree.all());
    assert_eq!(n_undetermined, 6, "nothing says where the two poses are");
    let newton = tree.solve();
    let descent = SteepestDescent::new(&equations);
    let (steepest, whole) = (descent.length(&descent.step), descent.length(&newton));
    assert!(steepest < whole);
    let between = 0.5 * (steepest + whole);
    for radius in [0.3 * steepest, steepest, between, whole, 2.0 * whole] {
        let (step, expected) = descent.dogleg(&newton, radius);
        let length = descent.length(&step);
        assert!(
            (length - radius.min(whole)).abs() < 1e-9 * whole,
            "{length} of {radius}"
        );
        let by_equations = -2.0 * dot(&descent.gradient, &step) - quadratic_form(&equations, &step);
        assert!(
            (expected - by_equations).abs() < 1e-9 * by_equations.abs(),
            "{expected}"
        );
    }
}
