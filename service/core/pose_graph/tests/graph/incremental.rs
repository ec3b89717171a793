//! Relaxation as the map grows.

use nalgebra::Isometry3;
use pose_graph::{
    Freedom, IncrementalRelaxation, IncrementalSettings, Kernel, Link, LinkId, PoseGraph, PoseId,
    RelaxationSettings, Start,
};

use crate::worlds::{ROUND, Rounds, distance};

/// So strict that an update leaves nothing undone.
fn strict() -> IncrementalSettings {
    IncrementalSettings {
        turn_max_rad: 1e-9,
        shift_max_m: 1e-9,
        neglected_m: 0.0,
        neglected_rad: 0.0,
        relinearised_max: 1000,
        steps_max: 20,
    }
}

/// Feeds a world node by node, and hands the map out after each.
fn feed(
    world: &Rounds,
    settings: IncrementalSettings,
    mut after: impl FnMut(&PoseGraph, &[PoseId]),
) -> (PoseGraph, IncrementalRelaxation, Vec<PoseId>, Vec<LinkId>) {
    let mut map = PoseGraph::new();
    let mut live = IncrementalRelaxation::new(settings);
    let mut nodes = vec![map.add_pose(world.truth[0], Freedom::Held)];
    let mut links = Vec::new();
    for (index, &(from, to, motion)) in world.measured.iter().enumerate() {
        if to == nodes.len() {
            nodes.push(map.add_pose(map.pose(nodes[from]) * motion, world.freedom));
        }
        links.push(
            map.add_link(world.link(index, &nodes), Kernel::Gaussian)
                .unwrap(),
        );
        let is_last_of_node = world
            .measured
            .get(index + 1)
            .is_none_or(|next| next.1 != to);
        if is_last_of_node {
            live.update(&mut map);
            after(&map, &nodes);
        }
    }
    (map, live, nodes, links)
}

fn relaxed(mut map: PoseGraph, nodes: &[PoseId]) -> Vec<Isometry3<f64>> {
    map.relax(&RelaxationSettings {
        tolerance: 1e-13,
        ..RelaxationSettings::default()
    });
    nodes.iter().map(|&node| *map.pose(node)).collect()
}

#[test]
fn every_update_leaves_the_map_as_a_whole_relaxation_would() {
    for freedom in [Freedom::Planar, Freedom::Full] {
        let world = Rounds::new(21, freedom, 0.1);
        feed(&world, strict(), |map, nodes| {
            let batch = relaxed(map.clone(), nodes);
            assert!(distance(map, nodes, &batch) < 1e-6);
        });
    }
}

/// With the settings meant for use the map is near enough: well below the noise of a measurement.
#[test]
fn usual_settings_stay_near() {
    let world = Rounds::new(22, Freedom::Full, 0.1);
    feed(&world, IncrementalSettings::default(), |map, nodes| {
        let batch = relaxed(map.clone(), nodes);
        assert!(distance(map, nodes, &batch) < 0.1);
    });
}

#[test]
fn a_step_without_a_loop_concerns_few_nodes() {
    let world = Rounds::new(23, Freedom::Full, 0.02);
    let mut map = PoseGraph::new();
    let mut live = IncrementalRelaxation::new(IncrementalSettings::default());
    let mut nodes = vec![map.add_pose(world.truth[0], Freedom::Held)];
    for (index, &(from, to, motion)) in world.measured.iter().enumerate() {
        if to < ROUND && from + 1 == to {
            nodes.push(map.add_pose(map.pose(nodes[from]) * motion, world.freedom));
            map.add_link(world.link(index, &nodes), Kernel::Gaussian)
                .unwrap();
            let updated = live.update(&mut map);
            assert!(
                updated.n_eliminated <= 8 && updated.n_relinearised == 0,
                "{updated:?}"
            );
        }
    }
}

#[test]
fn a_link_that_is_switched_off_and_on_again_leaves_no_trace() {
    let world = Rounds::new(24, Freedom::Planar, 0.1);
    let (mut map, mut live, nodes, links) = feed(&world, strict(), |_, _| ());
    let with: Vec<_> = nodes.iter().map(|&node| *map.pose(node)).collect();
    let loop_link = *links.last().unwrap();
    map.switch_off(loop_link);
    live.update(&mut map);
    let without = relaxed(map.clone(), &nodes);
    assert!(distance(&map, &nodes, &without) < 1e-6);
    assert!(distance(&map, &nodes, &with) > 1e-3);
    map.switch_on(loop_link);
    live.update(&mut map);
    assert!(distance(&map, &nodes, &with) < 1e-6);
}

#[test]
fn the_same_feed_gives_the_same_bits() {
    let world = Rounds::new(25, Freedom::Full, 0.1);
    let fed = || {
        let (map, _, nodes, _) = feed(&world, IncrementalSettings::default(), |_, _| ());
        nodes
            .iter()
            .map(|&node| *map.pose(node))
            .collect::<Vec<_>>()
    };
    assert_eq!(fed(), fed());
}

#[test]
fn a_map_that_was_relaxed_as_a_whole_can_grow_on() {
    let world = Rounds::new(26, Freedom::Full, 0.1);
    let (mut map, nodes) = world.map(&world.dead_reckoned());
    map.relax(&RelaxationSettings {
        start: Start::RotationFirst,
        ..RelaxationSettings::default()
    });
    let mut live = IncrementalRelaxation::new(strict());
    live.update(&mut map);
    let batch = relaxed(map.clone(), &nodes);
    assert!(distance(&map, &nodes, &batch) < 1e-6);
}

/// A link that says nothing may join anything, and the map neither moves nor gets denser; once it
/// is switched on it counts as any other.
#[test]
fn a_silent_link_costs_nothing_until_it_is_switched_on() {
    let world = Rounds::new(61, Freedom::Planar, 0.05);
    let (mut map, nodes) = world.map(&world.dead_reckoned());
    let (mut quiet, mut heard) = (map.clone(), map.clone());
    let false_link = Link::Between {
        from: nodes[3],
        to: nodes[40],
        transform: Isometry3::identity(),
        information: Rounds::information(),
    };
    let silent = quiet
        .add_silent_link(false_link.clone(), Kernel::Gaussian)
        .unwrap();
    heard.add_link(false_link, Kernel::Gaussian).unwrap();
    assert!(!quiet.is_on(silent) && quiet.digest() != map.digest());
    let relax = |map: &mut PoseGraph| {
        let mut live = IncrementalRelaxation::new(strict());
        live.update(map);
        live
    };
    relax(&mut map);
    let mut live = relax(&mut quiet);
    relax(&mut heard);
    let places = |map: &PoseGraph| {
        nodes
            .iter()
            .map(|&node| *map.pose(node))
            .collect::<Vec<_>>()
    };
    assert_eq!(places(&quiet), places(&map), "to the last bit");
    quiet.switch_on(silent);
    live.update(&mut quiet);
    assert!(distance(&quiet, &nodes, &places(&heard)) < 1e-3);
    assert!(distance(&map, &nodes, &places(&heard)) > 0.1);
}
