//! Whether an agent belongs to the space.

use state::state_of_enum;

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

state_of_enum!(Membership {
    Enrolled = 0,
    Removed = 1,
    Vacant = 2,
});
