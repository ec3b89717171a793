//! Contents of a g2o text.

use std::collections::{BTreeMap, BTreeSet};

use crate::{
    Freedom, Kernel, Link, PointId, PoseGraph, PoseId, PoseInformation, PositionInformation,
    SightingTarget,
};
use nalgebra::{Isometry3, Point3, Vector3};

/// One measured relative pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Id of the pose that measured.
    pub from: u64,
    /// Id of the pose that was measured.
    pub to: u64,
    /// The second pose in the frame of the first.
    pub transform: Isometry3<f64>,
    /// Information in the axes of the second.
    pub information: PoseInformation,
}

impl Edge {
    /// Whether the edge is a step of the robot: from one id to the next.
    pub fn is_odometry(&self) -> bool {
        self.from.checked_add(1) == Some(self.to)
    }
}

/// One point as seen from a pose.
#[derive(Clone, Debug, PartialEq)]
pub struct PointEdge {
    /// Id of the pose that saw.
    pub pose: u64,
    /// Id of the point.
    pub point: u64,
    /// The point in the frame of the pose \[m\].
    pub position: Vector3<f64>,
    /// Information in the axes of the pose.
    pub information: PositionInformation,
}

/// The nodes and edges of one file.
#[derive(Clone, Debug, PartialEq)]
pub struct G2oGraph {
    pub(super) is_planar: bool,
    pub(super) poses: BTreeMap<u64, Isometry3<f64>>,
    pub(super) edges: Vec<Edge>,
    /// Points that have an entry.
    pub(super) points: BTreeMap<u64, Point3<f64>>,
    pub(super) point_edges: Vec<PointEdge>,
    pub(super) held: BTreeSet<u64>,
}

impl G2oGraph {
    /// Whether the graph lies in the plane.
    pub fn is_planar(&self) -> bool {
        self.is_planar
    }

    /// Poses by id, as the file gives them.
    pub fn poses(&self) -> &BTreeMap<u64, Isometry3<f64>> {
        &self.poses
    }

    /// Edges between poses, sorted by the later of their ends: the order in which a robot would
    /// have measured them. Those with the same later end are in the order of the file.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Sightings of points, in the order of the file.
    pub fn point_edges(&self) -> &[PointEdge] {
        &self.point_edges
    }

    /// Points by id that have an entry of their own.
    pub fn points(&self) -> &BTreeMap<u64, Point3<f64>> {
        &self.points
    }

    /// Ids of the nodes that stay where they are.
    pub fn held(&self) -> &BTreeSet<u64> {
        &self.held
    }

    /// How a node of this graph may move.
    pub fn freedom(&self) -> Freedom {
        if self.is_planar {
            Freedom::Planar
        } else {
            Freedom::Full
        }
    }

    /// The graph to be relaxed, and the numbers that its nodes have there. All edges count as right
    /// ([`Kernel::Gaussian`]). Held is what the text says, or else the first pose. A point without
    /// an entry begins where the first edge to it puts it.
    #[expect(
        clippy::missing_panics_doc,
        reason = "edges join two different nodes that are there"
    )]
    pub fn to_pose_graph(&self) -> (PoseGraph, BTreeMap<u64, PoseId>, BTreeMap<u64, PointId>) {
        let mut graph = PoseGraph::new();
        let holds_a_pose = self.held.iter().any(|id| self.poses.contains_key(id));
        let first = self.poses.keys().next().filter(|_| !holds_a_pose);
        let freedom = |id: &u64| {
            if self.held.contains(id) || first == Some(id) {
                Freedom::Held
            } else {
                self.freedom()
            }
        };
        let add_pose =
            |(&id, pose): (&u64, &Isometry3<f64>)| (id, graph.add_pose(*pose, freedom(&id)));
        let poses: BTreeMap<u64, PoseId> = self.poses.iter().map(add_pose).collect();
        let mut points = BTreeMap::new();
        for edge in &self.point_edges {
            points.entry(edge.point).or_insert_with(|| {
                let seen = self.poses[&edge.pose] * Point3::from(edge.position);
                let at = self.points.get(&edge.point).copied().unwrap_or(seen);
                graph.add_point(at, freedom(&edge.point))
            });
        }
        let links = self.edges.iter().map(|edge| Link::Between {
            from: poses[&edge.from],
            to: poses[&edge.to],
            transform: edge.transform,
            information: edge.information,
        });
        let sightings = self.point_edges.iter().map(|edge| Link::Sighting {
            from: poses[&edge.pose],
            target: SightingTarget::Point(points[&edge.point]),
            position: edge.position,
            information: edge.information,
        });
        for link in links.chain(sightings) {
            graph
                .add_link(link, Kernel::Gaussian)
                .expect("edges join two different nodes that are there");
        }
        (graph, poses, points)
    }
}
