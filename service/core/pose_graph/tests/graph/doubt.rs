//! Links that are false.

use pose_graph::{
    Freedom, Graduation, Kernel, Link, LinkId, PoseGraph, PoseId, RelaxationSettings, Scale, Start,
};

use nalgebra::Isometry3;

use crate::worlds::{Noise, ROUND, Rounds, distance};

/// A world whose loops are doubted, with as many false ones as stated.
fn doubted(
    world: &Rounds,
    n_false: usize,
    kernel: Kernel,
) -> (PoseGraph, Vec<PoseId>, Vec<LinkId>) {
    let mut map = PoseGraph::new();
    let mut nodes = Vec::new();
    for (k, pose) in world.dead_reckoned().iter().enumerate() {
        let freedom = if k == 0 { Freedom::Held } else { world.freedom };
        nodes.push(map.add_pose(*pose, freedom));
    }
    for index in 0..world.measured.len() {
        let is_odometry = world.measured[index].0 + 1 == world.measured[index].1;
        let kernel = if is_odometry {
            Kernel::Gaussian
        } else {
            kernel
        };
        map.add_link(world.link(index, &nodes), kernel).unwrap();
    }
    let mut random = Noise(77);
    let mut any = || random.index(2 * ROUND);
    let mut false_links = Vec::new();
    while false_links.len() < n_false {
        let (from, to) = (any(), any());
        let apart = world.truth[from].translation.vector - world.truth[to].translation.vector;
        if apart.norm() < 1.0 {
            continue;
        }
        let link = Link::Between {
            from: nodes[from],
            to: nodes[to],
            transform: Isometry3::identity(),
            information: Rounds::information(),
        };
        false_links.push(map.add_link(link, kernel).unwrap());
    }
    (map, nodes, false_links)
}

fn geman_mcclure() -> Kernel {
    Kernel::GemanMcClure(Scale::new(4.0).unwrap())
}

const FROM_WIDE: RelaxationSettings = RelaxationSettings {
    start: Start::Here,
    graduation: Graduation::FromWide,
    steps_max: 100,
    tolerance: 1e-9,
};

/// There are 25 true loops.
#[test]
fn a_map_with_four_false_links_for_each_true_one_is_the_map_without_them() {
    let freedom = Freedom::Planar;
    let world = Rounds::new(31, freedom, 0.05);
    let (mut clean, nodes, _) = doubted(&world, 0, geman_mcclure());
    clean.relax(&FROM_WIDE);
    let poses: Vec<_> = nodes.iter().map(|&node| *clean.pose(node)).collect();
    let (mut map, nodes, false_links) = doubted(&world, 100, geman_mcclure());
    assert!(map.relax(&FROM_WIDE).has_converged);
    assert!(
        distance(&map, &nodes, &poses) < 0.05,
        "{}",
        distance(&map, &nodes, &poses)
    );
    for link in false_links {
        assert!(map.squared_error(link) > 50.0);
    }
}

#[test]
fn a_false_link_bends_the_map_less_the_less_it_is_trusted() {
    let freedom = Freedom::Full;
    let world = Rounds::new(32, freedom, 0.02);
    let scale = Scale::new(2.0).unwrap();
    let bent: Vec<f64> = [
        Kernel::Gaussian,
        Kernel::Huber(scale),
        Kernel::Cauchy(scale),
        Kernel::GemanMcClure(scale),
    ]
    .into_iter()
    .map(|kernel| {
        let (mut map, nodes, _) = doubted(&world, 3, kernel);
        map.relax(&RelaxationSettings::default());
        distance(&map, &nodes, &world.truth)
    })
    .collect();
    assert!(bent[0] > 2.0 && bent[1] < 0.2 * bent[0], "{bent:?}");
    assert!(
        bent[2] < 0.5 * bent[1] && bent[3] < 0.5 * bent[1],
        "{bent:?}"
    );
}
