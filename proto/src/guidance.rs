//! Guidance: blockages, and routes that agents follow.

use serde::{Deserialize, Serialize};

use crate::route::{RouteAvoid, RouteCost, RouteEnd, RouteReverse, RouteStep};

/// Says where nobody gets through: a place, the way between two places, or a ball. Exactly one of
/// these is named.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct BlockageRequest {
    /// A place, with all ways to it.
    #[serde(default)]
    pub place: Option<u64>,
    /// One end of a way, which is blocked in both directions; with `to`.
    #[serde(default)]
    pub from: Option<u64>,
    /// Its other end.
    #[serde(default)]
    pub to: Option<u64>,
    /// The middle of a ball in `map` \[m\], which blocks all ways whose straight lines meet it;
    /// with `radius_m`.
    #[serde(default)]
    pub at_m: Option<[f64; 3]>,
    /// The radius of the ball \[m\], 0.01 to 1000.
    #[serde(default)]
    pub radius_m: Option<f64>,
    /// The blockage ends with the first sample of any agent that has this stamp or a later one
    /// \[ns\]; by itself never, when absent.
    #[serde(default)]
    pub until_ns: Option<i64>,
}

/// A blockage.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct Blockage {
    /// Its number, which no other one has had.
    pub id: u64,
    /// The place that is blocked; absent where it is something else, as are all below.
    pub place: Option<u64>,
    /// One end of the way that is blocked.
    pub from: Option<u64>,
    /// Its other end.
    pub to: Option<u64>,
    /// The middle of the ball that is blocked \[m\].
    pub at_m: Option<[f64; 3]>,
    /// The radius of the ball \[m\].
    pub radius_m: Option<f64>,
    /// The stamp with which it ends \[ns\].
    pub until_ns: Option<i64>,
}

/// The blockages of a space.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct BlockageList {
    /// All of them, by number: 256 at most.
    pub blockages: Vec<Blockage>,
}

/// Lets an agent follow a route from where it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(deny_unknown_fields)]
pub struct FollowRequest {
    /// Where it is to go. What moves is taken where it is now.
    pub to: RouteEnd,
    /// What is to be least; the length when absent.
    #[serde(default)]
    pub cost: RouteCost,
    /// Whether ways may be taken in a direction in which nobody has travelled them; they may when
    /// absent.
    #[serde(default)]
    pub reverse: RouteReverse,
    /// What the route is to keep clear of.
    #[serde(default)]
    pub avoid: RouteAvoid,
}

/// What is left of the route that an agent follows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct FollowedRoute {
    /// Space.
    pub space: String,
    /// The agent.
    pub agent: String,
    /// Frame of the poses; always `map`.
    pub frame: String,
    /// Number of records that the map includes.
    pub map_revision: u64,
    /// Length that is left \[m\].
    pub length_m: f64,
    /// Duration to be expected of all steps that are left \[s\].
    pub duration_s: f64,
    /// Steps of the route that it has gone.
    pub steps_done: u64,
    /// The steps that are left; none where it has arrived.
    pub steps: Vec<RouteStep>,
}

/// Agents that follow routes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct FollowedRoutePage {
    /// Number of records that the map includes.
    pub map_revision: u64,
    /// What is left of their routes, by the names of the agents.
    pub routes: Vec<FollowedRouteSummary>,
    /// Name to go on after; absent on the last page.
    pub next: Option<String>,
}

/// What is left of the route that an agent follows, without the steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
pub struct FollowedRouteSummary {
    /// The agent.
    pub agent: String,
    /// Length that is left \[m\].
    pub length_m: f64,
    /// Duration to be expected of all steps that are left \[s\].
    pub duration_s: f64,
    /// Steps of the route that it has gone.
    pub steps_done: u64,
    /// Steps that are left; none where it has arrived.
    pub steps_left: u64,
}

/// Why an agent follows no route any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(utoipa::ToSchema))]
#[serde(rename_all = "snake_case")]
pub enum RouteFailure {
    /// No way leads there any more.
    NoWay,
    /// The goal has been forgotten.
    GoalForgotten,
    /// No place is near the agent.
    NothingNear,
    /// It is not known where the agent is.
    AgentLost,
    /// The agent has begun another session.
    SessionEnded,
}
