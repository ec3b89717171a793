//! Paths: what a search finds.

use crate::memory::way::Edge;

/// Waypoints from start to goal, with what leads to each.
pub(super) type Path = Vec<(u32, Hop)>;

/// What leads to a waypoint.
#[derive(Clone, Copy, Debug)]
pub(super) enum Hop {
    /// The path begins here.
    Start,
    /// A way.
    Way(Edge),
    /// A straight line, with the variance of the position along it and the time that it takes.
    Shortcut { variance_m2: f64, s_per_m: f64 },
}

impl Hop {
    /// The way, if it is one.
    pub(super) fn edge(&self) -> Option<&Edge> {
        match self {
            Self::Way(edge) => Some(edge),
            Self::Start | Self::Shortcut { .. } => None,
        }
    }
}
