//! Instructions: blockages, routes that agents follow, pinned trips.

use std::sync::Arc;

use nalgebra::Point3;
use state::StateWriter;

use super::apply::Fold;
use super::checkpoint::{GUIDANCE, page_of};
use super::{CheckpointPage, CognitiveMap, CorruptCheckpoint};
use crate::agent::Status;
use crate::event::{Event, EventKind, RouteFailure, RouteLeft};
use crate::guidance::Guidance;
use crate::input::{AgentId, Errand, Goal, Instruction};
use crate::memory::blockage::Blockage;
use crate::memory::ids::TripId;
use crate::memory::place::PlaceId;
use crate::route::{Following, NoRoute, Route, RouteStep};

/// The number of no place.
const NO_PLACE: PlaceId = PlaceId(u32::MAX);

impl CognitiveMap {
    /// Applies an instruction that is next in line.
    pub(super) fn instruct(
        &mut self,
        number: u64,
        instruction: &Instruction,
        events: &mut Vec<Event>,
    ) {
        if number != self.guidance.instructions {
            return;
        }
        self.revision += 1;
        let revision = self.revision;
        let guidance = Arc::make_mut(&mut self.guidance);
        guidance.instructions += 1;
        guidance.touch(revision);
        match instruction {
            Instruction::Block(blockage) => {
                if guidance.block(*blockage) {
                    self.lead_around(blockage, events);
                }
            }
            Instruction::Unblock(id) => guidance.unblock_one(*id),
            Instruction::Follow(agent, errand) => self.set_out(*agent, errand, events),
            Instruction::StopFollowing(agent) => guidance.set_followed(*agent, None),
            Instruction::Pin(trip) => {
                if self.can_pin(*trip) {
                    self.trips.pin(*trip, true);
                }
            }
            Instruction::Unpin(trip) => self.trips.pin(*trip, false),
        }
    }

    /// Whether there is room to pin a trip: pinned ones have at most half the budget of legs.
    pub fn can_pin(&self, trip: TripId) -> bool {
        let Some(legs) = self.trips.get(trip).map(crate::Trip::leg_count) else {
            return false;
        };
        let pinned = self.trips.pinned().filter(|pinned| *pinned != trip);
        let pinned = pinned.filter_map(|pinned| Some(self.trips.get(pinned)?.leg_count()));
        2 * (legs + pinned.sum::<usize>()) <= self.settings.legs_max as usize
    }

    /// Whether a trip is never to be forgotten.
    pub fn is_pinned(&self, trip: TripId) -> bool {
        self.trips.is_pinned(trip)
    }

    /// The blockages, by number.
    pub fn blockages(&self) -> &[Blockage] {
        self.guidance.blockages()
    }

    /// Instructions so far: the number of the next one.
    pub fn instructions(&self) -> u64 {
        self.guidance.instructions
    }

    /// The route that an agent follows.
    pub fn followed(&self, agent: AgentId) -> Option<&Following> {
        self.guidance.followed(agent).map(|following| &**following)
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
    fn set_out(&mut self, agent: AgentId, errand: &Errand, events: &mut Vec<Event>) {
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
    fn lead_around(&mut self, blockage: &Blockage, events: &mut Vec<Event>) {
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

impl Fold<'_> {
    /// Ends the blockages whose time has come.
    pub(super) fn end_blockages_by(&mut self, stamp_ns: i64) {
        let over = |blockage: &Blockage| blockage.until_ns.is_some_and(|until| until <= stamp_ns);
        self.end_blockages(over);
    }

    /// Ends the blockages across which somebody has travelled.
    pub(super) fn end_blockages_between(
        &mut self,
        from: (PlaceId, &Point3<f64>),
        to: (PlaceId, &Point3<f64>),
    ) {
        self.end_blockages(|blockage| blockage.blocked.blocks(from, to));
    }

    fn end_blockages(&mut self, ends: impl Fn(&Blockage) -> bool) {
        if self.guidance.blockages().iter().any(&ends) {
            let guidance = Arc::make_mut(self.guidance);
            guidance.unblock(ends);
            guidance.touch(self.revision);
        }
    }
}

impl CognitiveMap {
    /// What instructions have said that still holds.
    pub(super) fn write_guidance(&self, out: &mut StateWriter) {
        self.guidance.write(self.trips.pinned(), out);
    }

    /// The page of guidance, if it changed.
    pub(super) fn guidance_page(&self, since_revision: u64) -> Option<CheckpointPage> {
        self.guidance.changed_since(since_revision).then(|| {
            let mut out = StateWriter::default();
            self.write_guidance(&mut out);
            page_of(GUIDANCE, 0, out)
        })
    }

    /// Reads guidance, once trips are there; a map in which nobody has said anything has none.
    pub(super) fn restore_guidance(
        &mut self,
        page: Option<&[u8]>,
    ) -> Result<(), CorruptCheckpoint> {
        let Some(bytes) = page else { return Ok(()) };
        let damaged = CorruptCheckpoint::DamagedPage {
            kind: GUIDANCE,
            index: 0,
        };
        let (guidance, pinned) = Guidance::read(bytes).map_err(|_| damaged)?;
        let is_agent = |agent: AgentId| (agent.0 as usize) < self.agents.len();
        let mut followed = guidance.all_followed();
        if !followed.all(|(agent, _)| is_agent(agent)) {
            return Err(damaged);
        }
        drop(followed);
        for trip in pinned {
            self.trips.pin(trip, true);
        }
        self.guidance = Arc::new(guidance);
        Ok(())
    }
}
