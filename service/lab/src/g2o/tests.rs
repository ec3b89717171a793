//! Graphs as recordings, and reference positions.

use nalgebra::Vector3;
use pose_graph::g2o::G2oGraph;

use super::{Reference, ReferenceError, recording};
use crate::mapping::{CausalRun, Refined};

/// A square walked twice, with errors that no arrangement explains.
const PLANAR: &str = "\
VERTEX_SE2 0 0 0 0
EDGE_SE2 0 1 1.05 0.02 1.60 100 0 5 100 0 400
EDGE_SE2 1 2 0.97 -0.03 1.52 100 0 0 100 10 400
EDGE_SE2 2 3 1.02 0.05 1.58 100 0 0 100 0 400
EDGE_SE2 3 4 0.99 -0.01 1.61 100 0 0 100 0 400
EDGE_SE2 4 5 1.01 0.04 1.49 100 0 0 100 0 400
EDGE_SE2 0 4 0.10 -0.05 0.04 50 0 0 50 0 100
EDGE_SE2 5 1 0.05 0.08 -0.10 50 20 0 50 0 100
";

/// A tetrahedron with errors that no arrangement explains.
const SPATIAL: &str = "\
VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1
EDGE_SE3:QUAT 0 1 1 0.1 0 0 0 0.38 0.92 10 0 0 0 0 0 10 0 0 0 0 10 0 0 0 40 0 0 40 0 40
EDGE_SE3:QUAT 1 2 0.9 0 0.2 0.30 0 0 0.95 10 0 0 0 0 1 20 0 0 0 0 10 0 0 0 40 5 0 40 0 40
EDGE_SE3:QUAT 2 3 1.1 0.1 0.1 0 0.45 0 0.89 10 2 0 0 0 0 10 0 0 0 0 10 0 0 0 40 0 0 40 0 80
EDGE_SE3:QUAT 0 2 1.3 0.9 0.2 0.20 0.10 0.40 0.88 10 0 0 0 0 0 10 0 0 0 0 10 0 0 0 40 0 0 40 0 40
EDGE_SE3:QUAT 0 3 1.4 1.5 1.1 0.30 0.60 0.20 0.71 10 0 0 0 0 0 10 0 0 0 0 10 0 0 0 40 0 0 40 0 40
EDGE_SE3:QUAT 3 1 0.2 -1.2 -0.9 -0.5 -0.3 0.1 0.80 10 0 0 0 0 0 10 0 0 0 0 10 0 0 0 40 0 0 40 0 40
";

#[test]
fn a_graph_refined_as_a_whole_ends_at_its_optimum() {
    for (text, chi_squared) in [(PLANAR, 2.213_048_826), (SPATIAL, 23.050_535_008)] {
        let refined = Refined::of(&recording(&G2oGraph::read(text).unwrap()), None);
        assert_eq!(refined.verdict.n_rejected(), 0);
        let found = refined.chi_squared;
        assert!((found - chi_squared).abs() < 1e-4 * chi_squared, "{found}");
    }
}

#[test]
fn a_graph_that_arrives_pose_by_pose_ends_near_its_optimum() {
    for text in [PLANAR, SPATIAL] {
        let recording = recording(&G2oGraph::read(text).unwrap());
        let mut run = CausalRun::new(&recording);
        while run.step().is_some() {}
        assert_eq!(run.verdict().n_rejected(), 0);
        let optimum = Refined::of(&recording, None).chi_squared;
        assert!(run.chi_squared() >= optimum * (1.0 - 1e-4));
        assert!(
            run.chi_squared() < 1.5 * optimum,
            "{} {optimum}",
            run.chi_squared()
        );
    }
}

#[test]
fn a_reference_is_read_by_id() {
    let graph = G2oGraph::read(PLANAR).unwrap();
    let reference = Reference::read("# id x y\n5 1 2\n0 0 0 3 # first\n77 1 1\n").unwrap();
    let positions = reference.of_poses(&graph).unwrap();
    assert_eq!(positions[0], Some(Vector3::new(0.0, 0.0, 3.0)));
    assert_eq!(positions[1], None);
    assert_eq!(positions[5], Some(Vector3::new(1.0, 2.0, 0.0)));
    for bad in ["0 1", "0 1 x", "x 1 2", "0 1 2 3 4", "0 1 inf"] {
        let text = format!("# id\n{bad}\n");
        assert_eq!(
            Reference::read(&text),
            Err(ReferenceError::Line { line: 2 }),
            "{bad}"
        );
    }
    let elsewhere = Reference::read("99 0 0").unwrap();
    assert_eq!(
        elsewhere.of_poses(&graph),
        Err(ReferenceError::NothingInCommon)
    );
}
