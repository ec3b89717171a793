//! Constraints of a keyframe's pose, by the map or by another keyframe.

use nalgebra::Isometry3;

use geometry::PoseCovariance;
use state::{CorruptState, State, StateReader, StateWriter, state_of_struct};

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
    /// The keyframe in whose frame the other one lies; [`NONE`](state::NONE) for the map.
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
    /// Whether it is a loop closure.
    pub(super) fn is_match(&self) -> bool {
        matches!(
            self.state,
            ClosureState::Pending | ClosureState::Accepted | ClosureState::Refuted
        )
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

impl State for ClosureState {
    fn write(&self, out: &mut StateWriter) {
        (*self as u8).write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(match u8::read(input)? {
            0 => Self::Origin,
            1 => Self::Stated,
            2 => Self::Pending,
            3 => Self::Accepted,
            4 => Self::Refuted,
            _ => return Err(CorruptState::Invalid),
        })
    }
}
