//! A pose graph as the robot would have measured it.

use std::collections::{BTreeMap, BTreeSet};

use pose_graph::g2o::G2oGraph;

use crate::mapping::{Landmark, Matches, Measured, Recording, Step};

/// Nanoseconds in a second.
const NS_PER_S: u64 = 1_000_000_000;

/// The graph pose by pose, in the order of their ids. Edges from an id to the next are motion, all
/// others matches; each comes with the later of its poses. The stamp is the id in seconds, or the
/// number of the pose if an id is too large for that. Held is what the file says, or else the first
/// pose.
pub fn recording(graph: &G2oGraph) -> Recording {
    let numbers: BTreeMap<u64, usize> = graph.poses().keys().copied().zip(0..).collect();
    let holds_a_pose = graph.held().iter().any(|id| graph.poses().contains_key(id));
    let fits = |id: &u64| i64::try_from(id.saturating_mul(NS_PER_S)).is_ok();
    let ids_are_stamps = graph.poses().keys().all(fits);
    let mut steps: Vec<Step> = graph
        .poses()
        .iter()
        .zip(0_u64..)
        .map(|((id, pose), number)| {
            let seconds = if ids_are_stamps { *id } else { number };
            let stamp_ns = i64::try_from(seconds.saturating_mul(NS_PER_S));
            Step {
                stamp_ns: stamp_ns.unwrap_or(i64::MAX),
                guess: *pose,
                is_held: graph.held().contains(id) || (!holds_a_pose && number == 0),
                measured: Vec::new(),
            }
        })
        .collect();
    for edge in graph.edges() {
        let (from, to) = (numbers[&edge.from], numbers[&edge.to]);
        steps[from.max(to)].measured.push(Measured::Relative {
            from,
            to,
            transform: edge.transform,
            information: edge.information,
            is_motion: edge.is_odometry(),
        });
    }
    let seen: BTreeSet<u64> = graph.point_edges().iter().map(|edge| edge.point).collect();
    let landmarks: BTreeMap<u64, usize> = seen.into_iter().zip(0..).collect();
    for edge in graph.point_edges() {
        let from = numbers[&edge.pose];
        steps[from].measured.push(Measured::Sighting {
            from,
            landmark: landmarks[&edge.point],
            position: edge.position,
            information: edge.information,
        });
    }
    let held_at = |id: &u64| {
        graph
            .points()
            .get(id)
            .copied()
            .filter(|_| graph.held().contains(id))
    };
    Recording {
        freedom: graph.freedom(),
        steps,
        landmarks: landmarks
            .keys()
            .map(|id| Landmark {
                held_at: held_at(id),
            })
            .collect(),
        matches: Matches::Measurements,
    }
}
