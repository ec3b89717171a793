//! Constraints of a keyframe's pose, by the map or by another keyframe.

use nalgebra::{Isometry3, Vector6};

use geometry::PoseCovariance;
use state::{NONE, state_of_enum, state_of_struct};

/// How a constraint counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ClosureState {
    /// Origin of the map: the keyframe does not move.
    Origin,
    /// A stated pose.
    Stated,
    /// A loop closure that waits for others that agree with it.
    Pending,
    /// A loop closure that agrees with the map or with other closures.
    Accepted,
    /// A loop closure that was accepted and then rejected.
    Refuted,
}

/// A relative pose between two keyframes, or between the map and a keyframe.
#[derive(Clone, Debug)]
pub(super) struct Constraint {
    /// The keyframe in whose frame the other one lies; [`NONE`] for the map.
    pub(super) from: u32,
    pub(super) to: u32,
    /// The next constraints that end at these keyframes.
    pub(super) next_from: u32,
    pub(super) next_to: u32,
    pub(super) transform: Isometry3<f64>,
    /// Covariance of the error on the right of the transform.
    pub(super) covariance: PoseCovariance,
    pub(super) state: ClosureState,
}

impl Constraint {
    /// Of a keyframe's pose to the map.
    pub(super) fn to_map(
        keyframe: u32,
        at: Isometry3<f64>,
        covariance: &PoseCovariance,
        state: ClosureState,
    ) -> Self {
        Self {
            from: NONE,
            to: keyframe,
            next_from: NONE,
            next_to: NONE,
            transform: at,
            covariance: *covariance,
            state,
        }
    }

    /// Whether it is a loop closure.
    pub(super) fn is_closure(&self) -> bool {
        self.is_candidate() || self.is_accepted()
    }

    /// Whether it is a loop closure that counts.
    pub(super) fn is_accepted(&self) -> bool {
        self.state == ClosureState::Accepted
    }

    /// Whether it is a loop closure that is pending, or was rejected and may be accepted again.
    pub(super) fn is_candidate(&self) -> bool {
        matches!(self.state, ClosureState::Pending | ClosureState::Refuted)
    }

    /// The number of the constraint after it in the list of a keyframe.
    pub(super) fn next_of(&self, keyframe: u32) -> u32 {
        if self.from == keyframe {
            self.next_from
        } else {
            self.next_to
        }
    }
}

state_of_struct!(Constraint {
    from,
    to,
    next_from,
    next_to,
    transform,
    covariance,
    state
});

state_of_enum!(ClosureState {
    Origin = 0,
    Stated = 1,
    Pending = 2,
    Accepted = 3,
    Refuted = 4,
});

/// The covariance of a motion after another one.
pub(super) fn composed(
    first: &PoseCovariance,
    second_motion: &Isometry3<f64>,
    second: &PoseCovariance,
) -> PoseCovariance {
    let moved = first.after_motion(second_motion, &Vector6::zeros());
    PoseCovariance::from_matrix(&(moved.matrix() + second.matrix()))
}
