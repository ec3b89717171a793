//! Sightings of agents that cannot correct anything yet.

use nalgebra::Point3;

use crate::input::Relation;

/// A sighting of an agent that has not moved up to it yet.
#[derive(Clone, Debug)]
pub(super) struct PendingSighting {
    pub(super) observer: u32,
    pub(super) target: u32,
    pub(super) stamp_ns: i64,
    pub(super) relation: Relation,
}

/// An agent of one frame was seen from another.
#[derive(Clone, Debug)]
pub(super) struct CrossFrameSighting {
    /// Frames of observer and target.
    pub(super) frames: [usize; 2],
    /// Where the target was, in either.
    pub(super) points: [Point3<f64>; 2],
    pub(super) variance: f64,
}
