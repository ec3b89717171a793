//! Waypoints: where ways meet.

use nalgebra::Isometry3;

use crate::memory::ids::PlaceId;
use state::{Unstored, state_of_struct};

/// A place that ways lead to. It stays while they do, also when the place is forgotten.
#[derive(Clone, Debug)]
pub struct Waypoint {
    pub(super) place: PlaceId,
    pub(super) pose: Isometry3<f64>,
    /// By what a forgotten place goes with the past of its founder.
    pub(crate) attachment: Option<u32>,
    /// The ways, by the number of the place that they lead to.
    pub(super) edges: Vec<Edge>,
}

state_of_struct!(Waypoint {
    place,
    pose,
    attachment,
    edges as Unstored,
});

/// A way as it is seen from one of its ends: what a search needs of it, in one piece of memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Edge {
    /// The place that it leads to.
    pub(crate) place: PlaceId,
    /// The waypoint there.
    pub(crate) to: u32,
    pub(crate) way: u32,
    /// Whether it was travelled in this direction.
    pub(crate) travelled: bool,
    /// Where it leads, rounded: a search asks it of many places at which it does not look.
    pub(crate) near: [f32; 3],
    /// Length in whole micrometres, rounded up: one at least.
    pub(crate) length_um: u64,
}

impl Edge {
    /// An edge that is not brought up to date with its way yet.
    pub(super) fn new(place: PlaceId, to: u32, way: u32) -> Self {
        Self {
            place,
            to,
            way,
            travelled: false,
            near: [0.0; 3],
            length_um: 1,
        }
    }
}

impl Waypoint {
    /// The place, which may have been forgotten.
    pub fn place(&self) -> PlaceId {
        self.place
    }

    /// Where it is in `map`, with the orientation of its founder at the founding.
    pub fn pose(&self) -> &Isometry3<f64> {
        &self.pose
    }

    /// Its ways, by the number of the place that they lead to.
    pub(crate) fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// The edge to a place.
    pub(crate) fn edge_to(&self, place: PlaceId) -> Option<&Edge> {
        Some(&self.edges[self.rank(place).ok()?])
    }

    /// Where the edge to a place is among the edges, or would be.
    pub(super) fn rank(&self, place: PlaceId) -> Result<usize, usize> {
        self.edges.binary_search_by_key(&place, |edge| edge.place)
    }
}
