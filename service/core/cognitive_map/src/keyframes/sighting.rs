//! Sightings from a keyframe.

use nalgebra::Vector3;

use super::observation::Observation;
use state::{CorruptState, NONE, State, StateReader, StateWriter, state_of_struct};

/// What a sighting shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Seen {
    /// A landmark, by number.
    Landmark(u32),
    /// An agent, at this place in the frame of one of its keyframes.
    Agent(u32, Vector3<f64>),
}

/// A position or a distance measured at a keyframe.
#[derive(Clone, Debug)]
pub(super) struct Sighting {
    /// The keyframe from which, and the next sighting made there.
    pub(super) keyframe: u32,
    pub(super) next: u32,
    pub(super) shown: Seen,
    /// The next sighting that shows the same keyframe.
    pub(super) next_shown: u32,
    pub(super) seen: Observation,
}

state_of_struct!(Sighting {
    keyframe,
    next,
    shown,
    next_shown,
    seen
});

impl State for Seen {
    fn write(&self, out: &mut StateWriter) {
        match self {
            Self::Landmark(landmark) => {
                0_u8.write(out);
                landmark.write(out);
            }
            Self::Agent(keyframe, lever) => {
                1_u8.write(out);
                keyframe.write(out);
                lever.write(out);
            }
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        match u8::read(input)? {
            0 => u32::read(input).map(Self::Landmark),
            1 => Ok(Self::Agent(State::read(input)?, State::read(input)?)),
            _ => Err(CorruptState::Invalid),
        }
    }
}

impl Sighting {
    /// The keyframe that it shows; [`NONE`] of a landmark.
    pub(super) fn shown_keyframe(&self) -> u32 {
        match self.shown {
            Seen::Agent(keyframe, _) => keyframe,
            Seen::Landmark(_) => NONE,
        }
    }
}
