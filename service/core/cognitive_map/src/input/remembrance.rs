//! Remembrances: places and ways that another map has had, from an export of it.

use nalgebra::{Isometry3, Vector3, Vector6};

use super::AgentId;
use crate::memory::ids::PlaceId;

/// A place or a way that another map has had.
#[derive(Clone, Debug, PartialEq)]
pub enum Remembrance {
    /// A place.
    Place(RememberedPlace),
    /// The way between two places.
    Way(Box<RememberedWay>),
}

/// A place as another map had it.
#[derive(Clone, Debug, PartialEq)]
pub struct RememberedPlace {
    /// Its number, larger than those of the places before it.
    pub place: PlaceId,
    /// Its pose in `map`.
    pub pose: Isometry3<f64>,
    /// Standard deviation of the position at the founding, along the axes of `map` \[m\].
    pub position_sd_m: Vector3<f64>,
    /// The agent that founded it.
    pub founder: AgentId,
    /// Times an agent came there.
    pub visits: u64,
    /// Stamp of the founding \[ns\].
    pub first_stamp_ns: i64,
    /// Latest stamp of a visit \[ns\].
    pub last_stamp_ns: i64,
    /// Its strength, as it was.
    pub strength: f64,
}

/// A way as another map had it.
#[derive(Clone, Debug, PartialEq)]
pub struct RememberedWay {
    /// The places that it joins, the lower number first.
    pub ends: [PlaceId; 2],
    /// Their poses in `map`.
    pub poses: [Isometry3<f64>; 2],
    /// From the first end to the second, and back.
    pub travelled: [RememberedTraversals; 2],
    /// Mean pose of the second place in the frame of the first, as legs measured it.
    pub relative: Isometry3<f64>,
    /// Variances of one such measurement \[m², rad²\].
    pub variance: Vector6<f64>,
    /// Number of measurements in the mean; one at least.
    pub measurements: u32,
    /// Length of the shortest path that was travelled \[m\].
    pub shortest_m: f64,
    /// Its strength, as it was.
    pub strength: f64,
}

/// How a way was travelled in one direction in another map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RememberedTraversals {
    /// How often; 0 where all below say nothing.
    pub times: u64,
    /// Shortest duration \[s\].
    pub fastest_s: f64,
    /// Mean duration \[s\].
    pub mean_s: f64,
    /// Latest stamp of an end \[ns\].
    pub last_stamp_ns: i64,
}
