//! Routes: how one gets from here to there, by ways that the team has gone.
//!
//! A route is a function of the map: costs are whole microunits, and of equally cheap routes that
//! one is answered whose places have the lowest numbers, counted from the goal. Lower bounds make
//! the search shorter and never change the answer.

mod alternatives;
mod bounds;
mod cost;
mod end;
mod following;
mod frontier;
mod graph;
mod options;
mod path;
mod reached;
mod region;
mod retrace;
mod search;
mod shortcut;
mod steps;
mod thinned;
mod tuning;

use nalgebra::{Point3, UnitQuaternion};

pub use bounds::RouteBounds;
pub use end::{NoRouteEnd, RouteEnd};
pub use following::Following;
pub use options::{Reverse, RouteCost, RouteOptions};
pub use region::Region;
pub use retrace::Back;
pub use thinned::{ThinnedTraversal, ThinnedWay};

use crate::memory::blockage::BlockageId;
use crate::memory::ids::{PlaceId, TripId};
use state::{state_of_enum, state_of_struct};

/// A route.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// What it costs, in millionths of the cost's unit; approaches cost nothing. What shortcuts
    /// save is only in lengths.
    pub cost_micro: u64,
    /// Where it begins in `map`.
    pub start: Point3<f64>,
    /// Length, approaches included \[m\].
    pub length_m: f64,
    /// Duration to be expected \[s\].
    pub duration_s: f64,
    /// Standard deviation of the position at the end, by motion along the ways, summed over the
    /// axes \[m\].
    pub sd_m: f64,
    /// Where it leads, one step after the other. None where start and goal are the same.
    pub steps: Vec<RouteStep>,
}

/// A step of a route: where it leads, and the way there.
#[derive(Clone, Debug, PartialEq)]
pub struct RouteStep {
    /// The place; `None` where the route leaves the places for a goal beside them.
    pub place: Option<PlaceId>,
    /// Where it is in `map`.
    pub position: Point3<f64>,
    /// Body in `map` that faces along the way, without roll.
    pub rotation: UnitQuaternion<f64>,
    /// How far off one may be and still be there \[m\].
    pub tolerance_m: f64,
    /// Standard deviation of the position there \[m\].
    pub sd_m: f64,
    /// Length of the way there \[m\].
    pub length_m: f64,
    /// Duration of the way there \[s\].
    pub duration_s: f64,
    /// How it is known.
    pub kind: StepKind,
    /// Times that it was travelled in this direction.
    pub traversals: u64,
    /// Latest stamp of a traversal in either direction \[ns\].
    pub last_stamp_ns: Option<i64>,
    /// The trip that led along it last, in this direction if any did, and the number of its leg,
    /// counted from 0. The trip may have been forgotten.
    pub leg: Option<(TripId, u32)>,
}

/// How the way of a step is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StepKind {
    /// Somebody travelled it.
    Travelled,
    /// Somebody travelled it, but only the other way.
    Reversed,
    /// A straight line between two places, wholly within the corridor that bodies have swept.
    Shortcut,
    /// From beside the places to the first, or from the last to beside them, in a straight line.
    Approach,
}

/// Why there is no route.
#[derive(Clone, Debug, PartialEq)]
pub enum NoRoute {
    /// No way leads there, as the options have it.
    NoWay {
        /// The place nearest to the goal that can be reached, with its distance from the goal
        /// \[m\].
        nearest: (PlaceId, f64),
        /// The blockages on the way there that would be, if they ended.
        blockages: Vec<BlockageId>,
    },
    /// The search was given up.
    GivenUp,
}

state_of_enum!(StepKind {
    Travelled = 0,
    Reversed = 1,
    Shortcut = 2,
    Approach = 3,
});
state_of_struct!(RouteStep {
    place,
    position,
    rotation,
    tolerance_m,
    sd_m,
    length_m,
    duration_s,
    kind,
    traversals,
    last_stamp_ns,
    leg,
});
