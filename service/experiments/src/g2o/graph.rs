//! A pose graph in memory.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io;
use std::path::Path;

use cognitive_map::experience::{Freedom, PoseInformation, PositionInformation};
use nalgebra::{Isometry3, Point3, Vector3};

use super::error::G2oError;
use super::parse::parse;

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
pub struct PoseGraph {
    pub(super) is_planar: bool,
    pub(super) poses: BTreeMap<u64, Isometry3<f64>>,
    pub(super) edges: Vec<Edge>,
    /// Points that have an entry.
    pub(super) points: BTreeMap<u64, Point3<f64>>,
    pub(super) point_edges: Vec<PointEdge>,
    pub(super) held: BTreeSet<u64>,
}

impl PoseGraph {
    /// Reads a file.
    ///
    /// # Errors
    /// It cannot be read (as [`io::Error`]), or as [`PoseGraph::read`] (within one of the kind `InvalidData`).
    pub fn load(path: &Path) -> Result<Self, io::Error> {
        let text = fs::read_to_string(path)?;
        Self::read(&text).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
    }

    /// Reads a text. A node that has edges and no entry of its own begins where the first edge to it from an earlier
    /// node puts it, or else at the origin.
    ///
    /// # Errors
    /// A line is no entry of the format, or there is no edge.
    pub fn read(text: &str) -> Result<Self, G2oError> {
        let mut graph = parse(text)?;
        graph.edges.sort_by_key(|edge| edge.from.max(edge.to));
        for edge in &graph.edges {
            let from = *graph
                .poses
                .entry(edge.from)
                .or_insert_with(Isometry3::identity);
            graph
                .poses
                .entry(edge.to)
                .or_insert_with(|| from * edge.transform);
        }
        for edge in &graph.point_edges {
            graph
                .poses
                .entry(edge.pose)
                .or_insert_with(Isometry3::identity);
        }
        Ok(graph)
    }

    /// Whether the graph lies in the plane.
    pub fn is_planar(&self) -> bool {
        self.is_planar
    }

    /// Poses by id, as the file gives them.
    pub fn poses(&self) -> &BTreeMap<u64, Isometry3<f64>> {
        &self.poses
    }

    /// Edges between poses, sorted by the later of their ends: the order in which a robot would have measured them. Those
    /// with the same later end are in the order of the file.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Sightings of points, in the order of the file.
    pub fn point_edges(&self) -> &[PointEdge] {
        &self.point_edges
    }

    /// How a node of this graph may move.
    pub fn freedom(&self) -> Freedom {
        if self.is_planar {
            Freedom::Planar
        } else {
            Freedom::Full
        }
    }
}
