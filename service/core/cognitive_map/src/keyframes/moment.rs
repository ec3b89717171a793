//! A moment of an agent.

use nalgebra::Isometry3;

/// A moment of an agent.
#[derive(Clone, Copy, Debug)]
pub struct Moment {
    /// Number of the agent.
    pub agent: u32,
    /// Number of the sample within the agent's session.
    pub seq: u64,
    /// Its stamp \[ns\].
    pub stamp_ns: i64,
    /// Pose of the agent after it, in the frame in which it is estimated: the initial value of
    /// relaxations.
    pub pose: Isometry3<f64>,
}
