//! What a sample does to the map.

use crate::agent::{Agent, Body};
use crate::event::{Event, EventKind};
use crate::grid::GridModules;
use crate::landmark::{Landmark, LandmarkMap, seen};
use crate::percept::PerceptMap;
use crate::place::{PlaceId, PlaceMap};
use crate::record::{AgentId, SkipReason};
use crate::sample::{Label, Marker, Relation, Sample, SampleBody, Sighting, StartPose, Target};
use crate::settings::Settings;
use crate::strength::Clock;
use crate::trip::{TripEnd, TripMap, interval_s};

/// The map, open for one record of one agent.
pub(super) struct Fold<'a> {
    pub(super) settings: &'a Settings,
    pub(super) modules: &'a GridModules,
    pub(super) revision: u64,
    pub(super) now: Clock,
    pub(super) framed: &'a mut bool,
    pub(super) places: &'a mut PlaceMap,
    pub(super) trips: &'a mut TripMap,
    pub(super) landmarks: &'a mut LandmarkMap,
    pub(super) percepts: &'a mut PerceptMap,
    pub(super) agent_id: AgentId,
    pub(super) agent: &'a mut Agent,
    /// The places that are held for the agent.
    pub(super) held: [Option<PlaceId>; 2],
    /// Stamp of the events.
    pub(super) stamp_ns: i64,
    pub(super) events: &'a mut Vec<Event>,
}

impl Fold<'_> {
    /// Lets go of a place and a trip that have been forgotten since the agent's record before this.
    pub(super) fn notice_what_is_gone(&mut self) {
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
        self.agent.session = Some(session);
        self.agent.next_seq = 0;
        self.agent.stamp_ns = None;
        self.agent.still_since = None;
        if self.agent.placed {
            self.agent.body.restart();
        } else {
            self.agent.body = Body::new(self.modules);
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
        }
        self.emit(EventKind::SamplesSkipped { from, to, reason });
    }

    /// Applies the next sample.
    pub(super) fn sample(&mut self, seq: u64, sample: &Sample) {
        self.stamp_ns = sample.stamp_ns;
        let before = self.agent.stamp_ns.replace(sample.stamp_ns);
        self.agent.next_seq = seq + 1;
        if before
            .is_some_and(|before| interval_s(before, sample.stamp_ns) > self.settings.trip_gap_s)
        {
            self.end_trip(TripEnd::Gap);
        }
        match &sample.body {
            SampleBody::Motion(motion) => return self.motion(seq, motion),
            SampleBody::Level(level) => self.level(level),
            SampleBody::Descriptor(descriptor) => self.descriptor(descriptor),
            SampleBody::Sighting(sighting) => self.sighting(sighting),
            SampleBody::StartPose(start) => self.start_pose(start),
            SampleBody::Marker(marker) => self.marker(marker),
        }
        self.rest();
    }

    /// A sighting. Those of landmarks teach the map; the pose is not corrected by them.
    fn sighting(&mut self, sighting: &Sighting) {
        self.agent.sightings += 1;
        if let Target::Landmark(label) = &sighting.target {
            self.define_frame();
            if self.agent.placed {
                self.landmark(label, &sighting.relation);
            }
        }
    }

    /// A landmark was seen by an agent that is placed.
    fn landmark(&mut self, label: &Label, relation: &Relation) {
        let estimate = seen(
            relation,
            self.agent.body.in_map(),
            self.agent.body.covariance(),
        );
        if let Some(landmark) = self.landmarks.by_label(label.as_str()) {
            self.landmarks
                .see(landmark, &estimate, self.stamp_ns, self.revision);
            return;
        }
        let position = estimate.position;
        let landmark = Landmark::learn(label.clone(), estimate, self.stamp_ns);
        if let Some(landmark) = self.landmarks.learn(landmark, self.revision) {
            self.emit(EventKind::LandmarkLearned { landmark, position });
        }
    }

    /// The agent was told where it stands.
    fn start_pose(&mut self, start: &StartPose) {
        self.end_trip(TripEnd::StartPose);
        self.agent.body.place(start, self.modules);
        self.agent.placed = true;
        *self.framed = true;
        self.agent.place = None;
        self.agent.entered = None;
        self.agent.still_since = None;
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
    /// stands.
    pub(super) fn define_frame(&mut self) {
        if !*self.framed {
            *self.framed = true;
            self.agent.placed = true;
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

    /// Holds the places that the agent needs now, and releases those that it no longer does.
    pub(super) fn hold(&mut self) {
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
