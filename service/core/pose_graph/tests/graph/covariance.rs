//! How sure the map is.

use geometry::PoseCovariance;
use nalgebra::{Isometry3, Vector6};
use pose_graph::{Freedom, Kernel, Link, PoseGraph, PoseInformation, RelaxationSettings};

use crate::worlds::{Noise, Rounds};

/// Along odometry alone the map is as unsure as path integration says.
#[test]
fn a_chain_is_as_unsure_as_path_integration() {
    let sd = Vector6::new(0.05, 0.02, 0.03, 0.01, 0.005, 0.02);
    let information = PoseInformation::of_covariance(&PoseCovariance::from_sd(&sd)).unwrap();
    let mut random = Noise(41);
    let mut map = PoseGraph::new();
    let mut node = map.add_pose(Isometry3::identity(), Freedom::Held);
    let mut expected = PoseCovariance::zero();
    for _ in 0..30 {
        let transform =
            Isometry3::translation(1.0, 0.0, 0.0) * random.motion(0.3, 0.5, Freedom::Full);
        let next = map.add_pose(map.pose(node) * transform, Freedom::Full);
        map.add_link(
            Link::Between {
                from: node,
                to: next,
                transform,
                information,
            },
            Kernel::Gaussian,
        )
        .unwrap();
        expected = expected.after_motion(&transform, &sd);
        node = next;
        let found = map.marginals().pose(node).unwrap();
        let error = (found.matrix() - expected.matrix()).norm();
        assert!(error < 1e-6 * expected.matrix().norm(), "{error}");
    }
}

#[test]
fn relative_covariance_is_that_of_a_map_held_at_the_other_pose() {
    let world = Rounds::new(42, Freedom::Full, 0.05);
    let (mut map, nodes) = world.map(&world.dead_reckoned());
    map.relax(&RelaxationSettings {
        tolerance: 1e-12,
        ..RelaxationSettings::default()
    });
    let (a, b) = (nodes[10], nodes[40]);
    let found = map.marginals().relative_pose(a, b).unwrap();

    let mut held = PoseGraph::new();
    let renamed: Vec<_> = (0..nodes.len())
        .map(|k| {
            held.add_pose(
                *map.pose(nodes[k]),
                if k == 10 {
                    Freedom::Held
                } else {
                    Freedom::Full
                },
            )
        })
        .collect();
    for index in 0..world.measured.len() {
        held.add_link(world.link(index, &renamed), Kernel::Gaussian)
            .unwrap();
    }
    let expected = held.marginals().pose(renamed[40]).unwrap();
    let error = (found.matrix() - expected.matrix()).norm();
    assert!(error < 1e-6 * expected.matrix().norm(), "{error}");
}

#[test]
fn nobody_knows_where_a_pose_without_links_is() {
    let world = Rounds::new(43, Freedom::Planar, 0.05);
    let (mut map, _) = world.map(&world.dead_reckoned());
    let newcomer = map.add_pose(Isometry3::identity(), Freedom::Planar);
    assert_eq!(map.marginals().pose(newcomer), None);
}
