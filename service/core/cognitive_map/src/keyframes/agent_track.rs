//! An agent's present state in the keyframe graph.

use nalgebra::{Isometry3, Vector6};

use super::keyframe::Keyframe;
use super::moment::Moment;
use super::own_frame::OwnFrame;
use super::tuning;
use crate::estimator::Calibrated;
use geometry::{MotionSum, PoseCovariance, is_within};
use state::NONE;
use state::state_of_struct;

/// The end of an agent's chain of keyframes, and the motion since.
#[derive(Clone, Debug)]
#[allow(
    clippy::struct_excessive_bools,
    reason = "each is a state of its own, in any combination"
)]
pub(super) struct AgentTrack {
    /// Pose of its own frame in the map, once it is in the map.
    pub(super) own_frame: OwnFrame,
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
    /// Whether the calibration is by matches of views: that was so with the latest relaxation which
    /// corrected it.
    pub(super) is_calibrated_by_views: bool,
    /// Whether all its odometry so far states its noise.
    pub(super) states_noise: bool,
    /// Factor of the noise of odometry's rotations, as closures show it, where it is not stated.
    pub(super) turn_noise: f64,
    /// The motion since the latest keyframe when it came to rest, with sample and stamp \[ns\].
    pub(super) rest: Isometry3<f64>,
    pub(super) rest_seq: u64,
    pub(super) rest_ns: i64,
    /// Pose by the estimator.
    pub(super) pose: Isometry3<f64>,
}

state_of_struct!(AgentTrack {
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
    is_calibrated_by_views,
    states_noise,
    turn_noise,
    rest,
    rest_seq,
    rest_ns,
    pose
});

impl AgentTrack {
    pub(super) fn new() -> Self {
        Self {
            own_frame: OwnFrame::default(),
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
            is_calibrated_by_views: false,
            states_noise: true,
            turn_noise: 1.0,
            rest: Isometry3::identity(),
            rest_seq: 0,
            rest_ns: 0,
            pose: Isometry3::identity(),
        }
    }

    /// Whether its poses are those of the map.
    pub(super) fn is_in_map(&self) -> bool {
        self.own_frame.0.is_some()
    }

    /// Whether the motion since the latest keyframe is at most a length and an angle \[m, rad\].
    pub(super) fn is_near(&self, (length_m, angle_rad): (f64, f64)) -> bool {
        is_within(self.since.motion(), length_m, angle_rad)
    }

    /// Notes the present sample and pose of an agent that has not moved.
    pub(super) fn note(&mut self, moment: &Moment) {
        self.pose = moment.pose;
        self.seq = moment.seq;
        self.stamp_ns = self.stamp_ns.max(moment.stamp_ns);
        if !self.needs_keyframe && self.is_near(tuning::REST_WITHIN) {
            (self.until_seq, self.until_ns) = (self.seq, self.stamp_ns);
        }
    }

    /// Appends a motion, with the variances of the error on its right.
    pub(super) fn go(
        &mut self,
        moment: &Moment,
        increment: &Isometry3<f64>,
        variance: &Vector6<f64>,
        calibrated: &Calibrated,
    ) {
        self.since.append(increment, variance);
        self.calibrated = self.calibrated.then(calibrated, &increment.rotation);
        self.states_noise &= calibrated.states_noise;
        self.is_planar &= is_level(increment);
        self.pose = moment.pose;
        (self.seq, self.stamp_ns) = (moment.seq, moment.stamp_ns);
        if self.is_near(tuning::REST_WITHIN) {
            (self.until_seq, self.until_ns) = (moment.seq, moment.stamp_ns);
        }
    }

    /// Notes where the agent came to rest. Answers whether it has rested so long, away from the
    /// latest keyframe, that it needs one there.
    pub(super) fn rests_elsewhere(&mut self, moment: &Moment, attached: (f64, f64)) -> bool {
        if self.rests() {
            return !self.is_near(attached)
                && moment.stamp_ns.saturating_sub(self.rest_ns) >= tuning::REST_NS;
        }
        self.rest = *self.since.motion();
        (self.rest_seq, self.rest_ns) = (moment.seq, moment.stamp_ns);
        false
    }

    /// Whether it is still where it came to rest.
    fn rests(&self) -> bool {
        let moved = self.rest.inv_mul(self.since.motion());
        is_within(&moved, tuning::REST_WITHIN.0, tuning::REST_WITHIN.1)
    }

    /// The next keyframe, where the agent is now.
    pub(super) fn next_keyframe(&self, agent: u32) -> Keyframe {
        // An agent at rest came here earlier.
        let (seq, stamp_ns) = if !self.needs_keyframe && self.rests() {
            (self.rest_seq, self.rest_ns)
        } else {
            (self.seq, self.stamp_ns)
        };
        let mut keyframe = Keyframe {
            agent,
            previous: self.newest,
            next: NONE,
            sightings: NONE,
            shown: NONE,
            constraints: NONE,
            attachments: NONE,
            session: self.session,
            seq,
            until_seq: self.seq,
            stamp_ns,
            until_ns: self.stamp_ns,
            is_in_map: self.is_in_map(),
            pose: self.pose,
            motion: *self.since.motion(),
            covariance: self.since.covariance(),
            calibrated: self.calibrated,
            begins: self.newest == NONE || self.begins_anew,
            unevenness_m: 0.0,
        };
        if keyframe.begins {
            keyframe.motion = Isometry3::identity();
            keyframe.covariance = PoseCovariance::zero();
            keyframe.calibrated = self.calibrated.without_motion();
        }
        keyframe
    }

    /// Begins the motion after its next keyframe, which has this number, first sample and stamp.
    pub(super) fn begin_after(&mut self, number: u32, (seq, stamp_ns): (u64, i64)) {
        self.newest = number;
        self.begins_anew = false;
        self.needs_keyframe = false;
        self.is_origin = false;
        self.since = MotionSum::default();
        self.calibrated = self.calibrated.without_motion();
        (self.until_seq, self.until_ns) = (self.seq, self.stamp_ns);
        self.rest = Isometry3::identity();
        (self.rest_seq, self.rest_ns) = (seq, stamp_ns);
    }
}

/// Whether a motion keeps the plane.
pub(super) fn is_level(motion: &Isometry3<f64>) -> bool {
    let axis = motion.rotation.imag();
    motion.translation.z == 0.0 && axis.x == 0.0 && axis.y == 0.0
}
