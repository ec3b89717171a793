//! Motion: path integration, place cells, trips.

use nalgebra::Point3;

use super::apply::{Fold, cell_entered};
use super::tuning::{ANSWER_MIN, ASK_PER_FIELD_RADIUS};
use crate::event::EventKind;
use crate::input::Motion;
use crate::memory::place::{Place, PlaceId, confidence};
use crate::memory::trip::{Leg, LegUnderWay, Trip, TripEnd, TripId, interval_s};
use crate::settings::Recruitment;

impl Fold<'_> {
    /// The body moved.
    pub(super) fn motion(&mut self, seq: u64, motion: &Motion) {
        self.define_frame();
        let (placed, agent, stamp_ns) = (self.agent.placed(), self.agent_id, self.stamp_ns);
        let increment = motion.increment();
        let step = self
            .estimator
            .motion(agent.0, stamp_ns, motion, &mut self.effects);
        self.apply_effects();
        if let Some(episode) = &mut self.agent.episode {
            episode.go(&step.increment, &step.variance);
        }
        let events = &mut *self.events;
        let entered = |module, reference| {
            events.extend(cell_entered(placed, agent, stamp_ns, module, reference));
        };
        let in_odom = self.estimator.in_odom(agent.0).unwrap_or_default();
        let path_m = increment.translation.vector.norm();
        let displacement = &step.displacement;
        self.agent
            .announced
            .step(&in_odom, path_m, displacement, self.modules, entered);
        self.update_pose();
        if !self.agent.placed() {
            return;
        }
        if self.may_be_anywhere() {
            (self.agent.place, self.agent.entered) = (None, None);
            return;
        }
        if let Some(leg) = &mut self.agent.recorder.leg {
            leg.extend(increment, &step.variance);
        }
        let drawn = match self.settings.recruitment {
            Recruitment::Novelty => false,
            Recruitment::Bernoulli { probability } => {
                let session = self.agent.session();
                random::uniform(self.settings.seed, [u64::from(agent.0), session, seq])
                    < probability
            }
        };
        let rests = self.rest();
        let position = self.position();
        let moved = self
            .agent
            .asked_at
            .is_none_or(|at| self.is_step_away(&at, &position));
        if drawn || (moved && !rests) {
            self.ask_places(&position, drawn);
        }
    }

    /// Ends the trip of an agent that has stayed where it is for long; answers whether it has.
    pub(super) fn rest(&mut self) -> bool {
        if !self.agent.placed() {
            return false;
        }
        let position = self.position();
        match self.agent.still_since {
            Some((at, since_ns)) if !self.is_step_away(&at, &position) => {
                let rests = interval_s(since_ns, self.stamp_ns) >= self.settings.trip_stillness_s;
                let recorder = &self.agent.recorder;
                if rests && (recorder.leg.is_some() || recorder.trip.is_some()) {
                    self.end_trip(TripEnd::Stillness);
                }
                rests
            }
            _ => {
                self.agent.still_since = Some((position, self.stamp_ns));
                false
            }
        }
    }

    /// Asks which place answers here; recruits one, enters one, closes the leg under way.
    fn ask_places(&mut self, position: &Point3<f64>, drawn: bool) {
        self.agent.asked_at = Some(*position);
        let winner = self.places.winner(position);
        let novel = match self.settings.recruitment {
            Recruitment::Novelty => {
                winner.is_none_or(|(_, distance_m)| self.confidence(distance_m) < ANSWER_MIN)
            }
            // Two places closer than a step of asking could not be told apart, and without a bound
            // on their density neither would there be one on the search among them.
            Recruitment::Bernoulli { .. } => {
                drawn && winner.is_none_or(|(_, distance_m)| distance_m >= self.ask_step_m())
            }
        };
        if novel && let Some(place) = self.recruit(position) {
            self.agent.place = Some((place, 1.0));
            self.agent.entered = Some(place);
            self.arrive(place);
            return;
        }
        self.agent.place = winner.map(|(place, distance_m)| (place, self.confidence(distance_m)));
        match self.agent.place {
            Some((place, confidence)) if confidence >= ANSWER_MIN => {
                if self.agent.entered != Some(place) {
                    self.agent.entered = Some(place);
                    self.places
                        .visit(place, self.stamp_ns, self.now, self.revision);
                    self.emit(EventKind::PlaceEntered { place, confidence });
                }
                self.arrive(place);
            }
            Some(_) => {}
            // An agent that hovers at the rim of a field does not enter it again and again; one
            // that has left the reach of all places enters the next one afresh.
            None => self.agent.entered = None,
        }
    }

    /// Recruits a place cell where the agent is. None when there is no room for it: other
    /// agents hold all places, or there are no more identifiers.
    fn recruit(&mut self, position: &Point3<f64>) -> Option<PlaceId> {
        // The place that answers too weakly is not held any more.
        self.agent.place = None;
        self.hold_places();
        if !self.make_room_for_place() {
            return None;
        }
        let rotation = self.agent.announced.in_map().rotation;
        let covariance = self.estimator.covariance(self.agent_id.0)?;
        let position_sd_m = covariance
            .in_map_axes(&rotation)
            .diagonal()
            .fixed_rows::<3>(0)
            .map(|x| x.max(0.0).sqrt());
        let (founder, stamp_ns) = (self.agent_id, self.stamp_ns);
        let place = Place::found(
            *position,
            rotation,
            position_sd_m,
            founder,
            stamp_ns,
            self.now,
        );
        let place = self.places.recruit(place, self.revision)?;
        let graph = &mut self.keyframes.graph;
        if let Some(attachment) = graph.attach_place(self.agent_id.0, place.0) {
            self.places.set_attachment(place, attachment, self.revision);
        }
        self.emit(EventKind::PlaceRecruited {
            place,
            position: *position,
        });
        Some(place)
    }

    /// The agent is in the field of a place: the leg under way ends here if it started elsewhere,
    /// and the next one starts here.
    fn arrive(&mut self, place: PlaceId) {
        self.agent.home.get_or_insert(place);
        match &self.agent.recorder.leg {
            Some(leg) if leg.from() == place => return,
            Some(leg) => {
                let announced = &self.agent.announced;
                let done = leg.finish(place, self.stamp_ns, announced.in_map());
                let (start_stamp_ns, start) = (leg.start_stamp_ns(), *leg.start_in_place());
                let recorded = self.record(done.clone(), start_stamp_ns);
                self.travel(&done, &start, recorded);
            }
            None => {}
        }
        let Some(at) = self.places.get(place).map(Place::pose) else {
            return;
        };
        let in_map = self.agent.announced.in_map();
        let leg = LegUnderWay::start(place, &at, self.stamp_ns, in_map);
        self.agent.recorder.leg = Some(leg);
    }

    /// Appends a leg to the trip under way, or to a new one; answers the trip, and the number of
    /// the leg in it.
    fn record(&mut self, leg: Leg, start_stamp_ns: i64) -> Option<(TripId, u32)> {
        let ends = [leg.from(), leg.to()];
        self.travel_again(ends);
        if !self.make_room_for_leg() {
            return None;
        }
        let trip = self.trip_under_way(start_stamp_ns)?;
        let number = self.trips.get(trip).map_or(0, Trip::leg_count);
        let full = self.trips.push_leg(trip, leg, self.stamp_ns, self.revision);
        for place in ends {
            if self.trip_through(place).is_none() {
                self.places.set_trip(place, trip, self.revision);
            }
        }
        if full {
            self.close_trip(TripEnd::Full);
        }
        Some((trip, u32::try_from(number).ok()?))
    }

    /// A leg between two places that the same earlier trip leads through is that trip's, travelled
    /// again.
    fn travel_again(&mut self, [from, to]: [PlaceId; 2]) {
        let earlier = self.trip_through(from);
        if let Some(trip) = earlier
            && earlier == self.trip_through(to)
            && earlier != self.agent.recorder.trip
        {
            self.trips.travel_again(trip, self.now, self.revision);
        }
    }

    /// The trip that is known to lead through a place.
    fn trip_through(&self, place: PlaceId) -> Option<TripId> {
        let trip = self.places.get(place)?.trip?;
        self.trips.get(trip).map(|_| trip)
    }

    /// The trip under way, or a new one. None when there have been as many as a space can have.
    fn trip_under_way(&mut self, start_stamp_ns: i64) -> Option<TripId> {
        if self.agent.recorder.trip.is_none() {
            let session = self.agent.session();
            let trip = Trip::new(self.agent_id, session, start_stamp_ns, self.now);
            let trip = self.trips.begin(trip, self.revision)?;
            self.agent.recorder.trip = Some(trip);
            self.emit(EventKind::TripStarted { trip });
        }
        self.agent.recorder.trip
    }

    /// Where the agent is in `map`.
    fn position(&self) -> Point3<f64> {
        self.agent.announced.in_map().translation.vector.into()
    }

    /// Confidence of a place at a distance.
    fn confidence(&self, distance_m: f64) -> f64 {
        confidence(distance_m, self.settings.field_radius_m)
    }

    /// Distance after which the places are asked again \[m\].
    fn ask_step_m(&self) -> f64 {
        ASK_PER_FIELD_RADIUS * self.settings.field_radius_m
    }

    /// Whether two positions are a step of asking apart.
    fn is_step_away(&self, from: &Point3<f64>, to: &Point3<f64>) -> bool {
        (to - from).norm_squared() >= self.ask_step_m().powi(2)
    }
}
