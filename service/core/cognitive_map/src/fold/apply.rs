//! The fold of one record: sessions, skips, samples, and the agent's place in the map.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Point3, Vector6};

use super::tuning::{KIDNAPPED_SD, UNSEEN_TURN_SD_MAX_RAD};
use crate::agent::Agent;
use crate::estimator::{Effect, Estimator};
use crate::event::{Event, EventKind};
use crate::guidance::Guidance;
use crate::input::{AgentId, SkipReason};
use crate::input::{Label, Marker, Sample, SampleBody, StartPose};
use crate::keyframes::KeyframeMap;
use crate::memory::landmark::LandmarkMap;
use crate::memory::object::ObjectMemory;
use crate::memory::percept::PerceptMap;
use crate::memory::place::{PlaceId, PlaceMap};
use crate::memory::strength::Clock;
use crate::memory::trip::{TripEnd, TripMap, interval_s};
use crate::memory::way::WayMap;
use crate::settings::Settings;
use geometry::OUT_OF_PLANE;
use grid::GridModules;

/// The map, open for one record of one agent.
pub(super) struct Fold<'a> {
    pub(super) settings: &'a Settings,
    pub(super) modules: &'a GridModules,
    pub(super) revision: u64,
    pub(super) now: Clock,
    pub(super) is_map_defined: &'a mut bool,
    pub(super) places: &'a mut PlaceMap,
    pub(super) trips: &'a mut TripMap,
    pub(super) ways: &'a mut WayMap,
    pub(super) landmarks: &'a mut LandmarkMap,
    pub(super) percepts: &'a mut PerceptMap,
    pub(super) objects: &'a mut ObjectMemory,
    pub(super) guidance: &'a mut Arc<Guidance>,
    pub(super) estimator: &'a mut Estimator,
    /// What the latest call of the estimator brought about, until it is applied.
    pub(super) effects: Vec<Effect>,
    pub(super) keyframes: &'a mut KeyframeMap,
    pub(super) names: &'a BTreeMap<Label, AgentId>,
    pub(super) agent_id: AgentId,
    pub(super) agent: &'a mut Agent,
    /// The places that are held for the agent.
    pub(super) held: [Option<PlaceId>; 2],
    /// Stamp of the events.
    pub(super) stamp_ns: i64,
    pub(super) events: &'a mut Vec<Event>,
}

impl Fold<'_> {
    /// Drops references to a place and a trip that have been forgotten since the agent's latest
    /// record.
    pub(super) fn drop_forgotten(&mut self) {
        if let Some((place, _)) = self.agent.place
            && self.places.get(place).is_none()
        {
            self.agent.place = None;
            self.agent.asked_at = None;
        }
        if let Some(trip) = self.agent.recorder.trip
            && self.trips.get(trip).is_none()
        {
            self.agent.recorder.trip = None;
        }
    }

    /// Begins a session if it is a new one. `stamp_ns` is that of the sample that begins it.
    pub(super) fn enter_session(&mut self, session: u64, stamp_ns: Option<i64>) {
        if self.agent.session == Some(session) {
            return;
        }
        if let Some(stamp_ns) = stamp_ns {
            self.stamp_ns = stamp_ns;
        }
        self.end_trip(TripEnd::SessionEnd);
        self.end_episode();
        let before = self.agent.session.replace(session);
        self.agent.session_ended = false;
        self.agent.next_seq = 0;
        self.agent.stamp_ns = None;
        self.agent.still_since = None;
        self.agent.home = None;
        self.agent.announced.restart();
        self.agent.filter.cut();
        if before.is_some() {
            let (length_m, angle_rad) = (self.settings.restart_sd_m, self.settings.restart_sd_rad);
            let sd = Vector6::from_fn(|k, _| if k < 3 { length_m } else { angle_rad });
            self.estimator.go_unseen(self.agent_id.0, &sd);
            self.keyframes.graph.restart(self.agent_id.0, &sd);
        }
        self.emit(EventKind::SessionStarted { session });
    }

    /// Skips the samples below `to` that are neither applied nor skipped yet, if any.
    pub(super) fn skip(&mut self, to: u64, reason: SkipReason) {
        let from = self.agent.next_seq;
        if from >= to {
            return;
        }
        self.agent.next_seq = to;
        // Motion was lost, so nothing measured joins what came before to what comes after.
        if reason == SkipReason::Lost {
            self.end_trip(TripEnd::Gap);
            self.end_episode();
            self.go_unseen(from, to - from);
        }
        self.emit(EventKind::SamplesSkipped { from, to, reason });
    }

    /// The agent went on with as many samples as are lost, after `before` of its session: as far as
    /// it goes on average, straight ahead or in any other way.
    fn go_unseen(&mut self, before: u64, lost: u64) {
        let (sd_m, turn_rad) = self.agent.announced.lose(lost, before);
        if self.agent.placed() && sd_m > self.settings.lost_sd_m {
            return self.lose_agent();
        }
        let sd_m = sd_m.min(KIDNAPPED_SD * self.settings.lost_sd_m);
        let sd_rad = turn_rad.min(UNSEEN_TURN_SD_MAX_RAD);
        let is_planar = self.estimator.is_planar(self.agent_id.0);
        let sd = Vector6::from_fn(|k, _| match k {
            _ if is_planar && OUT_OF_PLANE.contains(&k) => 0.0,
            0..3 => sd_m,
            _ => sd_rad,
        });
        self.agent.filter.cut();
        self.estimator.go_unseen(self.agent_id.0, &sd);
        self.keyframes.graph.go_unseen(self.agent_id.0, &sd);
    }

    /// Applies the next sample.
    pub(super) fn sample(&mut self, seq: u64, sample: &Sample) {
        self.stamp_ns = sample.stamp_ns;
        let before = self.agent.stamp_ns.replace(sample.stamp_ns);
        self.agent.next_seq = seq + 1;
        self.agent.session_ended = matches!(sample.body, SampleBody::SessionEnd);
        if before
            .is_some_and(|before| interval_s(before, sample.stamp_ns) > self.settings.trip_gap_s)
        {
            self.end_trip(TripEnd::Gap);
        }
        match &sample.body {
            SampleBody::Motion(motion) => {
                self.motion(seq, motion);
                return self.go_on_seeking();
            }
            SampleBody::Level(level) => self.level(level),
            SampleBody::Descriptor(descriptor) => self.descriptor(descriptor),
            SampleBody::Sighting(sighting) => self.sighting(sighting),
            SampleBody::StartPose(start) => self.start_pose(start),
            SampleBody::Marker(marker) => self.marker(marker),
            SampleBody::Object(mark) => self.object_mark(mark),
            SampleBody::SessionEnd => {
                self.end_trip(TripEnd::SessionEnd);
                self.end_episode();
            }
        }
        self.rest();
    }

    /// Takes in a start pose.
    fn start_pose(&mut self, start: &StartPose) {
        self.end_trip(TripEnd::StartPose);
        self.estimator
            .start_pose(self.agent_id.0, start, &mut self.effects);
        self.apply_effects();
        if !self.estimator.is_in_map(self.agent_id.0) {
            // A start pose whose noise admits any place says nothing.
            return;
        }
        self.keyframes.start_pose(&self.moment(), start);
        self.keyframes.end_search(self.agent_id.0);
        self.agent.filter.cut();
        let seq = self.agent.next_seq.saturating_sub(1);
        self.keyframes.confirm_pose(self.agent_id.0, seq);
        *self.is_map_defined = true;
        self.place_agent();
    }

    /// The agent passed a marker.
    fn marker(&mut self, marker: &Marker) {
        self.emit(EventKind::MarkerPassed {
            label: marker.label.clone(),
        });
        if marker.ends_trip {
            self.end_trip(TripEnd::Marker);
        }
    }

    /// Lets the first agent that does something define the `map` frame, by the identity at which it
    /// is.
    pub(super) fn define_frame(&mut self) {
        if !*self.is_map_defined {
            *self.is_map_defined = true;
            self.estimator.found(self.agent_id.0);
            self.keyframes.graph.found(self.agent_id.0);
            self.agent.announced.set_placed(true);
        }
    }

    /// Ends the trip and the leg under way, if any; the next motion starts anew from the place that
    /// answers then. The unfinished leg leads to no place and is dropped.
    pub(super) fn end_trip(&mut self, reason: TripEnd) {
        self.agent.recorder.leg = None;
        self.agent.asked_at = None;
        self.close_trip(reason);
    }

    /// Ends the trip under way, if any, but not the leg.
    pub(super) fn close_trip(&mut self, reason: TripEnd) {
        let Some(trip) = self.agent.recorder.trip.take() else {
            return;
        };
        if let Some(legs) = self.trips.end(trip, reason, self.revision) {
            self.emit(EventKind::TripEnded { trip, legs, reason });
        }
    }

    /// Ends the record: the agent is where the estimate has it now, by all that has been seen until
    /// now.
    pub(super) fn finish(&mut self) {
        self.relax_matches();
        self.move_places();
        self.update_pose();
        self.hold_places();
    }

    /// Brings the agent to where the estimate has it. One that turns out to lie in the map begins
    /// there anew.
    pub(super) fn update_pose(&mut self) {
        let number = self.agent_id.0;
        if !self.estimator.is_in_map(number) && self.agent.placed() {
            self.unplace();
        }
        if self.estimator.is_in_map(number) && !self.agent.placed() {
            self.end_trip(TripEnd::StartPose);
            self.place_agent();
            let position = Point3::from(self.agent.announced.in_map().translation.vector);
            self.emit(EventKind::AgentPlaced { position });
            return;
        }
        let Some(pose) = self.estimator.in_frame(number) else {
            return;
        };
        let (placed, agent, stamp_ns) = (self.agent.placed(), self.agent_id, self.stamp_ns);
        let events = &mut *self.events;
        let entered = |module, reference| {
            events.extend(cell_entered(placed, agent, stamp_ns, module, reference));
        };
        let evidence = self.estimator.evidence(number);
        let announced = &mut self.agent.announced;
        announced.follow(pose, evidence, self.modules, entered);
    }

    /// Puts the agent where the estimate has it, without a way there.
    pub(super) fn place_agent(&mut self) {
        if let Some(pose) = self.estimator.in_frame(self.agent_id.0) {
            self.agent.announced.place(pose, self.modules);
        }
        self.agent.announced.set_placed(true);
        self.agent.place = None;
        self.agent.entered = None;
        self.agent.still_since = None;
    }

    /// Takes the agent out of the map, for it was set aside: it begins anew, as one that has just
    /// joined.
    fn unplace(&mut self) {
        self.end_trip(TripEnd::Gap);
        self.end_episode();
        self.place_agent();
        self.agent.announced.set_placed(false);
    }

    /// Holds the places that the agent needs now, and releases those that it no longer does.
    pub(super) fn hold_places(&mut self) {
        let needed = self.agent.holds();
        if needed == self.held {
            return; // as most often
        }
        for place in needed.into_iter().flatten() {
            self.places.hold(place);
        }
        for place in self.held.into_iter().flatten() {
            self.places.release(place);
        }
        self.held = needed;
    }

    /// Appends an event.
    pub(super) fn emit(&mut self, kind: EventKind) {
        self.events.push(Event {
            agent: self.agent_id,
            stamp_ns: self.stamp_ns,
            kind,
        });
    }
}

/// The event that a grid module came into a new lattice cell. Of an agent that is not placed, the
/// cells are those of no map.
pub(super) fn cell_entered(
    placed: bool,
    agent: AgentId,
    stamp_ns: i64,
    module: usize,
    reference: [i64; 3],
) -> Option<Event> {
    let module = u8::try_from(module).ok().filter(|_| placed)?;
    let kind = EventKind::CellEntered { module, reference };
    Some(Event {
        agent,
        stamp_ns,
        kind,
    })
}
