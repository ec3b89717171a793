//! An agent: which frame it is in, and whether its errors are estimated jointly with others.

use std::sync::Arc;

use super::agent_filter::AgentFilter;
use super::outcome::Evidence;
use super::sensor::Sensor;
use super::tuning::RETURN_WIDENING;

/// What is known of an agent itself. A clone shares it.
#[derive(Clone, Debug)]
pub(super) struct AgentState {
    pub(super) filter: AgentFilter,
    pub(super) sensor: Sensor,
    /// Sightings refused one after the other.
    pub(super) refused: u32,
    /// How much its recent sightings contradict the estimate ([`set_aside`](super::set_aside)).
    pub(super) doubt: u32,
}

/// An agent, in whatever frame.
#[derive(Clone, Debug)]
pub(super) struct AgentSlot {
    /// Its frame.
    pub(super) frame: usize,
    pub(super) evidence: Evidence,
    /// Whether it was set aside, and its evidence has not fitted since.
    pub(super) is_aside: bool,
    /// The agent itself, while it does not take part in its frame's joint estimate.
    pub(super) detached: Option<Detached>,
}

/// An agent that does not take part in its frame's joint estimate.
#[derive(Clone, Debug)]
pub(super) struct Detached {
    pub(super) state: Arc<AgentState>,
    /// Whether it did, so that its errors are correlated with the others' in a way that is
    /// forgotten.
    pub(super) was_joint: bool,
}

impl AgentSlot {
    /// Of an agent that begins at a frame's identity.
    pub(super) fn new(frame: usize, filter: AgentFilter) -> Self {
        Self {
            frame,
            evidence: Evidence::default(),
            is_aside: false,
            detached: Some(Detached::new(Arc::new(AgentState {
                filter,
                sensor: Sensor::default(),
                refused: 0,
                doubt: 0,
            }))),
        }
    }
}

impl Detached {
    /// Of an agent that nothing ties to the others.
    pub(super) fn new(state: Arc<AgentState>) -> Self {
        Self {
            state,
            was_joint: false,
        }
    }

    /// The agent as it may take part: its errors count as independent of all others'.
    pub(super) fn independent(mut self) -> Arc<AgentState> {
        let filter = &mut Arc::make_mut(&mut self.state).filter;
        // Nothing waits for what happened to the errors.
        filter.flush();
        if self.was_joint {
            *filter.covariance_mut() *= RETURN_WIDENING * RETURN_WIDENING;
        }
        self.state
    }
}
