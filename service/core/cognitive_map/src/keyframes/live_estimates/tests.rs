//! The map lies where agents and landmarks are estimated to be, and nothing else of it changes.

use nalgebra::{Isometry3, Matrix3, Vector3};

use super::LiveEstimates;
use crate::keyframes::coarse::tests::patrolled;
use crate::keyframes::graph::KeyframeGraph;

/// Where a relaxation that is held has the keyframes.
fn relaxed(graph: &KeyframeGraph, live: &LiveEstimates) -> Vec<Isometry3<f64>> {
    let mut graph = graph.clone();
    graph.relax_matched(None, live);
    let keyframes = graph.chains.keyframes.iter();
    keyframes.map(|(_, keyframe)| keyframe.pose).collect()
}

/// Landmarks as a graph has them, moved, with a deviation along each axis \[m\].
fn moved(graph: &KeyframeGraph, by: &Isometry3<f64>, sd_m: f64) -> LiveEstimates {
    let landmarks = graph.refine().landmarks.into_iter();
    let covariance = Matrix3::from_diagonal_element(sd_m * sd_m);
    LiveEstimates {
        agents: Vec::new(),
        landmarks: landmarks
            .map(|landmark| (landmark.label, by * landmark.position, covariance))
            .collect(),
    }
}

/// Root mean square distance of positions \[m\].
fn off_m(some: &[Isometry3<f64>], others: impl Iterator<Item = Isometry3<f64>>) -> f64 {
    let pairs = some.iter().zip(others);
    let squares = pairs.map(|(a, b)| (a.translation.vector - b.translation.vector).norm_squared());
    (squares.sum::<f64>() / some.len() as f64).sqrt()
}

#[test]
fn the_map_turns_to_where_landmarks_are_estimated() {
    let graph = patrolled(2000);
    let alone = relaxed(&graph, &LiveEstimates::default());
    let turn = Isometry3::rotation(Vector3::z() * 0.01);
    let held = relaxed(&graph, &moved(&graph, &turn, 0.02));
    let there = |pose: &Isometry3<f64>| turn * pose;
    let away_m = off_m(&held, alone.iter().copied());
    let left_m = off_m(&held, alone.iter().map(there));
    assert!(left_m < 0.3 * away_m, "{left_m} m left, {away_m} m gone");
}

#[test]
fn what_is_estimated_far_off_moves_next_to_nothing() {
    let graph = patrolled(2000);
    let alone = relaxed(&graph, &LiveEstimates::default());
    let far = Isometry3::translation(40.0, 0.0, 0.0);
    let mut live = moved(&graph, &far, 0.02);
    live.landmarks.truncate(5);
    let held = relaxed(&graph, &live);
    let away_m = off_m(&held, alone.iter().copied());
    assert!(away_m < 0.1, "{away_m} m");
}
