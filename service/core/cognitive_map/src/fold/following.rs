//! Agents that follow routes.

use std::sync::Arc;

use nalgebra::Point3;

use super::CognitiveMap;
use crate::agent::Status;
use crate::event::{Event, EventKind, RouteFailure, RouteLeft};
use crate::input::{AgentId, Errand, Goal};
use crate::memory::blockage::Blockage;
use crate::memory::place::PlaceId;
use crate::route::{Following, NoRoute, Route, RouteStep};

/// The number of no place.
const NO_PLACE: PlaceId = PlaceId(u32::MAX);

impl CognitiveMap {
    /// The route that an agent follows.
    pub fn followed(&self, agent: AgentId) -> Option<&Following> {
        self.guidance.followed(agent).map(|following| &**following)
    }

    /// The routes that agents follow, by the numbers of the agents.
    pub fn all_followed(&self) -> impl Iterator<Item = (AgentId, &Following)> {
        self.guidance.all_followed()
    }

    /// The route of an errand from where an agent is now.
    fn route_of(&self, agent: AgentId, errand: &Errand) -> Result<Route, RouteFailure> {
        if self
            .status(agent)
            .is_none_or(|status| status == Status::Lost)
        {
            return Err(RouteFailure::AgentLost);
        }
        let near = |_| RouteFailure::NothingNear;
        let from = self.route_end_of_agent(agent).map_err(near)?;
        let options = errand.options();
        // The ways are bounded, and so is a search.
        let gives_up = &mut || false;
        let found = match &errand.goal {
            Goal::Retrace(trip) => {
                let gone = |_| RouteFailure::GoalForgotten;
                self.route_end_of_retrace(trip).map_err(gone)?;
                self.retraced(&from, trip, &options, None, gives_up)
            }
            goal => {
                let to = match goal {
                    Goal::Position(at) => self.route_end_near(at),
                    Goal::Place(place) => self.route_end_at(*place),
                    Goal::Retrace(trip) => self.route_end_of_retrace(trip),
                };
                let to = to.map_err(|_| RouteFailure::GoalForgotten)?;
                let routes = self.routes(&from, &to, &options, None, gives_up);
                routes.map(|mut routes| routes.swap_remove(0))
            }
        };
        found.map_err(|error| match error {
            NoRoute::NoWay { blockages, .. } => RouteFailure::NoWay(blockages),
            NoRoute::GivenUp => RouteFailure::NoWay(Vec::new()),
        })
    }

    /// An agent begins to follow a route.
    pub(super) fn set_out(&mut self, agent: AgentId, errand: &Errand, events: &mut Vec<Event>) {
        if !self.agent(agent).is_some_and(crate::Agent::is_enrolled) {
            return;
        }
        self.reroute(agent, errand, |_| None, events);
    }

    /// Makes an agent's route anew from where it is, and tells what `tells` says of it.
    fn reroute(
        &mut self,
        agent: AgentId,
        errand: &Errand,
        tells: impl FnOnce(&Route) -> Option<RouteLeft>,
        events: &mut Vec<Event>,
    ) {
        let route = self.route_of(agent, errand);
        let session = self.agent(agent).map_or(0, crate::Agent::session);
        let (following, kind) = match route {
            Err(failure) => (None, Some(EventKind::RouteFailed { failure })),
            Ok(route) => {
                let left = tells(&route).map(|left| EventKind::RouteLeft(Box::new(left)));
                (Some(Following::new(errand.clone(), session, route)), left)
            }
        };
        self.set_followed(agent, following);
        events.extend(kind.map(|kind| self.event_of(agent, kind)));
        self.note_arrival(agent, events);
    }

    /// Agents whose routes lead across a new blockage get others.
    pub(super) fn lead_around(&mut self, blockage: &Blockage, events: &mut Vec<Event>) {
        let across = self.guidance.all_followed().filter(|(agent, following)| {
            let Some(pose) = self.agent(*agent).map(|agent| agent.pose().translation) else {
                return false;
            };
            // From where it is, on the way from the place that it came to last.
            let reached = following.reached(following.steps_done());
            let reached = reached.and_then(|step| step.place);
            let mut before = (reached.unwrap_or(NO_PLACE), Point3::from(pose.vector));
            following.rest().iter().any(|step| {
                let place = step.place.unwrap_or(NO_PLACE);
                let there = (place, self.leads_to(step));
                let blocked =
                    { blockage.blocked }.blocks((before.0, &before.1), (there.0, &there.1));
                before = there;
                blocked
            })
        });
        let across: Vec<_> = across
            .map(|(agent, of)| (agent, of.errand.clone()))
            .collect();
        for (agent, errand) in across {
            let tells = |route: &Route| {
                Some(RouteLeft {
                    off_m: None,
                    blockage: Some(blockage.id),
                    route: route.clone(),
                })
            };
            self.reroute(agent, &errand, tells, events);
        }
    }

    /// Notes how far an agent has come along its route, after one of its records.
    pub(super) fn go_along(&mut self, agent: AgentId, events: &mut Vec<Event>) {
        if self.guidance.leads_nobody() {
            return; // as most often
        }
        let Some(following) = self.guidance.followed(agent).cloned() else {
            return;
        };
        let Some(known) = self.agent(agent) else {
            return;
        };
        let failure = if known.session() != following.session {
            Some(RouteFailure::SessionEnded)
        } else if self.status(agent) == Some(Status::Lost) {
            Some(RouteFailure::AgentLost)
        } else {
            None
        };
        if let Some(failure) = failure {
            self.set_followed(agent, None);
            let kind = EventKind::RouteFailed { failure };
            events.push(self.event_of(agent, kind));
            return;
        }
        let at = Point3::from(known.pose().translation.vector);
        let progress = following.progress(&at, self.settings.field_radius_m, |step| {
            self.leads_to(step)
        });
        if let Some(off_m) = progress.off_m {
            let tells = |route: &Route| {
                Some(RouteLeft {
                    off_m: Some(off_m),
                    blockage: None,
                    route: route.clone(),
                })
            };
            self.reroute(agent, &following.errand, tells, events);
            return;
        }
        if progress.next == following.steps_done() {
            return;
        }
        let revision = self.revision;
        let guidance = Arc::make_mut(&mut self.guidance);
        guidance.touch(revision);
        if let Some(following) = guidance.followed_mut(agent) {
            following.go_on(progress.next);
        }
        self.note_progress(agent, &at, events);
        self.note_arrival(agent, events);
    }

    fn note_progress(&self, agent: AgentId, at: &Point3<f64>, events: &mut Vec<Event>) {
        let Some(following) = self.followed(agent) else {
            return;
        };
        let reached = following.reached(following.steps_done());
        let kind = EventKind::RouteProgress {
            place: reached.and_then(|step| step.place),
            steps_left: following.rest().len(),
            rest_m: following.rest_m(at),
        };
        events.push(self.event_of(agent, kind));
    }

    /// An agent that has no step left has arrived.
    fn note_arrival(&mut self, agent: AgentId, events: &mut Vec<Event>) {
        let arrived = self.followed(agent).is_some_and(|of| of.rest().is_empty());
        if arrived {
            self.set_followed(agent, None);
            events.push(self.event_of(agent, EventKind::RouteDone));
        }
    }

    /// An agent follows no route any more, if it did.
    pub(super) fn stop_following(&mut self, agent: AgentId) {
        if self.guidance.followed(agent).is_some() {
            self.set_followed(agent, None);
        }
    }

    fn set_followed(&mut self, agent: AgentId, following: Option<Following>) {
        let revision = self.revision;
        let guidance = Arc::make_mut(&mut self.guidance);
        guidance.set_followed(agent, following);
        guidance.touch(revision);
    }

    /// Where a step leads, as the map has it now.
    fn leads_to(&self, step: &RouteStep) -> Point3<f64> {
        let place = step.place.and_then(|place| self.waypoint(place));
        place.map_or(step.position, |place| {
            place.pose().translation.vector.into()
        })
    }

    fn event_of(&self, agent: AgentId, kind: EventKind) -> Event {
        let stamp_ns = self.agent(agent).and_then(crate::Agent::stamp_ns);
        Event {
            agent,
            stamp_ns: stamp_ns.unwrap_or(0),
            kind,
        }
    }
}
