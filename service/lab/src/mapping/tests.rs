//! Recordings with false matches, and recordings that are odd.

use std::fmt::Write as _;

use nalgebra::Vector3;
use proptest::prelude::*;

use super::{CausalRun, Recording, Refined, Verdict};
use crate::g2o::recording;
use pose_graph::g2o::G2oGraph;

/// Poses of one round.
const ROUND: u64 = 20;

/// Three rounds with steps of 1 m, whose odometry turns too far, and a match with the round before
/// at every pose. Information is that of 0.1 m and 0.02 rad.
fn rounds() -> String {
    let mut text = String::new();
    let turn = std::f64::consts::TAU / ROUND as f64;
    for k in 1..3 * ROUND {
        let too_far = turn + 0.01;
        writeln!(
            text,
            "EDGE_SE2 {} {k} 1 0 {too_far} 100 0 0 100 0 2500",
            k - 1
        )
        .unwrap();
        if k >= ROUND {
            writeln!(text, "EDGE_SE2 {} {k} 0 0 0 100 0 0 100 0 2500", k - ROUND).unwrap();
        }
    }
    text
}

fn read(text: &str) -> Recording {
    recording(&G2oGraph::read(text).unwrap())
}

fn causal(recording: &Recording) -> (Vec<Vector3<f64>>, Verdict) {
    let mut run = CausalRun::new(recording);
    while run.step().is_some() {}
    let positions = run.poses().iter().map(|pose| pose.translation.vector);
    (positions.collect(), run.verdict())
}

fn largest(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    let apart = a.iter().zip(b).map(|(a, b)| (a - b).norm());
    apart.fold(0.0, f64::max)
}

fn positions(refined: &Refined) -> Vec<Vector3<f64>> {
    let positions = refined.poses.iter().map(|pose| pose.translation.vector);
    positions.collect()
}

#[test]
fn false_matches_are_left_out_and_the_map_is_the_one_without_them() {
    let clean = read(&rounds());
    let mut text = rounds();
    // Half as many false matches as true ones, each between places on different sides of the round.
    for k in 0..20 {
        let (from, to) = (k, k + 2 * ROUND - 7 - k % 3);
        writeln!(text, "EDGE_SE2 {from} {to} 0.3 -0.2 1.5 100 0 0 100 0 2500").unwrap();
    }
    let doubtful = read(&text);
    let (clean_causal, clean_verdict) = causal(&clean);
    let (doubtful_causal, verdict) = causal(&doubtful);
    assert_eq!(
        (clean_verdict.n_accepted(), clean_verdict.n_rejected()),
        (40, 0)
    );
    assert_eq!((verdict.n_accepted(), verdict.n_rejected()), (40, 20));
    assert!(largest(&clean_causal, &doubtful_causal) < 1e-9);
    let with_all = Refined::of(&clean, Some(&clean_verdict));
    let refined = Refined::of(&doubtful, Some(&verdict));
    assert_eq!(refined.verdict, verdict);
    assert!(largest(&positions(&with_all), &positions(&refined)) < 1e-3);
    assert!((refined.chi_squared - with_all.chi_squared).abs() < 1e-3 * with_all.chi_squared);
    // Taken at their word they would have bent the map.
    assert!(refined.chi_squared_of_all.unwrap() > 100.0 * with_all.chi_squared);
    // The matches find the false ones out among themselves, too.
    assert_eq!(Refined::of(&doubtful, None).verdict, verdict);
}

#[test]
fn false_matches_that_come_first_and_agree_do_not_stay() {
    let mut text = rounds();
    for k in 0..4 {
        let (from, to) = (k, ROUND - 6 + k);
        writeln!(text, "EDGE_SE2 {from} {to} -4 0 1 4 0 0 4 0 36").unwrap();
    }
    let recording = read(&text);
    let (estimate, verdict) = causal(&recording);
    let refined = Refined::of(&recording, Some(&verdict));
    let last = estimate.len() - 1;
    let off = (estimate[last] - positions(&refined)[last]).norm();
    assert!(off < 0.3, "{off}");
    assert_eq!(
        (refined.verdict.n_accepted(), refined.verdict.n_rejected()),
        (40, 4)
    );
}

#[test]
fn the_same_recording_gives_the_same_bits() {
    let mut text = rounds();
    text.push_str("EDGE_SE2 2 33 5 5 1 100 0 0 100 0 2500\n");
    let run = || {
        let recording = read(&text);
        let (estimate, verdict) = causal(&recording);
        (estimate, Refined::of(&recording, Some(&verdict)).digest)
    };
    assert_eq!(run(), run());
}

#[test]
fn odd_graphs_are_relaxed_as_far_as_they_say_something() {
    for (what, text) in [
        (
            "an edge twice",
            "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nEDGE_SE2 0 1 1.2 0 0 1 0 0 1 0 1\n",
        ),
        (
            "edges before their nodes",
            "EDGE_SE2 1 2 1 0 0 1 0 0 1 0 1\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nVERTEX_SE2 2 9 9 0\nVERTEX_SE2 0 0 0 0\n",
        ),
        (
            "two parts without a link between them",
            "VERTEX_SE2 7 5 5 1\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nEDGE_SE2 7 8 1 0 0 1 0 0 1 0 1\nEDGE_SE2 8 9 1 0 0 1 0 0 1 0 1\nEDGE_SE2 7 9 2 0 0 1 0 0 1 0 1\n",
        ),
        (
            "information about one direction",
            "EDGE_SE2 0 1 1 0 0 1 0 0 0 0 0\nEDGE_SE2 1 2 1 0 0 1 0 0 0 0 0\nEDGE_SE2 0 2 2 0 0 1 0 0 0 0 0\n",
        ),
        (
            "no information",
            "EDGE_SE2 0 1 1 0 0 0 0 0 0 0 0\nEDGE_SE2 0 2 1 0 0 0 0 0 0 0 0\n",
        ),
        (
            "held nodes",
            "FIX 2\nVERTEX_SE2 2 5 5 0\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nEDGE_SE2 1 2 1 0 0 1 0 0 1 0 1\n",
        ),
        (
            "landmarks",
            "FIX 9\nVERTEX_XY 9 1 2\nEDGE_SE2_XY 0 9 1 2 10 0 10\nEDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nEDGE_SE2_XY 1 9 0 2 10 0 10\n",
        ),
        (
            "only landmarks",
            "EDGE_SE2_XY 0 9 1 2 10 0 10\nEDGE_SE2_XY 1 9 0 2 10 0 10\nEDGE_SE2_XY 1 8 1 1 10 0 10\nEDGE_SE2_XY 0 8 2 1 10 0 10\n",
        ),
        (
            "points in space",
            "PARAMS_SE3OFFSET 0 0 0 1 0 0 0 1\nEDGE_SE3_TRACKXYZ 0 9 0 1 2 3 1 0 0 1 0 1\nEDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\nEDGE_SE3_TRACKXYZ 1 9 0 0 2 3 1 0 0 1 0 1\n",
        ),
        (
            "ids far apart",
            "EDGE_SE2 0 18446744073709551615 1 0 0 1 0 0 1 0 1\n",
        ),
    ] {
        let recording = read(text);
        let (estimate, verdict) = causal(&recording);
        let refined = Refined::of(&recording, Some(&verdict));
        let all = estimate
            .iter()
            .chain(&positions(&refined))
            .all(|p| p.norm() < 100.0);
        assert!(all, "{what}: {estimate:?}, {:?}", refined.poses);
        assert_eq!(refined.poses.len(), recording.steps.len());
        assert!(
            refined.chi_squared < 50.0,
            "{what}: {}",
            refined.chi_squared
        );
    }
}

/// The held node pulls: by 0.5 m the two steps of 1 m give way alike.
#[test]
fn a_held_node_stays_and_the_others_come() {
    let text = "FIX 2\nFIX 0\nVERTEX_SE2 2 3 0 0\nVERTEX_SE2 0 0 0 0\n\
        EDGE_SE2 0 1 1 0 0 1 0 0 1 0 100\nEDGE_SE2 1 2 1 0 0 1 0 0 1 0 100\n";
    let recording = read(text);
    let refined = Refined::of(&recording, None);
    let expected = [0.0, 1.5, 3.0].map(|x| Vector3::new(x, 0.0, 0.0));
    assert!(largest(&positions(&refined), &expected) < 1e-6);
    let (estimate, _) = causal(&recording);
    assert!((estimate[2].x - 3.0).abs() < 1e-12);
}

/// The sensor looks along −x of the body from 1 m above it.
#[test]
fn a_sensor_is_where_its_entry_puts_it() {
    let text = "PARAMS_SE3OFFSET 4 0 0 1 0 0 1 0\nVERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nEDGE_SE3_TRACKXYZ 0 9 4 2 0 0 1 0 0 4 0 9\n";
    let refined = Refined::of(&read(text), None);
    assert!((refined.landmarks[0].coords - Vector3::new(-2.0, 0.0, 1.0)).norm() < 1e-9);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_small_graph_is_answered(
        edges in prop::collection::vec(
            (
                0..6_u64,
                0..6_u64,
                -3.0..3.0_f64,
                -3.0..3.0_f64,
                -3.0..3.0_f64,
                0.0..100.0_f64,
                0.0..100.0_f64,
            ),
            1..20,
        ),
        sightings in prop::collection::vec(
            (0..6_u64, 10..13_u64, -3.0..3.0_f64, 0.0..10.0_f64),
            0..6,
        ),
    ) {
        let mut text = String::new();
        for (from, to, x, y, turn, a, b) in edges {
            if from != to {
                writeln!(text, "EDGE_SE2 {from} {to} {x} {y} {turn} {a} 0 0 {b} 0 {a}").unwrap();
            }
        }
        for (pose, point, x, information) in sightings {
            writeln!(
                text,
                "EDGE_SE2_XY {pose} {point} {x} 1 {information} 0 {information}"
            )
            .unwrap();
        }
        if let Ok(graph) = G2oGraph::read(&text) {
            let recording = recording(&graph);
            let (estimate, verdict) = causal(&recording);
            let refined = Refined::of(&recording, Some(&verdict));
            prop_assert!(estimate.iter().chain(&positions(&refined)).all(|p| p.norm() < 1e6));
            prop_assert!(refined.chi_squared.is_finite());
        }
    }
}
