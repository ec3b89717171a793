//! What ties an anchor to the map or to another anchor.

use nalgebra::Isometry3;

use geometry::PoseCovariance;
use state::{CorruptState, State, StateReader, StateWriter, state_of_struct};

/// How a tie counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Standing {
    /// It is the frame: the anchor does not move.
    Origin,
    /// It was stated and is believed.
    Stated,
    /// It is a match that waits for others that agree with it.
    Pending,
    /// It is a match that agrees with the map or with other matches.
    Accepted,
    /// It is a match that was accepted and then contradicted.
    Refuted,
}

/// A relative pose between two anchors, or between the map and an anchor.
#[derive(Clone, Debug)]
pub(super) struct Tie {
    /// The anchor in whose frame the other one lies; [`NONE`](state::NONE) for the map.
    pub(super) from: u32,
    pub(super) to: u32,
    /// The next ties that end at these anchors.
    pub(super) next_from: u32,
    pub(super) next_to: u32,
    pub(super) transform: Isometry3<f64>,
    /// Of the error on the right of the transform.
    pub(super) covariance: PoseCovariance,
    pub(super) standing: Standing,
}

impl Tie {
    /// Whether it is a match.
    pub(super) fn is_match(&self) -> bool {
        matches!(
            self.standing,
            Standing::Pending | Standing::Accepted | Standing::Refuted
        )
    }
}

state_of_struct!(Tie {
    from,
    to,
    next_from,
    next_to,
    transform,
    covariance,
    standing
});

impl State for Standing {
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
