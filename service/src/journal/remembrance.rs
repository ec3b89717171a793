//! Places and ways that another map has had, as the journal has them. Variants and fields are added
//! at the end.

use serde::{Deserialize, Serialize};

/// A place or a way that another map has had.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum JournaledRemembrance {
    /// A place.
    Place(JournaledPlace),
    /// The way between two places.
    Way(Box<JournaledWay>),
}

/// A place that another map has had.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JournaledPlace {
    /// Its number.
    pub place: u32,
    /// Its pose in `map`.
    pub pose: JournaledPose,
    /// Standard deviations of its position at the founding \[m\].
    pub position_sd_m: [f64; 3],
    /// Number of the agent that founded it.
    pub founder: u32,
    /// Times an agent came there.
    pub visits: u64,
    /// Stamp of the founding \[ns\].
    pub first_stamp_ns: i64,
    /// Latest stamp of a visit \[ns\].
    pub last_stamp_ns: i64,
    /// Its strength, as it was.
    pub strength: f64,
}

/// A way that another map has had.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JournaledWay {
    /// Numbers of the places, the lower one first.
    pub ends: [u32; 2],
    /// Their poses in `map`.
    pub poses: [JournaledPose; 2],
    /// How it was travelled to the second place, and back; `None` where it never was.
    pub travelled: [Option<JournaledTraversals>; 2],
    /// Mean pose of the second place in the frame of the first.
    pub relative: JournaledPose,
    /// Standard deviations of one such measurement \[m, rad\].
    pub sd: [f64; 6],
    /// Number of measurements in the mean.
    pub measurements: u32,
    /// Length of the shortest path \[m\].
    pub shortest_m: f64,
    /// Its strength, as it was.
    pub strength: f64,
}

/// A pose.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JournaledPose {
    /// Position \[m\].
    pub translation_m: [f64; 3],
    /// Orientation, a unit quaternion `[x, y, z, w]`.
    pub rotation_xyzw: [f64; 4],
}

/// How a way was travelled in one direction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct JournaledTraversals {
    /// How often.
    pub times: u64,
    /// Shortest duration \[s\].
    pub fastest_s: f64,
    /// Mean duration \[s\].
    pub mean_s: f64,
    /// Latest stamp \[ns\].
    pub last_stamp_ns: i64,
}
