//! A moment that is remembered.

use nalgebra::Isometry3;

use crate::estimator::Calibrated;
use geometry::PoseCovariance;
use state::state_of_struct;

/// Where an agent was at a moment, and how it came there from the moment before.
#[derive(Clone, Debug)]
pub(super) struct Keyframe {
    pub(super) agent: u32,
    /// The agent's keyframes before and after.
    pub(super) previous: u32,
    pub(super) next: u32,
    /// The first sighting made here, the first that shows the agent here, the first constraint that ends here.
    pub(super) sightings: u32,
    pub(super) shown: u32,
    pub(super) constraints: u32,
    /// The first thing that lies beside it.
    pub(super) attachments: u32,
    /// The run of the agent.
    pub(super) session: u32,
    /// The samples from which and up to which the agent was here.
    pub(super) seq: u64,
    pub(super) until_seq: u64,
    /// The instants of these \[ns\].
    pub(super) stamp_ns: i64,
    pub(super) until_ns: i64,
    /// Whether the pose is one in the map, and not in a frame of the agent's own.
    pub(super) is_in_map: bool,
    /// Where the agent was thought to be.
    pub(super) pose: Isometry3<f64>,
    /// The motion from the keyframe before, with the covariance of its error.
    pub(super) motion: Isometry3<f64>,
    pub(super) covariance: PoseCovariance,
    /// How the motion was corrected.
    pub(super) calibrated: Calibrated,
    /// Whether it begins a stretch: no motion leads there from the keyframe before.
    pub(super) begins: bool,
    /// How far the way there deviates from an even motion, from what was thinned out of it \[m\].
    pub(super) unevenness_m: f64,
}

state_of_struct!(Keyframe {
    agent,
    previous,
    next,
    sightings,
    shown,
    constraints,
    attachments,
    session,
    seq,
    until_seq,
    stamp_ns,
    until_ns,
    is_in_map,
    pose,
    motion,
    covariance,
    calibrated,
    begins,
    unevenness_m
});
