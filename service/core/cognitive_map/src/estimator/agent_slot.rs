//! Slot of an agent: its frame, and its state while that is not part of the frame's joint estimate.

use std::sync::Arc;

use super::agent_filter::AgentFilter;
use super::outcome::Evidence;
use super::range_sensor::RangeSensor;
use super::ranging::Ranging;
use super::recent_sightings::RecentSightings;
use super::sensor::Sensor;
use super::tuning::RETURN_WIDENING;

/// State of an agent: its filter, its sensor, and how its sightings agree with the estimate.
#[derive(Clone, Debug)]
pub(super) struct AgentState {
    pub(super) filter: AgentFilter,
    pub(super) sensor: Sensor,
    pub(super) range_sensor: RangeSensor,
    /// The landmarks of which it knows distances alone.
    pub(super) ranging: Ranging,
    /// Where it saw known landmarks lately.
    pub(super) recent: RecentSightings,
    /// Sightings refused one after the other since it was put somewhere or widened last, without
    /// those of unconfirmed landmarks until it is doubted for long; some, too, after its sightings
    /// have put it elsewhere. The published
    /// [`Evidence::refused_in_a_row`] is this number as of its latest sighting.
    pub(super) refused: u32,
    /// How much its recent sightings contradict the estimate (see `set_aside`).
    pub(super) doubt: u32,
    /// Distances in a row that were too long.
    pub(super) too_long: u32,
}

/// Slot of an agent.
#[derive(Clone, Debug)]
pub(super) struct AgentSlot {
    /// Number of its frame.
    pub(super) frame: usize,
    pub(super) evidence: Evidence,
    /// Whether it was set aside, and its sightings have not agreed with the map since.
    pub(super) is_aside: bool,
    /// Its state while it is not a member of the frame's joint estimate; a member's is in the
    /// frame.
    pub(super) detached: Option<Detached>,
}

/// State of an agent that is not a member of its frame's joint estimate.
#[derive(Clone, Debug)]
pub(super) struct Detached {
    pub(super) state: Arc<AgentState>,
    /// Whether it did, so that its errors are correlated with the others' in a way that is
    /// forgotten.
    pub(super) was_joint: bool,
}

impl AgentState {
    /// The numbers of landmarks change.
    pub(super) fn forget_targets(&mut self) {
        self.sensor.latest.clear();
        self.range_sensor.latest.clear();
    }
}

impl AgentSlot {
    /// Of a new agent.
    pub(super) fn new(frame: usize, filter: AgentFilter) -> Self {
        Self {
            frame,
            evidence: Evidence::default(),
            is_aside: false,
            detached: Some(Detached::new(Arc::new(AgentState {
                filter,
                sensor: Sensor::default(),
                range_sensor: RangeSensor::default(),
                ranging: Ranging::default(),
                recent: RecentSightings::default(),
                refused: 0,
                doubt: 0,
                too_long: 0,
            }))),
        }
    }
}

impl Detached {
    /// Of an agent whose errors are independent of the others'.
    pub(super) fn new(state: Arc<AgentState>) -> Self {
        Self {
            state,
            was_joint: false,
        }
    }

    /// The state with which it becomes a member: its errors count as independent of the others'.
    pub(super) fn independent(mut self) -> Arc<AgentState> {
        let filter = &mut Arc::make_mut(&mut self.state).filter;
        // No cross terms wait for this transition.
        filter.flush();
        if self.was_joint {
            *filter.covariance_mut() *= RETURN_WIDENING * RETURN_WIDENING;
        }
        self.state
    }
}
