//! Instructions as the journal has them. Variants are added at the end.

use cogmap_proto::{RouteAvoid, RouteCost, RouteReverse};
use serde::{Deserialize, Serialize};

/// What routes and forgetting are to heed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum JournaledInstruction {
    /// Something is blocked.
    Block {
        /// Number of the blockage, which no other one has had.
        id: u64,
        /// What is blocked.
        blocked: JournaledBlocked,
        /// The stamp with which it ends \[ns\].
        until_ns: Option<i64>,
    },
    /// A blockage has ended.
    Unblock {
        /// Its number.
        id: u64,
    },
    /// An agent is to follow a route.
    Follow {
        /// Its number.
        agent: u32,
        /// Where it is to go, and how.
        errand: JournaledErrand,
    },
    /// An agent follows its route no more.
    StopFollowing {
        /// Its number.
        agent: u32,
    },
    /// A trip is never to be forgotten.
    Pin {
        /// Its number.
        trip: u32,
    },
    /// A trip may be forgotten like others.
    Unpin {
        /// Its number.
        trip: u32,
    },
}

/// What is blocked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum JournaledBlocked {
    /// A place.
    Place(u32),
    /// The way between two places.
    Way([u32; 2]),
    /// A ball: its middle, and its radius \[m\].
    Ball([f64; 3], f64),
}

/// Where an agent is to go, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JournaledErrand {
    /// Where to.
    pub goal: JournaledGoal,
    /// What is to be least.
    pub cost: RouteCost,
    /// Whether ways may be taken backwards.
    pub reverse: RouteReverse,
    /// What the route is to keep clear of.
    pub avoid: RouteAvoid,
}

/// Where a route is to lead.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum JournaledGoal {
    /// To a place.
    Place(u32),
    /// To a position \[m\].
    Position([f64; 3]),
    /// Along a trip, to its end or to its beginning.
    Retrace {
        /// The trip.
        trip: u32,
        /// Whether to its beginning.
        backward: bool,
    },
}
