//! Who belongs to the space: agents come by enrolment and go by removal.

use std::sync::Arc;

use super::CognitiveMap;
use super::apply::Fold;
use crate::agent::{Agent, Membership};
use crate::event::{Event, EventKind};
use crate::input::AgentId;
use crate::input::Label;
use crate::memory::trip::TripEnd;

impl CognitiveMap {
    /// Enrols an agent under the next number, or under one that is vacant. A name is one agent's at
    /// a time.
    pub(super) fn enrol(&mut self, id: AgentId, name: &Label, events: &mut Vec<Event>) {
        let index = id.0 as usize;
        let is_next = index == self.agents.len();
        let is_free = is_next || self.is_vacant(id);
        if !is_free || self.names.contains_key(name) {
            return;
        }
        self.revision += 1;
        let agent = Agent::new(name.clone(), &self.modules);
        if is_next {
            self.agents.push(agent, self.revision);
            Arc::make_mut(&mut self.estimator).enrol();
            let keyframes = Arc::make_mut(&mut self.keyframes);
            keyframes.set_revision(self.revision);
            keyframes.graph.enrol();
        } else if let Some(vacant) = self.agents.get_mut(index, self.revision) {
            // The estimate and the keyframe graph have held a new agent under this number since it
            // is vacant.
            *vacant = agent;
        }
        Arc::make_mut(&mut self.names).insert(name.clone(), id);
        events.push(Event {
            agent: id,
            stamp_ns: 0,
            kind: EventKind::AgentEnrolled,
        });
    }

    /// Removes an agent. One that was in the map leaves there what it did; of any other one nothing
    /// stays, and its number is vacant. Takes time in proportion to what is remembered of the
    /// latter.
    pub(super) fn remove(&mut self, id: AgentId, events: &mut Vec<Event>) {
        let Some(agent) = self.agent(id).filter(|agent| agent.is_enrolled()) else {
            return;
        };
        let name = agent.name().clone();
        Arc::make_mut(&mut self.names).remove(&name);
        if let Some(mut fold) = self.open(id, events) {
            fold.remove(name);
        }
    }

    /// Whether an agent was ever in the map: it was in its frame, so that something there may be
    /// its own.
    pub fn has_been_in_map(&self, id: AgentId) -> bool {
        self.agent(id).is_some_and(Agent::placed) || self.estimator.has_been_in_map(id.0)
    }

    /// Whether a number belonged to an agent that has been removed without a trace, so that it is
    /// the next newcomer's.
    pub fn is_vacant(&self, id: AgentId) -> bool {
        let agent = self.agent(id);
        agent.is_some_and(|agent| agent.membership == Membership::Vacant)
    }
}

impl Fold<'_> {
    /// The agent goes.
    fn remove(&mut self, name: Label) {
        self.drop_forgotten();
        self.end_trip(TripEnd::SessionEnd);
        self.end_episode();
        self.agent.place = None;
        self.agent.entered = None;
        self.hold_places();
        let number = self.agent_id.0;
        if self.agent.placed() || self.estimator.has_been_in_map(number) {
            self.estimator.retire(number);
            self.keyframes.retire(number);
            self.agent.membership = Membership::Removed;
        } else {
            self.estimator.clear(number);
            self.keyframes.clear(number);
            *self.agent = Agent::new(name.clone(), self.modules);
            self.agent.membership = Membership::Vacant;
        }
        self.emit(EventKind::AgentRemoved { name });
    }
}
