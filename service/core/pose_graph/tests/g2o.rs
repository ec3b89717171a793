//! The g2o text format, and graphs whose optimum another solver has found.

use nalgebra::{Isometry3, Vector3};
use pose_graph::g2o::{G2oError, G2oGraph, LineReason};
use pose_graph::{InvalidInformation, RelaxationSettings};
use proptest::prelude::*;

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
fn a_planar_graph_reads_as_the_format_says() {
    let graph = G2oGraph::read(PLANAR).unwrap();
    assert!(graph.is_planar());
    assert_eq!((graph.poses().len(), graph.edges().len()), (6, 7));
    let first = &graph.edges()[0];
    assert_eq!((first.from, first.to, first.is_odometry()), (0, 1, true));
    assert_eq!(
        first.transform.translation.vector,
        Vector3::new(1.05, 0.02, 0.0)
    );
    assert!((first.transform.rotation.scaled_axis() - Vector3::z() * 1.6).norm() < 1e-12);
    let information = first.information.matrix();
    assert_eq!(
        (
            information[(0, 0)],
            information[(0, 5)],
            information[(5, 5)]
        ),
        (100.0, 5.0, 400.0)
    );
    assert_eq!((information[(2, 2)], information[(3, 3)]), (0.0, 0.0));
    // A node without an entry of its own begins where the first edge to it puts it.
    assert_eq!(graph.poses()[&1], first.transform);
}

#[test]
fn a_spatial_graph_reads_as_the_format_says() {
    let graph = G2oGraph::read(SPATIAL).unwrap();
    assert!(!graph.is_planar());
    assert_eq!((graph.poses().len(), graph.edges().len()), (4, 6));
    let edge = graph
        .edges()
        .iter()
        .find(|edge| (edge.from, edge.to) == (1, 2))
        .unwrap();
    let information = edge.information.matrix();
    assert_eq!(
        (
            information[(0, 5)],
            information[(1, 1)],
            information[(3, 4)]
        ),
        (1.0, 20.0, 5.0)
    );
    assert!((edge.transform.rotation.norm() - 1.0).abs() < 1e-12);
}

#[test]
fn a_bad_line_is_named() {
    let information = "1 0 0 1 0 1";
    for (line, reason) in [
        ("EDGE_XY 0 1 2", LineReason::Kind("EDGE_XY".to_owned())),
        (
            "EDGE_SE2 0 1 2",
            LineReason::Columns {
                expected: 12,
                found: 4,
            },
        ),
        ("VERTEX_SE2 0 x 0 0", LineReason::NotANumber { column: 3 }),
        ("VERTEX_SE2 -1 0 0 0", LineReason::NotAnId { column: 2 }),
        (
            &format!("EDGE_SE2 3 3 0 0 0 {information}"),
            LineReason::Loop,
        ),
        (
            "EDGE_SE2 3 4 0 0 0 1 0 0 -1 0 1",
            InvalidInformation::Negative.into(),
        ),
        ("VERTEX_XY 3 0 0", LineReason::PoseAndPoint(3)),
        (
            "EDGE_SE2_XY 9 8 0 0 1 0",
            LineReason::Columns {
                expected: 8,
                found: 7,
            },
        ),
        (
            "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1",
            LineReason::Mixed { so_far: "planar" },
        ),
    ] {
        let text = format!("{PLANAR}# a comment\n{line}\n");
        assert_eq!(
            G2oGraph::read(&text),
            Err(G2oError::Line { line: 10, reason }),
            "{line}"
        );
    }
    let no_direction = "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 0";
    let reason = LineReason::NoDirection;
    assert_eq!(
        G2oGraph::read(no_direction),
        Err(G2oError::Line { line: 1, reason })
    );
    assert_eq!(G2oGraph::read("VERTEX_SE2 0 0 0 0"), Err(G2oError::NoEdge));
    let nowhere = format!("{PLANAR}FIX 0 42\n");
    assert_eq!(G2oGraph::read(&nowhere), Err(G2oError::HeldNowhere(42)));
    let reason = LineReason::UnknownSensor(3);
    let unmounted = "EDGE_SE3_TRACKXYZ 0 9 3 1 2 3 1 0 0 1 0 1";
    assert_eq!(
        G2oGraph::read(unmounted),
        Err(G2oError::Line { line: 1, reason })
    );
}

/// χ² and positions at the optimum. The constants come from gtsam 4.3.0, with `gtsam.readG2o` on
/// the texts above (each further node with a `VERTEX` line of its own), a prior of sd 1e-6 at the
/// first pose, and
///
/// ```python
/// start = gtsam.InitializePose3.initialize(graph)  # planar: the chain of the odometry edges
/// params = gtsam.LevenbergMarquardtParams()
/// params.setRelativeErrorTol(1e-14); params.setAbsoluteErrorTol(1e-14)
/// optimum = gtsam.LevenbergMarquardtOptimizer(graph, start, params).optimize()
/// print(2 * graph.error(optimum), [optimum.atPose3(k).translation() for k in (1, 2, 3)])
/// ```
#[test]
fn the_optimum_is_that_of_gtsam() {
    let planar: [[f64; 3]; 5] = [
        [1.051_419_21, 0.029_506_83, 0.0],
        [1.078_692_32, 0.988_461_98, 0.0],
        [0.074_641_85, 0.935_480_48, 0.0],
        [0.097_138_65, -0.068_069_42, 0.0],
        [1.116_981_83, 0.018_696_68, 0.0],
    ];
    let spatial = [
        [0.854_025_92, 0.307_342_35, 0.010_760_66],
        [1.220_372_12, 0.816_510_32, 0.348_197_25],
        [1.624_609_84, 1.376_669_77, 0.941_785_18],
    ];
    for (text, chi_squared, positions) in [
        (PLANAR, 2.213_048_826, &planar[..]),
        (SPATIAL, 23.050_535_008, &spatial[..]),
    ] {
        let (mut graph, ids, _) = G2oGraph::read(text).unwrap().to_pose_graph();
        graph.relax(&RelaxationSettings {
            tolerance: 1e-9,
            ..RelaxationSettings::default()
        });
        let found = graph.chi_squared();
        assert!((found - chi_squared).abs() < 1e-4 * chi_squared, "{found}");
        for (position, id) in positions.iter().zip(ids.values().skip(1)) {
            let error = (graph.pose(*id).translation.vector - Vector3::from(*position)).norm();
            assert!(error < 1e-3, "{error}");
        }
    }
}

proptest! {
    #[test]
    fn what_is_read_of_any_text_hangs_together(
        lines in prop::collection::vec(
            "(EDGE_SE2|VERTEX_SE2|FIX|EDGE_SE2_XY|EDGE_SE3:QUAT)( [0-3]| 1e9| -0.5){1,12}",
            0..4,
        ),
        noise in "[-+0-9.eE_FIXDGS# ]{0,9}",
    ) {
        let text = lines.join("\n") + &noise;
        if let Ok(graph) = G2oGraph::read(&text) {
            let is_known = |id: &u64| graph.poses().contains_key(id);
            for edge in graph.edges() {
                prop_assert!(is_known(&edge.from) && is_known(&edge.to));
            }
            let position = |pose: &Isometry3<f64>| pose.translation.vector;
            let positions: Vec<_> = graph.poses().values().map(position).collect();
            prop_assert!(positions.iter().flatten().all(|x| x.is_finite()));
        }
    }

    #[test]
    fn any_text_is_answered_and_nothing_is_made_up(
        text in "(EDGE_SE2|VERTEX_SE2|EDGE_SE3:QUAT|EDGE_SE2_XY|FIX|[-+0-9.e# \n]{0,9}){0,20}",
    ) {
        if let Ok(graph) = G2oGraph::read(&text) {
            let n_words = text.split_whitespace().count();
            prop_assert!(graph.poses().len() + graph.edges().len() <= n_words);
        }
    }
}
