//! Whether an agent belongs to the space.

use state::{CorruptState, State, StateReader, StateWriter};

/// Whether an agent belongs to the space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Membership {
    /// It does.
    Enrolled,
    /// It has been removed. What it did in the map stays, and its number is its own for ever.
    Removed,
    /// It has been removed before it was in the map. Nothing is left of it, and its number is free.
    Vacant,
}

impl State for Membership {
    fn write(&self, out: &mut StateWriter) {
        (*self as u8).write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        match u8::read(input)? {
            0 => Ok(Self::Enrolled),
            1 => Ok(Self::Removed),
            2 => Ok(Self::Vacant),
            _ => Err(CorruptState::Invalid),
        }
    }
}
