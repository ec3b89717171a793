//! A keyframe.

use nalgebra::Isometry3;

use crate::estimator::Calibrated;
use geometry::PoseCovariance;
use state::{Slab, state_of_struct};

/// Keyframes by number.
pub(super) type KeyframeSlab = Slab<Keyframe, 32>;

/// A remembered pose of an agent, and the motion that led there.
#[derive(Clone, Debug)]
pub(super) struct Keyframe {
    pub(super) agent: u32,
    /// The agent's keyframes before and after.
    pub(super) previous: u32,
    pub(super) next: u32,
    /// The heads of its lists: sightings made here, sightings that show the agent here, constraints
    /// that end here.
    pub(super) sightings: u32,
    pub(super) shown: u32,
    pub(super) constraints: u32,
    /// The head of the list of its attachments.
    pub(super) attachments: u32,
    /// The session of the agent.
    pub(super) session: u32,
    /// The first and the last sample here.
    pub(super) seq: u64,
    pub(super) until_seq: u64,
    /// Their stamps \[ns\].
    pub(super) stamp_ns: i64,
    pub(super) until_ns: i64,
    /// Whether the pose is in the map, and not in a frame of the agent's own.
    pub(super) is_in_map: bool,
    /// Pose, by the estimator or by the latest relaxation.
    pub(super) pose: Isometry3<f64>,
    /// Motion from the keyframe before, with the covariance of its error.
    pub(super) motion: Isometry3<f64>,
    pub(super) covariance: PoseCovariance,
    /// Calibration with which the motion was corrected.
    pub(super) calibrated: Calibrated,
    /// Whether it begins a stretch: no motion leads there from the keyframe before.
    pub(super) begins: bool,
    /// Deviation of the way there from an even motion, by keyframes that were removed \[m\].
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
