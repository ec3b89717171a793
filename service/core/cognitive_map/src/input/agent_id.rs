//! Numbers of agents.

use state::state_of_newtype;

/// An agent of a space, counted from 0 in the order of enrolment. The number of a removed agent
/// that was never in the map goes to a later one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct AgentId(pub u32);

state_of_newtype!(AgentId);
