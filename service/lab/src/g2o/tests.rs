//! Graphs as what a robot would have sent.

use cogmap_proto::{Relation, SampleBody, Target};
use nalgebra::Isometry3;
use pose_graph::g2o::G2oGraph;

use super::{UnfitGraph, stream};

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

#[test]
fn motion_comes_in_order_and_other_edges_name_the_earlier_pose() {
    let graph = G2oGraph::read(PLANAR).unwrap();
    let stream = stream(&graph, &Isometry3::identity()).unwrap();
    // A start, five motions and two sightings: 0 from 4, and 1 from 5.
    let bodies: Vec<&SampleBody> = stream.samples().iter().map(|sample| &sample.body).collect();
    assert_eq!((bodies.len(), stream.reckoned().len()), (8, 6));
    assert!(matches!(bodies[0], SampleBody::StartPose(_)));
    for (number, earlier) in [(5, 0), (7, 1)] {
        let SampleBody::Sighting(seen) = bodies[number] else {
            panic!("{:?}", bodies[number])
        };
        assert_eq!(seen.target, Target::OwnSample(earlier));
    }
}

/// The edge from 0 to 4 says 0.10, −0.05 and a turn by 0.04: seen from 4, pose 0 is behind. That
/// from 5 to 1 is a sighting as it stands.
#[test]
fn an_edge_is_seen_from_the_later_pose() {
    let graph = G2oGraph::read(PLANAR).unwrap();
    let stream = stream(&graph, &Isometry3::identity()).unwrap();
    let pose = |number: usize| match &stream.samples()[number].body {
        SampleBody::Sighting(seen) => match &seen.relation {
            Relation::Pose {
                translation_m,
                noise,
                ..
            } => (*translation_m, *noise),
            other => panic!("{other:?}"),
        },
        other => panic!("{other:?}"),
    };
    let (behind, noise) = pose(5);
    let (sin, cos) = 0.04_f64.sin_cos();
    assert!(
        (behind[0] - (-0.10 * cos + 0.05 * sin)).abs() < 1e-9,
        "{behind:?}"
    );
    assert!(
        (behind[1] - (0.10 * sin + 0.05 * cos)).abs() < 1e-9,
        "{behind:?}"
    );
    // Its turn is as uncertain from either end; its position more so, by the turn and the lever.
    assert!((noise.rotation_sd_rad[2] - 0.1).abs() < 1e-9);
    assert!(noise.translation_sd_m[0] > 50.0_f64.recip().sqrt());
    assert_eq!(
        (noise.translation_sd_m[2], noise.rotation_sd_rad[0]),
        (0.0, 0.0)
    );
    let (ahead, noise) = pose(7);
    assert!((ahead[0] - 0.05).abs() < 1e-12 && (ahead[1] - 0.08).abs() < 1e-12);
    assert!((noise.translation_sd_m[1] - (50.0_f64 / 2100.0).sqrt()).abs() < 1e-9);
}

#[test]
fn a_graph_with_a_hole_is_no_recording() {
    let text = PLANAR.replace("EDGE_SE2 2 3", "EDGE_SE2 1 3");
    let graph = G2oGraph::read(&text).unwrap();
    let refused = stream(&graph, &Isometry3::identity());
    assert_eq!(refused, Err(UnfitGraph::NoMotion(3)));
}
