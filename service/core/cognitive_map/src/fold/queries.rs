//! Questions to a map that need no computation.

use nalgebra::{Isometry3, Point3};

use super::CognitiveMap;
use super::header::Header;
use crate::agent::{Agent, Status};
use crate::input::AgentId;
use crate::input::Label;
use crate::memory::landmark::{Landmark, LandmarkId};
use crate::memory::percept::{Channel, ChannelId, Remembered};
use crate::memory::place::{Place, PlaceId};
use crate::memory::recall::{self, RecallCue, Recalled, Rivals};
use crate::memory::strength::Clock;
use crate::memory::trip::{Trip, TripId};
use crate::memory::way::{Way, Waypoint};
use crate::settings::Settings;
use geometry::PoseCovariance;
use grid::GridModules;
use state::Digest;
use state::{State, StateWriter};

impl CognitiveMap {
    /// Settings of the space.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Grid modules of the space.
    pub fn modules(&self) -> &GridModules {
        &self.modules
    }

    /// Number of records that had an effect; duplicates do not count.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Digest of the whole map, the settings included: equal digests, equal maps, now and after any
    /// further records.
    ///
    /// Only what changed since the last digest (of this map or of the one it was cloned from) is
    /// hashed anew.
    pub fn digest(&self) -> Digest {
        let mut out = StateWriter::default();
        Header::of(self).write(&mut out);
        self.agents.write_digests(&mut out);
        self.places.places().write_digests(&mut out);
        self.trips.write_digests(&mut out);
        self.landmarks.landmarks().write_digests(&mut out);
        self.percepts.write_digests(&mut out);
        self.estimator.write(&mut out);
        self.keyframes.digest().0.write(&mut out);
        self.objects.write_digests(&mut out);
        if !self.ways.is_untouched() {
            self.ways.write_digests(&mut out);
        }
        if !self.guidance.is_untouched() {
            self.write_guidance(&mut out);
        }
        out.digest()
    }

    /// The agent with a name.
    pub fn agent_by_name(&self, name: &Label) -> Option<AgentId> {
        self.names.get(name).copied()
    }

    /// Number of agents, without those that have been removed.
    pub fn agent_count(&self) -> usize {
        self.names.len()
    }

    /// Number of identifiers of agents that have been given out, those of removed ones included.
    pub fn agent_numbers(&self) -> usize {
        self.agents.len()
    }

    /// The agents by number, without those that have been removed.
    pub fn agents(&self) -> impl Iterator<Item = (AgentId, &Agent)> {
        self.agents_ever().filter(|(_, agent)| agent.is_enrolled())
    }

    /// The agents by number, removed ones included.
    pub fn agents_ever(&self) -> impl Iterator<Item = (AgentId, &Agent)> {
        (0..).map(AgentId).zip(self.agents.iter())
    }

    /// An agent, also one that has been removed.
    pub fn agent(&self, agent: AgentId) -> Option<&Agent> {
        self.agents.get(agent.0 as usize)
    }

    /// Covariance of an agent's pose, as of its latest record or of a later one that corrected it.
    pub fn covariance(&self, agent: AgentId) -> Option<PoseCovariance> {
        self.estimator.covariance(agent.0)
    }

    /// Whether an agent's pose is one in the map. That of another one is in another frame, which
    /// agents that have found one another share.
    pub fn is_in_map(&self, agent: AgentId) -> bool {
        self.estimator.is_in_map(agent.0)
    }

    /// How well an agent is localised.
    pub fn status(&self, agent: AgentId) -> Option<Status> {
        let position_sd_m = self.covariance(agent)?.position_sd_m();
        if !self.is_in_map(agent) {
            return Some(Status::Lost);
        }
        Some(Status::of(
            self.agent(agent)?,
            position_sd_m,
            self.estimator.is_doubted(agent.0),
            &self.settings,
        ))
    }

    /// Number of places.
    pub fn place_count(&self) -> usize {
        self.places.len()
    }

    /// Bytes of memory that the places and all that finds them take, reserved ones included.
    pub fn place_bytes(&self) -> usize {
        self.places.bytes()
    }

    /// Bytes of memory that places, trips, ways, what is remembered of percepts and what can be
    /// smoothed take, reserved ones included: all that budgets bound.
    pub fn memory_bytes(&self) -> usize {
        self.places.bytes()
            + self.trips.bytes()
            + self.ways.bytes()
            + self.percepts.bytes()
            + self.keyframes.bytes()
    }

    /// Number of places ever recruited, forgotten ones included: the identifier of the next one.
    pub fn places_recruited(&self) -> usize {
        self.places.places().next_index()
    }

    /// Whether there was such a place that has been forgotten.
    pub fn is_forgotten_place(&self, place: PlaceId) -> bool {
        self.places.is_forgotten(place)
    }

    /// Strength of a place: its founding and each visit count one when they happen, and half as
    /// much after every half-life. 0 for a place that is not there.
    pub fn place_strength(&self, place: PlaceId) -> f64 {
        let place = self.places.get(place);
        place.map_or(0.0, |place| place.strength.now(self.clock()))
    }

    /// The places, in the order of recruitment.
    pub fn places(&self) -> impl Iterator<Item = (PlaceId, &Place)> {
        self.places_from(PlaceId(0))
    }

    /// The places from one on, in the order of recruitment.
    pub fn places_from(&self, first: PlaceId) -> impl Iterator<Item = (PlaceId, &Place)> {
        self.places.iter_from(first)
    }

    /// Identifiers of all places that were recruited, moved, visited or forgotten after a revision,
    /// and of some others, in order: at most 64 for each of those. Nothing that was forgotten
    /// before the map was restored from a checkpoint is among them, so `since_revision` must not be
    /// below the checkpoint's.
    pub fn places_near_changes(&self, since_revision: u64) -> impl Iterator<Item = PlaceId> {
        self.places.ids_near_changes(since_revision)
    }

    /// A place.
    pub fn place(&self, place: PlaceId) -> Option<&Place> {
        self.places.get(place)
    }

    /// The place nearest to a position in `map`, with its distance \[m\]; of equally near ones that
    /// of the lowest identifier. Quick within two field radii of a place, a scan elsewhere.
    pub fn nearest_place(&self, position: &Point3<f64>) -> Option<(PlaceId, f64)> {
        self.places.nearest(position)
    }

    /// The places that answer a cue, best first, equally good ones by identifier. Exact where
    /// [`RecallCue`] says so.
    ///
    /// By position the nearest come first, by code the most similar, by a percept the places whose
    /// memory it fits best, and no others answer. By several of them the confidences are
    /// multiplied. Without a cue the place visited last comes first. The cost is said at
    /// [`RecallCue`].
    pub fn recall(&self, cue: &RecallCue) -> Vec<Recalled> {
        recall::recall(
            cue,
            &self.places,
            &self.percepts,
            &self.modules,
            &self.settings,
        )
    }

    /// The channels of percepts, in the order in which places first remembered something of them.
    pub fn channels(&self) -> impl Iterator<Item = (ChannelId, &Channel)> {
        (0..).map(ChannelId).zip(self.percepts.channels().iter())
    }

    /// A channel.
    pub fn channel(&self, channel: ChannelId) -> Option<&Channel> {
        self.percepts.channels().get(channel.0.into())
    }

    /// What a place remembers of what was sensed and seen there, channel by channel.
    pub fn remembered(&self, place: PlaceId) -> impl Iterator<Item = Remembered> {
        self.percepts.of_place(place)
    }

    /// The places elsewhere that answer a cue nearly as well as `best` does, the first of its
    /// answers.
    ///
    /// `None` when the answer is unambiguous, and for cues that hold no code, or a position or a
    /// percept as well.
    pub fn rivals(&self, cue: &RecallCue, best: &Recalled) -> Option<Rivals> {
        recall::rivals(cue, best, &self.places, &self.modules, &self.settings)
    }

    /// Number of trips.
    pub fn trip_count(&self) -> usize {
        self.trips.len()
    }

    /// The trips, in the order of recording.
    pub fn trips(&self) -> impl Iterator<Item = (TripId, &Trip)> {
        self.trips_from(TripId(0))
    }

    /// The trips from one on, in the order of recording.
    pub fn trips_from(&self, first: TripId) -> impl Iterator<Item = (TripId, &Trip)> {
        self.trips.iter_from(first)
    }

    /// A trip.
    pub fn trip(&self, trip: TripId) -> Option<&Trip> {
        self.trips.get(trip)
    }

    /// Number of trips ever recorded, forgotten ones included: the identifier of the next one.
    pub fn trips_recorded(&self) -> usize {
        self.trips.recorded()
    }

    /// Number of legs of all trips.
    pub fn leg_count(&self) -> usize {
        self.trips.legs()
    }

    /// Whether there was such a trip that has been forgotten.
    pub fn is_forgotten_trip(&self, trip: TripId) -> bool {
        self.trips.is_forgotten(trip)
    }

    /// Strength of a trip: its recording counts one when it begins, and so does travelling all of
    /// it again, part by part; and each half as much after every half-life. 0 for a trip that is
    /// not there.
    pub fn trip_strength(&self, trip: TripId) -> f64 {
        let trip = self.trips.get(trip);
        trip.map_or(0.0, |trip| trip.strength.now(self.clock()))
    }

    /// Number of ways.
    pub fn way_count(&self) -> usize {
        self.ways.len()
    }

    /// Bytes of memory that the ways and all that finds them take, reserved ones included.
    pub fn way_bytes(&self) -> usize {
        self.ways.bytes()
    }

    /// The ways, in no particular order.
    pub fn ways(&self) -> impl Iterator<Item = &Way> {
        self.ways.iter().map(|(_, way)| way)
    }

    /// The ways from a number on, by their numbers, which others get once they are forgotten.
    pub fn ways_from(&self, first: u32) -> impl Iterator<Item = (u32, &Way)> {
        self.ways.iter_from(first)
    }

    /// The way between two places.
    pub fn way(&self, a: PlaceId, b: PlaceId) -> Option<&Way> {
        self.ways.between(a, b)
    }

    /// How the places of a way lie now: the second in the frame of the first.
    pub fn places_of_way(&self, way: &Way) -> Option<Isometry3<f64>> {
        self.ways.places_of(way)
    }

    /// Strength of a way: each traversal counts one when it happens, and half as much after every
    /// half-life.
    pub fn way_strength(&self, way: &Way) -> f64 {
        way.strength.now(self.clock())
    }

    /// The places that ways lead to, forgotten ones included, in no particular order.
    pub fn waypoints(&self) -> impl Iterator<Item = &Waypoint> {
        self.ways.waypoints().map(|(_, waypoint)| waypoint)
    }

    /// Where ways lead to a place, also to a forgotten one.
    pub fn waypoint(&self, place: PlaceId) -> Option<&Waypoint> {
        self.ways.waypoint(self.ways.at(place)?)
    }

    /// The ways that lead to a place, by the number of the place at their other end.
    pub fn ways_at(&self, place: PlaceId) -> impl Iterator<Item = &Way> {
        let edges = self.waypoint(place).map(Waypoint::edges);
        let edges = edges.unwrap_or_default().iter();
        edges.filter_map(|edge| self.ways.way(edge.way))
    }

    /// The space's clock.
    pub(super) fn clock(&self) -> Clock {
        Clock::at(self.revision, &self.settings)
    }

    /// Number of landmarks, those set aside included.
    pub fn landmark_count(&self) -> usize {
        let known = self.landmarks.landmarks().len();
        known
            - self
                .estimator
                .other_names()
                .filter(|label| self.landmarks.by_label(label.as_str()).is_some())
                .count()
    }

    /// The landmarks, in the order of learning; one with several names once, and those that are set
    /// aside not at all.
    pub fn landmarks(&self) -> impl Iterator<Item = (LandmarkId, &Landmark)> {
        let landmarks = (0..).map(LandmarkId).zip(self.landmarks.landmarks().iter());
        landmarks.filter(|(_, landmark)| self.is_told(landmark))
    }

    /// Whether a landmark goes by its label, and was not seen only by agents that are set aside.
    fn is_told(&self, landmark: &Landmark) -> bool {
        self.is_named_so(landmark) && !self.is_aside(landmark)
    }

    fn is_aside(&self, landmark: &Landmark) -> bool {
        let observers = landmark.observers();
        observers.are_all(|agent| self.estimator.is_aside(agent))
    }

    /// Whether a landmark goes by its label, and not by another name.
    fn is_named_so(&self, landmark: &Landmark) -> bool {
        self.estimator.name_of(landmark.label()) == landmark.label()
    }

    /// The landmarks in the order of their labels (by bytes), from the first one after `label` on;
    /// all of them without one.
    pub fn landmarks_after(
        &self,
        label: Option<&str>,
    ) -> impl Iterator<Item = (LandmarkId, &Landmark)> {
        self.landmarks
            .after(label)
            .filter_map(|id| Some((id, self.landmarks.get(id)?)))
            .filter(|(_, landmark)| self.is_told(landmark))
    }

    /// A landmark.
    pub fn landmark(&self, landmark: LandmarkId) -> Option<&Landmark> {
        self.landmarks.get(landmark)
    }

    /// The landmark with a label, or with a label that turned out to be another name of it.
    pub fn landmark_by_label(&self, label: &str) -> Option<(LandmarkId, &Landmark)> {
        let known = Label::new(label).ok()?;
        let id = self
            .landmarks
            .by_label(self.estimator.name_of(&known).as_str())?;
        let landmark = self.landmarks.get(id)?;
        (!self.is_aside(landmark)).then_some((id, landmark))
    }
}
