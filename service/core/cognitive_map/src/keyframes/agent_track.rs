//! An agent's present state in the keyframe graph.

use nalgebra::{Isometry3, Vector6};

use crate::estimator::Calibrated;
use geometry::MotionSum;
use state::NONE;
use state::state_of_struct;

/// The end of an agent's chain of keyframes, and the motion since.
#[derive(Clone, Debug)]
#[allow(
    clippy::struct_excessive_bools,
    reason = "each is a state of its own, in any combination"
)]
pub(super) struct AgentTrack {
    /// Whether its poses are those of the map.
    pub(super) is_in_map: bool,
    /// Pose of its own frame in the map, once known.
    pub(super) own_frame: Option<Isometry3<f64>>,
    /// Whether all motion so far was in the body's x-y plane.
    pub(super) is_planar: bool,
    /// Whether the next keyframe begins a stretch: no motion leads there from the one before.
    pub(super) begins_anew: bool,
    /// Whether it has no keyframe in its session yet.
    pub(super) needs_keyframe: bool,
    /// Whether its next keyframe is the origin of the map.
    pub(super) is_origin: bool,
    /// Its latest keyframe.
    pub(super) newest: u32,
    pub(super) session: u32,
    pub(super) seq: u64,
    pub(super) stamp_ns: i64,
    /// The latest sample at the latest keyframe, and its stamp \[ns\].
    pub(super) until_seq: u64,
    pub(super) until_ns: i64,
    /// Motion since the latest keyframe, with the covariance of its error.
    pub(super) since: MotionSum,
    /// Calibration with which that motion was corrected.
    pub(super) calibrated: Calibrated,
    /// The motion since the latest keyframe when it came to rest, with sample and stamp \[ns\].
    pub(super) rest: Isometry3<f64>,
    pub(super) rest_seq: u64,
    pub(super) rest_ns: i64,
    /// Pose by the estimator.
    pub(super) pose: Isometry3<f64>,
}

state_of_struct!(AgentTrack {
    is_in_map,
    own_frame,
    is_planar,
    begins_anew,
    needs_keyframe,
    is_origin,
    newest,
    session,
    seq,
    stamp_ns,
    until_seq,
    until_ns,
    since,
    calibrated,
    rest,
    rest_seq,
    rest_ns,
    pose
});

impl AgentTrack {
    pub(super) fn new() -> Self {
        Self {
            is_in_map: false,
            own_frame: None,
            is_planar: true,
            begins_anew: true,
            needs_keyframe: true,
            is_origin: false,
            newest: NONE,
            session: 0,
            seq: 0,
            stamp_ns: 0,
            until_seq: 0,
            until_ns: 0,
            since: MotionSum::default(),
            calibrated: Calibrated::default(),
            rest: Isometry3::identity(),
            rest_seq: 0,
            rest_ns: 0,
            pose: Isometry3::identity(),
        }
    }

    /// Appends a motion.
    pub(super) fn go(
        &mut self,
        increment: &Isometry3<f64>,
        variance: &Vector6<f64>,
        calibrated: &Calibrated,
    ) {
        self.since.append(increment, variance);
        self.calibrated = self.calibrated.then(calibrated);
    }
}
