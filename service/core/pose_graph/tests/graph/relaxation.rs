//! Relaxation of a whole map.

use nalgebra::{Isometry3, Point3, Vector3};
use pose_graph::{
    Freedom, Graduation, Kernel, Link, PoseGraph, RelaxationSettings, SightingTarget, Start,
};

use crate::worlds::{Noise, ROUND, Rounds, distance, position_information};

const BOTH: [Freedom; 2] = [Freedom::Planar, Freedom::Full];

fn from(start: Start) -> RelaxationSettings {
    RelaxationSettings {
        start,
        tolerance: 1e-12,
        ..RelaxationSettings::default()
    }
}

#[test]
fn exact_measurements_give_back_the_truth_from_any_start() {
    for freedom in BOTH {
        let world = Rounds::new(1, freedom, 0.0);
        let mut random = Noise(9);
        let nowhere: Vec<_> = world
            .truth
            .iter()
            .map(|_| random.motion(30.0, 3.0, freedom))
            .collect();
        let (mut map, nodes) = world.map(&[&world.truth[..1], &nowhere[1..]].concat());
        let report = map.relax(&from(Start::RotationFirst));
        assert!(report.has_converged);
        assert!(distance(&map, &nodes, &world.truth) < 1e-6);
        assert!(map.chi_squared() < 1e-9);
    }
}

#[test]
fn noisy_measurements_give_the_same_map_from_odometry_and_from_rotations() {
    for freedom in BOTH {
        let world = Rounds::new(2, freedom, 0.1);
        let (mut map, nodes) = world.map(&world.dead_reckoned());
        let report = map.relax(&from(Start::Here));
        assert!(report.has_converged && report.chi_squared < 0.1 * report.chi_squared_at_start);
        assert!((report.chi_squared - map.chi_squared()).abs() < 1e-9);
        let poses: Vec<_> = nodes.iter().map(|&node| *map.pose(node)).collect();
        let (mut map, nodes) = world.map(&world.dead_reckoned());
        map.relax(&from(Start::RotationFirst));
        assert!(distance(&map, &nodes, &poses) < 1e-5);
    }
}

/// Away from the optimum χ² grows on every side, for every node alone.
#[test]
fn nowhere_nearby_costs_less() {
    for freedom in BOTH {
        let world = Rounds::new(3, freedom, 0.1);
        let (mut map, nodes) = world.map(&world.dead_reckoned());
        map.relax(&from(Start::Here));
        let least = map.chi_squared();
        let optimum: Vec<_> = nodes.iter().map(|&node| *map.pose(node)).collect();
        let mut random = Noise(4);
        for moved in 1..nodes.len() {
            let mut poses = optimum.clone();
            poses[moved] *= random.motion(1e-3, 1e-3, freedom);
            assert!(world.map(&poses).0.chi_squared() > least);
        }
    }
}

#[test]
fn the_map_does_not_depend_on_where_its_frame_lies() {
    let frame = Isometry3::new(
        Vector3::new(200.0, -300.0, 40.0),
        Vector3::new(0.8, -1.1, 2.0),
    );
    for freedom in BOTH {
        let world = Rounds::new(5, freedom, 0.1);
        let (mut map, nodes) = world.map(&world.dead_reckoned());
        map.relax(&from(Start::Here));
        let carried: Vec<_> = nodes.iter().map(|&node| frame * map.pose(node)).collect();
        let start: Vec<_> = world
            .dead_reckoned()
            .iter()
            .map(|pose| frame * pose)
            .collect();
        for begin in [Start::Here, Start::RotationFirst] {
            let (mut map, nodes) = world.map(&start);
            map.relax(&from(begin));
            assert!(distance(&map, &nodes, &carried) < 1e-5);
        }
    }
}

/// A planar node keeps height, roll and pitch, also in a plane that is not level.
#[test]
fn planar_nodes_stay_in_their_plane() {
    let world = Rounds::new(6, Freedom::Planar, 0.2);
    let tilted = Isometry3::new(Vector3::new(1.0, 2.0, 3.0), Vector3::new(0.5, -0.4, 0.3));
    let start: Vec<_> = world
        .dead_reckoned()
        .iter()
        .map(|pose| tilted * pose)
        .collect();
    for begin in [Start::Here, Start::RotationFirst] {
        let (mut map, nodes) = world.map(&start);
        map.relax(&from(begin));
        for &node in &nodes {
            let in_plane = tilted.inv_mul(map.pose(node));
            assert!(in_plane.translation.z.abs() < 1e-9);
            assert!((in_plane.rotation * Vector3::z() - Vector3::z()).norm() < 1e-9);
        }
    }
}

#[test]
fn landmarks_seen_from_several_poses_tie_them() {
    let mut random = Noise(7);
    let truth: Vec<_> = (0..6)
        .map(|_| random.motion(4.0, 1.0, Freedom::Full))
        .collect();
    let landmarks: Vec<_> = (0..5)
        .map(|_| Point3::from(random.motion(9.0, 0.0, Freedom::Full).translation.vector))
        .collect();
    let mut map = PoseGraph::new();
    let mut poses = Vec::new();
    for (k, pose) in truth.iter().enumerate() {
        let freedom = if k == 0 { Freedom::Held } else { Freedom::Full };
        let error = if k == 0 {
            Isometry3::identity()
        } else {
            random.motion(0.5, 0.2, freedom)
        };
        poses.push(map.add_pose(pose * error, freedom));
    }
    let points: Vec<_> = landmarks
        .iter()
        .map(|_| map.add_point(Point3::new(1.0, 2.0, 3.0), Freedom::Full))
        .collect();
    for (pose, from) in truth.iter().zip(&poses) {
        for (landmark, &point) in landmarks.iter().zip(&points) {
            let sighting = Link::Sighting {
                from: *from,
                target: SightingTarget::Point(point),
                position: pose.inverse_transform_point(landmark).coords,
                information: position_information(0.1),
            };
            map.add_link(sighting, Kernel::Gaussian).unwrap();
        }
    }
    assert!(map.relax(&from(Start::Here)).has_converged);
    assert!(distance(&map, &poses, &truth) < 1e-5);
    for (landmark, &point) in landmarks.iter().zip(&points) {
        assert!((map.point(point) - landmark).norm() < 1e-5);
    }
}

/// Without a trust region the first full step from here makes things worse.
#[test]
fn a_bad_start_never_ends_worse() {
    for freedom in BOTH {
        for seed in 0..5 {
            let world = Rounds::new(seed, freedom, 0.1);
            let mut random = Noise(100 + seed);
            let start: Vec<_> = world
                .truth
                .iter()
                .map(|pose| pose * random.motion(5.0, 2.0, freedom))
                .collect();
            let (mut map, _) = world.map(&start);
            let report = map.relax(&from(Start::Here));
            assert!(report.chi_squared <= report.chi_squared_at_start);
            assert!(report.chi_squared.is_finite());
        }
    }
}

#[test]
fn what_nothing_ties_to_the_map_keeps_its_place() {
    let world = Rounds::new(8, Freedom::Full, 0.0);
    let mut map = PoseGraph::new();
    let nodes: Vec<_> = world
        .truth
        .iter()
        .map(|pose| map.add_pose(*pose, Freedom::Full))
        .collect();
    let alone = map.add_pose(Isometry3::translation(5.0, 6.0, 7.0), Freedom::Full);
    for index in 0..world.measured.len() {
        map.add_link(world.link(index, &nodes), Kernel::Gaussian)
            .unwrap();
    }
    let report = map.relax(&from(Start::Here));
    assert_eq!(report.n_undetermined, 12);
    assert!(distance(&map, &nodes, &world.truth) < 1e-6);
    assert_eq!(map.pose(alone), &Isometry3::translation(5.0, 6.0, 7.0));
}

/// The second round begins in a frame of its own, and is carried into that of the first when one
/// step between them is known.
#[test]
fn frames_merge() {
    let own_frame = Isometry3::new(Vector3::new(50.0, -20.0, 5.0), Vector3::new(1.0, 2.0, -0.5));
    for freedom in BOTH {
        let own_frame = if freedom == Freedom::Full {
            own_frame
        } else {
            Isometry3::translation(9.0, 8.0, 0.0)
        };
        let world = Rounds::new(12, freedom, 0.0);
        let mut map = PoseGraph::new();
        let mut nodes = Vec::new();
        for (k, pose) in world.truth.iter().enumerate() {
            let is_origin = k == 0 || k == ROUND;
            let pose = if k < ROUND { *pose } else { own_frame * pose };
            nodes.push(map.add_pose(pose, if is_origin { Freedom::Held } else { freedom }));
        }
        let between = |link: usize| {
            let (from, to, _) = world.measured[link];
            from < ROUND && to >= ROUND
        };
        for link in (0..world.measured.len()).filter(|&link| !between(link)) {
            map.add_link(world.link(link, &nodes), Kernel::Gaussian)
                .unwrap();
        }
        assert!(map.relax(&from(Start::Here)).chi_squared < 1e-9);

        let step = world
            .measured
            .iter()
            .find(|measured| measured.1 == ROUND)
            .unwrap();
        let origin = map.pose(nodes[step.0]) * step.2;
        let carry = origin * map.pose(nodes[ROUND]).inverse();
        for &node in &nodes[ROUND..] {
            map.place_pose(node, carry * map.pose(node), freedom);
        }
        for link in (0..world.measured.len()).filter(|&link| between(link)) {
            map.add_link(world.link(link, &nodes), Kernel::Gaussian)
                .unwrap();
        }
        assert!(map.relax(&from(Start::Here)).chi_squared < 1e-9);
        assert!(distance(&map, &nodes, &world.truth) < 1e-6);
    }
}

#[test]
fn the_same_map_relaxes_to_the_same_bits() {
    let world = Rounds::new(11, Freedom::Full, 0.1);
    let relaxed = || {
        let (mut map, nodes) = world.map(&world.dead_reckoned());
        let settings = RelaxationSettings {
            start: Start::RotationFirst,
            graduation: Graduation::FromWide,
            ..RelaxationSettings::default()
        };
        map.relax(&settings);
        nodes
            .iter()
            .map(|&node| *map.pose(node))
            .collect::<Vec<_>>()
    };
    assert_eq!(relaxed(), relaxed());
}

#[test]
fn an_empty_map_and_a_map_without_links_relax() {
    let mut map = PoseGraph::new();
    assert!(map.relax(&from(Start::RotationFirst)).chi_squared.abs() < 1e-15);
    let node = map.add_pose(Isometry3::identity(), Freedom::Planar);
    assert!(map.relax(&from(Start::RotationFirst)).has_converged);
    assert_eq!(map.pose(node), &Isometry3::identity());
}

/// A link that is switched off says nothing, whatever it joins; switched on again it counts as any
/// other.
#[test]
fn a_link_that_is_switched_off_leaves_no_trace() {
    let world = Rounds::new(61, Freedom::Planar, 0.05);
    let (map, nodes) = world.map(&world.dead_reckoned());
    let relaxed = |mut map: PoseGraph| {
        map.relax(&RelaxationSettings::default());
        let poses = nodes.iter().map(|&node| *map.pose(node));
        poses.collect::<Vec<_>>()
    };
    let mut bent = map.clone();
    let false_link = Link::Between {
        from: nodes[3],
        to: nodes[40],
        transform: Isometry3::identity(),
        information: Rounds::information(),
    };
    let link = bent.add_link(false_link, Kernel::Gaussian).unwrap();
    let with = relaxed(bent.clone());
    bent.switch_off(link);
    assert!(!bent.is_on(link) && bent.digest() != map.digest());
    let without = relaxed(bent.clone());
    assert_eq!(without, relaxed(map), "to the last bit");
    bent.switch_on(link);
    assert_eq!(relaxed(bent), with);
    assert_ne!(with, without);
}
