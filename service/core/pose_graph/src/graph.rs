//! Nodes and the links between them.

use nalgebra::{Isometry3, Point3};

use super::calibration::Calibration;
use super::elimination::number;
use super::kernel::Kernel;
use super::link::{Link, LinkId};
use super::node::{CalibrationId, Freedom, Lengths, Node, PointId, PoseId, Veer};
use state::Digest;

/// A graph of poses and points with the measurements between them.
///
/// Nodes and links are only ever added, and keep their numbers. A link may be switched off: it then
/// says nothing, until it is switched on again.
#[derive(Clone, Debug, Default)]
pub struct PoseGraph {
    pub(super) nodes: Vec<Node>,
    pub(super) links: Vec<LinkSlot>,
    /// For each node its links and the other nodes of each: one of them twice if there is no
    /// second, the node itself if there is none.
    pub(super) links_of: Vec<Vec<(u32, [u32; 2])>>,
}

/// A link and how it counts.
#[derive(Clone, Debug)]
pub(super) struct LinkSlot {
    pub(super) link: Link,
    pub(super) kernel: Kernel,
    pub(super) is_on: bool,
}

/// Why a link does not belong to a graph.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidLink {
    /// A node of another graph.
    #[error("the map has no such node")]
    UnknownNode,
    /// Nothing can be measured from itself.
    #[error("the link joins a node with itself")]
    Loop,
}

impl PoseGraph {
    /// A graph without nodes.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a pose where it is supposed to be.
    pub fn add_pose(&mut self, pose: Isometry3<f64>, freedom: Freedom) -> PoseId {
        PoseId(self.add_node(Node::pose(pose, freedom)))
    }

    /// Adds a point where it is supposed to be.
    pub fn add_point(&mut self, point: Point3<f64>, freedom: Freedom) -> PointId {
        PointId(self.add_node(Node::point(point, freedom)))
    }

    /// Adds the calibration of a robot's odometry: of a planar one, if it may move in the plane
    /// only.
    pub fn add_calibration(
        &mut self,
        at: &Calibration,
        freedom: Freedom,
        lengths: Lengths,
        veer: Veer,
    ) -> CalibrationId {
        CalibrationId(self.add_node(Node::calibration(at, freedom, lengths, veer)))
    }

    /// Puts a pose somewhere else and says how it may move from now on: so a frame that has turned
    /// out to lie in another is carried there and its origin set free.
    pub fn place_pose(&mut self, id: PoseId, pose: Isometry3<f64>, freedom: Freedom) {
        self.nodes[id.0 as usize] = Node::pose(pose, freedom);
    }

    /// As [`place_pose`](Self::place_pose), for a point.
    pub fn place_point(&mut self, id: PointId, point: Point3<f64>, freedom: Freedom) {
        self.nodes[id.0 as usize] = Node::point(point, freedom);
    }

    /// Adds a link.
    ///
    /// # Errors
    /// It names a node that is not of this graph, or one node twice.
    pub fn add_link(&mut self, link: Link, kernel: Kernel) -> Result<LinkId, InvalidLink> {
        let (from, to) = link.nodes();
        let third = link.calibration();
        if from.max(to).max(third.unwrap_or(0)) as usize >= self.nodes.len() {
            return Err(InvalidLink::UnknownNode);
        }
        if link.joins_two() && from == to {
            return Err(InvalidLink::Loop);
        }
        let id = number(self.links.len());
        let mut join = |node: u32, others| self.links_of[node as usize].push((id, others));
        if let Some(third) = third {
            join(from, [to, third]);
            join(to, [from, third]);
            join(third, [from, to]);
        } else if link.joins_two() {
            join(from, [to; 2]);
            join(to, [from; 2]);
        } else {
            join(from, [from; 2]);
        }
        self.links.push(LinkSlot {
            link,
            kernel,
            is_on: true,
        });
        Ok(LinkId(id))
    }

    /// Makes a link say something else of the same nodes.
    ///
    /// # Errors
    /// It names other nodes.
    pub fn restate(&mut self, id: LinkId, link: Link) -> Result<(), InvalidLink> {
        let slot = &mut self.links[id.0 as usize];
        let nodes = |link: &Link| (link.nodes(), link.calibration());
        if nodes(&slot.link) != nodes(&link) {
            return Err(InvalidLink::UnknownNode);
        }
        slot.link = link;
        Ok(())
    }

    /// Makes a link say nothing.
    pub fn switch_off(&mut self, link: LinkId) {
        self.links[link.0 as usize].is_on = false;
    }

    /// Makes a link count again.
    pub fn switch_on(&mut self, link: LinkId) {
        self.links[link.0 as usize].is_on = true;
    }

    /// Where a pose is.
    pub fn pose(&self, id: PoseId) -> &Isometry3<f64> {
        &self.nodes[id.0 as usize].pose
    }

    /// Where a point is.
    pub fn point(&self, id: PointId) -> Point3<f64> {
        self.nodes[id.0 as usize].pose.translation.vector.into()
    }

    /// A calibration.
    pub fn calibration(&self, id: CalibrationId) -> Calibration {
        Calibration::of_place(&self.nodes[id.0 as usize].pose)
    }

    /// Whether a pose stays where it is.
    pub fn is_held(&self, id: PoseId) -> bool {
        self.nodes[id.0 as usize].freedom() == Freedom::Held
    }

    /// Whether no pose moves out of the plane.
    pub fn is_planar(&self) -> bool {
        let mut poses = self.nodes.iter().filter(|node| node.is_pose());
        poses.all(|node| node.freedom() != Freedom::Full)
    }

    /// The links that count, in the order in which they were added.
    pub fn links(&self) -> impl Iterator<Item = &Link> {
        let on = self.links.iter().filter(|slot| slot.is_on);
        on.map(|slot| &slot.link)
    }

    /// The poses, in the order in which they were added.
    pub fn poses(&self) -> impl Iterator<Item = (PoseId, &Isometry3<f64>)> {
        let nodes = (0..).zip(&self.nodes).filter(|(_, node)| node.is_pose());
        nodes.map(|(number, node)| (PoseId(number), &node.pose))
    }

    /// The points, in the order in which they were added.
    pub fn points(&self) -> impl Iterator<Item = (PointId, Point3<f64>)> {
        let nodes = (0..).zip(&self.nodes).filter(|(_, node)| node.is_point());
        nodes.map(|(number, node)| (PointId(number), node.pose.translation.vector.into()))
    }

    /// Number of links, those switched off among them.
    pub fn n_links(&self) -> usize {
        self.links.len()
    }

    /// χ²: the cost of all links, each by its kernel. Twice the negative log-likelihood, up to a
    /// constant.
    pub fn chi_squared(&self) -> f64 {
        self.cost(|node| &self.nodes[node as usize].pose, 1.0)
    }

    /// Squared Mahalanobis error of one link, without its kernel.
    pub fn squared_error(&self, link: LinkId) -> f64 {
        let link = &self.links[link.0 as usize].link;
        link.squared_error(|node| &self.nodes[node as usize].pose)
    }

    /// Whether a link counts.
    pub fn is_on(&self, link: LinkId) -> bool {
        self.links[link.0 as usize].is_on
    }

    /// Digest of where all nodes are and of which links count: equal digests, equal graphs, to the
    /// last bit.
    pub fn digest(&self) -> Digest {
        let mut bytes = Vec::with_capacity(self.nodes.len() * 56 + self.links.len());
        for node in &self.nodes {
            let coordinates = node.pose.translation.vector.iter();
            for number in coordinates.chain(node.pose.rotation.coords.iter()) {
                bytes.extend(number.to_le_bytes());
            }
        }
        bytes.extend(self.links.iter().map(|slot| u8::from(slot.is_on)));
        Digest::of(&bytes)
    }

    /// χ² with the nodes at these poses.
    pub(super) fn cost<'a>(&self, pose: impl Fn(u32) -> &'a Isometry3<f64>, widening: f64) -> f64 {
        let mut sum = 0.0;
        for slot in self.links.iter().filter(|slot| slot.is_on) {
            let s = slot.link.squared_error(&pose);
            sum += slot.kernel.cost_and_weight(s, widening).0;
        }
        sum
    }

    fn add_node(&mut self, node: Node) -> u32 {
        let id = number(self.nodes.len());
        self.nodes.push(node);
        self.links_of.push(Vec::new());
        id
    }
}
