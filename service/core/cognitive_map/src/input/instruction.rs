//! Instructions: what people and programs say of ways, routes and trips.

use nalgebra::Point3;

use super::AgentId;
use crate::memory::blockage::{Blockage, BlockageId};
use crate::memory::ids::{PlaceId, TripId};
use crate::route::{Region, Reverse, RouteCost};
use state::{state_of_enum, state_of_struct};

/// What routes and forgetting are to heed.
#[derive(Clone, Debug, PartialEq)]
pub enum Instruction {
    /// Something is blocked.
    Block(Blockage),
    /// A blockage has ended.
    Unblock(BlockageId),
    /// An agent is to follow a route, in place of any that it follows.
    Follow(AgentId, Errand),
    /// An agent follows its route no more.
    StopFollowing(AgentId),
    /// A trip is never to be forgotten.
    Pin(TripId),
    /// A trip may be forgotten like others.
    Unpin(TripId),
}

/// Where an agent is to go, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Errand {
    /// Where to.
    pub goal: Goal,
    /// What is to be least.
    pub cost: RouteCost,
    /// Whether ways may be taken backwards.
    pub reverse: Reverse,
    /// Places that the route does not lead through.
    pub avoid_places: Vec<PlaceId>,
    /// Boxes that it does not lead into.
    pub avoid_regions: Vec<Region>,
}

/// Where a route is to lead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// To a place.
    Place(PlaceId),
    /// To a position in `map`.
    Position(Point3<f64>),
    /// Along a trip to one of its ends.
    Retrace(Retrace),
}

/// A trip that is to be travelled again, from the point on it that is nearest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Retrace {
    /// The trip.
    pub trip: TripId,
    /// Whether towards its beginning.
    pub backward: bool,
}

state_of_struct!(Errand {
    goal,
    cost,
    reverse,
    avoid_places,
    avoid_regions,
});
state_of_struct!(Retrace { trip, backward });
state_of_enum!(Goal {
    Place(place) = 0,
    Position(at) = 1,
    Retrace(trip) = 2,
});
