//! A pose graph as a robot would have measured it.

use std::collections::BTreeMap;

use cognitive_map::experience::{ExperienceMap, Freedom, Kernel, Link, LinkId, PoseId};
use nalgebra::Isometry3;

use super::graph::{Edge, PoseGraph};

/// A map to which the nodes of a graph are added one by one, each with the edges to it from nodes that are there: the
/// odometry edge, and loop edges as soon as both of their ends exist.
#[derive(Debug)]
pub struct Feed<'a> {
    graph: &'a PoseGraph,
    waiting: std::collections::btree_map::Iter<'a, u64, Isometry3<f64>>,
    edges: &'a [Edge],
    loop_kernel: Kernel,
    nodes: BTreeMap<u64, PoseId>,
    links: Vec<LinkId>,
}

impl<'a> Feed<'a> {
    /// From the first node on. Odometry is taken as right, other edges as the kernel says.
    pub fn new(graph: &'a PoseGraph, loop_kernel: Kernel) -> Self {
        Self {
            graph,
            waiting: graph.poses().iter(),
            edges: graph.edges(),
            loop_kernel,
            nodes: BTreeMap::new(),
            links: Vec::new(),
        }
    }

    /// Adds the next node to `map`, which is the same in every call. The first is held where the file has it; others begin
    /// where the odometry edge puts them, or else another edge from a node that is there, or else the file.
    pub fn step(&mut self, map: &mut ExperienceMap) -> Option<PoseId> {
        let (&id, pose) = self.waiting.next()?;
        let n_now = self
            .edges
            .iter()
            .take_while(|edge| edge.from.max(edge.to) == id)
            .count();
        let (arriving, later) = self.edges.split_at(n_now);
        self.edges = later;
        let leading = arriving.iter().find(|edge| edge.is_odometry());
        let leading = leading.or_else(|| arriving.iter().find(|edge| edge.to == id));
        let start = leading.map_or(*pose, |edge| {
            map.pose(self.nodes[&edge.from]) * edge.transform
        });
        let is_first = self.nodes.is_empty();
        let freedom = if is_first {
            Freedom::Held
        } else {
            self.graph.freedom()
        };
        let node = map.add_pose(start, freedom);
        self.nodes.insert(id, node);
        for edge in arriving {
            self.add_edge(edge, map);
        }
        Some(node)
    }

    fn add_edge(&mut self, edge: &Edge, map: &mut ExperienceMap) {
        let link = Link::Between {
            from: self.nodes[&edge.from],
            to: self.nodes[&edge.to],
            transform: edge.transform,
            information: edge.information,
        };
        let kernel = if edge.is_odometry() {
            Kernel::Gaussian
        } else {
            self.loop_kernel
        };
        let id = map
            .add_link(link, kernel)
            .expect("an edge has two ends, and both are there");
        self.links.push(id);
    }

    /// The nodes that are there, by id.
    pub fn nodes(&self) -> &BTreeMap<u64, PoseId> {
        &self.nodes
    }

    /// The links that are there, in the order of the graph's edges.
    pub fn links(&self) -> &[LinkId] {
        &self.links
    }
}
