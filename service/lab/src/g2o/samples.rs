//! A pose graph as the robot would have sent it.

use std::collections::BTreeMap;

use cogmap_proto::{Relation, Target};
use nalgebra::{Isometry3, SMatrix, SVector};
use pose_graph::g2o::{Edge, G2oGraph, PointEdge};

use crate::stream::{Stream, motion_noise, seen_pose};

/// Time between two poses \[ns\].
const PERIOD_NS: i64 = 1_000_000_000;

/// Why a graph is no robot's recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UnfitGraph {
    /// It has no pose.
    #[error("there is no pose")]
    Empty,
    /// Nothing says how the robot came to a pose.
    #[error("no edge leads from the pose before to the pose {0}")]
    NoMotion(u64),
}

/// The graph pose by pose, in the order of their ids and a second apart, from a start pose on. The
/// first edge from a pose to the next is the motion. Any other edge is a sighting of what the robot
/// was at the earlier of its poses, by what it is at the later one; points are landmarks, named by
/// their ids. Samples state standard deviations only: of an information matrix, those of its
/// inverse.
///
/// # Errors
/// There is no pose, or one that no motion reaches.
pub fn stream(graph: &G2oGraph, start: &Isometry3<f64>) -> Result<Stream, UnfitGraph> {
    let mut edges: BTreeMap<u64, Vec<&Edge>> = BTreeMap::new();
    for edge in graph.edges() {
        edges.entry(edge.from.max(edge.to)).or_default().push(edge);
    }
    let mut seen: BTreeMap<u64, Vec<&PointEdge>> = BTreeMap::new();
    for edge in graph.point_edges() {
        seen.entry(edge.pose).or_default().push(edge);
    }
    let mut stream = Stream::default();
    // Numbers of the samples by which the robot came to its poses.
    let mut reached: BTreeMap<u64, u64> = BTreeMap::new();
    let mut before = None;
    for (&id, stamp_ns) in graph.poses().keys().zip((0..).map(|k: i64| k * PERIOD_NS)) {
        let mut edges = edges.remove(&id).unwrap_or_default();
        let number = match before {
            None => stream.start(stamp_ns, start),
            Some(before) => {
                let moved = |edge: &&Edge| edge.from == before && edge.to == id;
                let motion = edges
                    .iter()
                    .position(moved)
                    .ok_or(UnfitGraph::NoMotion(id))?;
                let motion = edges.remove(motion);
                let noise = motion_noise(&deviations(motion.information.matrix()));
                stream.increment(stamp_ns, &motion.transform, Some(noise))
            }
        };
        reached.insert(id, number);
        for edge in edges {
            let target = Target::OwnSample(reached[&edge.from.min(edge.to)]);
            stream.sighting(stamp_ns, target, earlier_pose(edge));
        }
        for edge in seen.remove(&id).unwrap_or_default() {
            let target = Target::Landmark(edge.point.to_string());
            let relation = Relation::Position {
                translation_m: edge.position.into(),
                sd_m: deviations(edge.information.matrix()).into(),
            };
            stream.sighting(stamp_ns, target, relation);
        }
        before = Some(id);
    }
    before.map(|_| stream).ok_or(UnfitGraph::Empty)
}

/// The earlier of an edge's poses, seen from the later one. The noise of a sighting is in the axes
/// of what was seen; of an edge that was measured from the earlier pose it is turned there.
fn earlier_pose(edge: &Edge) -> Relation {
    let information = edge.information.matrix();
    if edge.to < edge.from {
        return seen_pose(&edge.transform, &deviations(information));
    }
    // T⁻¹ exp(−ξ') with ξ' = Ad(T) ξ, where the edge says T exp(ξ).
    let back = geometry::se3::adjoint(&edge.transform.inverse());
    let turned = back.transpose() * information * back;
    seen_pose(&edge.transform.inverse(), &deviations(&turned))
}

/// Standard deviations of what was measured; zero of what was not, as across the plane.
fn deviations<const N: usize>(information: &SMatrix<f64, N, N>) -> SVector<f64, N> {
    let mut regular = *information;
    for k in 0..N {
        if information[(k, k)] <= 0.0 {
            regular[(k, k)] = 1.0;
        }
    }
    let covariance = regular
        .cholesky()
        .map_or_else(|| regular, |factor| factor.inverse());
    SVector::from_fn(|k, _| match information[(k, k)] {
        measured if measured > 0.0 => covariance[(k, k)].max(0.0).sqrt(),
        _ => 0.0,
    })
}
