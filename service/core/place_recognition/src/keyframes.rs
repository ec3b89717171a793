//! What place recognition asks of whoever keeps the agents' past poses.

use nalgebra::Isometry3;

/// A sample of an agent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SampleKey {
    /// Number of the agent.
    pub agent: u32,
    /// The agent's session.
    pub session: u32,
    /// Number of the sample within the session.
    pub seq: u64,
}

/// The past poses of the agents, for instance a keyframe graph.
pub trait Keyframes {
    /// Pose in the map at a sample; `None` if it is forgotten, or lies in no map.
    fn pose_at(&self, sample: SampleKey) -> Option<Isometry3<f64>>;

    /// Pose at one sample in the frame of the body at another one; `None` if one of them is
    /// forgotten.
    fn motion_between(&self, from: SampleKey, to: SampleKey) -> Option<Isometry3<f64>>;

    /// Whether an agent, and all agents of the map, move in one horizontal plane.
    fn is_planar(&self, agent: u32) -> bool;
}
