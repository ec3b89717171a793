//! Numbers of places and trips.

use state::state_of_newtype;

/// A place, counted from 0 in the order of recruitment. The number of a forgotten place is not
/// given to another one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PlaceId(pub u32);

/// A trip, counted from 0 in the order of recording. The number of a forgotten trip is not given to
/// another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TripId(pub u32);

state_of_newtype!(PlaceId, TripId);
