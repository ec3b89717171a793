//! Levels: they teach places, say where the agent is among them, and whether it is there at all.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use place_filter::{Field, Found, Kernel, Measured, Seeker, SensedLevel, Support, Trace};

use super::apply::Fold;
use super::tuning::{NEAR_REACHES, OWN_SURER, UPRIGHT_SD_RAD};
use crate::estimator::{ExternalEstimate, LevelRow};
use crate::event::EventKind;
use crate::input::Level;
use crate::memory::percept::{PerceptMap, Sensed};
use crate::memory::place::{PlaceId, PlaceMap};
use crate::memory::trip::TripEnd;
use geometry::PoseCovariance;

/// What the places of the map remember of levels, for one agent.
struct Levels<'a> {
    places: &'a PlaceMap,
    percepts: &'a PerceptMap,
    agent: u32,
    /// Variance of the agent's position along an axis \[m²\]; infinite where it is not known.
    variance_m2: f64,
}

impl Fold<'_> {
    /// A level was sensed, where the sensor is.
    pub(super) fn level(&mut self, level: &Level) {
        self.agent.percepts += 1;
        self.touch(|episode, objects| episode.level(level, objects));
        self.feel(level);
        let sensor = self.agent.announced.in_map() * Point3::from(*level.offset_m());
        let Some((place, weight)) = self.answering(&sensor) else {
            return;
        };
        let Some(at) = self.places.get(place).map(|place| *place.position()) else {
            return;
        };
        let covariance = self.estimator.covariance(self.agent_id.0);
        let sensed = Sensed {
            place,
            weight,
            value: level.value(),
            offset_m: sensor - at,
            spread_m2: covariance.map_or(f64::MAX, |covariance| axis_variance_m2(&covariance)),
            agent: self.agent_id.0,
            stamp_ns: self.stamp_ns,
        };
        let compared = self
            .percepts
            .learn_level(level.channel(), &sensed, self.revision);
        self.compared(place, compared);
    }

    /// Finds out by what the agent feels where it is.
    fn feel(&mut self, level: &Level) {
        let number = self.agent_id.0;
        let Some(channel) = self.percepts.level_channel(level.channel(), level.value()) else {
            return;
        };
        let Some(in_odom) = self.estimator.in_odom(number) else {
            return;
        };
        if self.head((channel, level.value()), &in_odom) {
            return self.go_on_seeking();
        }
        let sensed = SensedLevel {
            channel,
            value: level.value(),
            offset_m: *level.offset_m(),
            in_odom,
        };
        let mut filter = std::mem::take(&mut self.agent.filter);
        if !self.percepts.is_usual(channel, sensed.value) {
            if filter.take_unusual(&sensed, &self.levels_of(f64::INFINITY)) {
                let unusual = Some(sensed.value);
                self.percepts
                    .learn_of(channel, number, unusual, self.revision);
            }
            self.agent.filter = filter;
            return self.go_on_seeking();
        }
        let is_complete = filter.take(&sensed, &self.levels_of(f64::INFINITY));
        if is_complete {
            for (channel, value, earlier) in filter.lessons() {
                self.percepts.learn_of(channel, number, None, self.revision);
                self.percepts
                    .learn_variogram(channel, value, earlier, self.revision);
            }
        }
        self.agent.filter = filter;
        if !is_complete {
            return self.go_on_seeking();
        }
        let Some((pose, covariance)) = self.estimator.pose(number) else {
            return;
        };
        if self.agent.placed() && !self.is_lost(&covariance) {
            self.follow(&pose, &covariance, &in_odom);
        }
        self.seek_by_levels();
    }

    /// Goes on with a search that is under way.
    pub(super) fn go_on_seeking(&mut self) {
        if self.agent.filter.is_searching() {
            self.seek_by_levels();
        }
    }

    /// Searches for the place of an agent that does not know where it is, by a part.
    fn seek_by_levels(&mut self) {
        let number = self.agent_id.0;
        let Some((pose, covariance)) = self.estimator.pose(number) else {
            return;
        };
        let Some(in_odom) = self.estimator.in_odom(number) else {
            return;
        };
        let sd_m = axis_variance_m2(&covariance).sqrt();
        let is_known = self.agent.placed() && !self.is_lost(&covariance);
        let field = self.levels_of(f64::INFINITY);
        if is_known && !self.agent.filter.is_vague(sd_m, &field) {
            return self.agent.filter.end_search();
        }
        let level = UnitQuaternion::identity();
        // One that was in the map is upright as it was, or as when it was put down.
        let upright = [pose.rotation * in_odom.rotation.inverse(), level];
        let is_placed = self.agent.placed();
        let seeker = Seeker {
            in_odom,
            upright: if is_placed {
                &upright[..1]
            } else {
                &upright[1..]
            },
            upright_sd_rad: if is_placed {
                UPRIGHT_SD_RAD.1
            } else {
                UPRIGHT_SD_RAD.0
            },
            is_planar: self.estimator.is_planar(number),
            sd_max_m: self.settings.field_radius_m,
        };
        let mut filter = std::mem::take(&mut self.agent.filter);
        let found = filter.seek(&seeker, &self.levels_of(f64::INFINITY));
        self.agent.filter = filter;
        let Some(found) = found else {
            return;
        };
        let estimate = ExternalEstimate {
            pose: found.pose,
            covariance: found.covariance,
            calibration: None,
            prevails: false,
        };
        let is_taken = is_known && self.estimator.fuse(number, &estimate, &mut self.effects);
        self.apply_effects();
        if is_taken {
            self.agent.filter.end_search();
            self.update_pose();
        } else {
            self.found_by_levels(&found);
        }
    }

    /// Corrects the pose of an agent that knows where it is.
    fn follow(
        &mut self,
        pose: &Isometry3<f64>,
        covariance: &PoseCovariance,
        in_odom: &Isometry3<f64>,
    ) {
        let field = self.levels_of(axis_variance_m2(covariance));
        let filter = &self.agent.filter;
        let measurements = filter.measurements((pose, covariance), in_odom, &field);
        if measurements.is_empty() {
            return;
        }
        let rows: Vec<_> = measurements
            .iter()
            .map(|measurement| LevelRow {
                jacobian: measurement.jacobian,
                residual: measurement.residual,
                variance: measurement.variance,
                floor: measurement.floor,
            })
            .collect();
        let spreads = self
            .estimator
            .levels(self.agent_id.0, &rows, &mut self.effects);
        self.apply_effects();
        let spreads = spreads.into_iter().map(|spread| Measured { spread });
        let measured: Vec<_> = measurements.into_iter().zip(spreads).collect();
        if self.agent.filter.judge(&measured) {
            return self.lose_agent();
        }
        self.update_pose();
    }

    /// The agent found where it is.
    fn found_by_levels(&mut self, found: &Found) {
        let number = self.agent_id.0;
        let was_placed = self.agent.placed();
        self.estimator
            .recognised(number, &found.pose, &found.covariance, &mut self.effects);
        self.apply_effects();
        let moment = self.moment();
        self.keyframes
            .found(&moment, was_placed.then_some(&found.pose));
        self.agent.filter.end_search();
        self.end_trip(TripEnd::StartPose);
        self.place_agent();
        let position = found.pose.translation.vector.into();
        self.emit(EventKind::AgentPlaced { position });
    }

    fn levels_of(&self, variance_m2: f64) -> Levels<'_> {
        Levels {
            places: self.places,
            percepts: self.percepts,
            agent: self.agent_id.0,
            variance_m2,
        }
    }
}

impl Levels<'_> {
    /// What a place remembers that counts for the agent: what it has taught itself while it was
    /// hardly surer than now says nothing new.
    fn trace(&self, place: PlaceId, channel: u8) -> Option<&Trace> {
        let trace = self.percepts.trace(place, channel)?;
        let is_old = trace.teacher == self.agent && OWN_SURER * trace.spread_m2 > self.variance_m2;
        (!is_old).then_some(trace)
    }
}

impl Field for Levels<'_> {
    fn kernel(&self, channel: u8) -> Option<&Kernel> {
        self.percepts.kernel(channel)
    }

    fn nearest(&self, at: &Point3<f64>) -> Option<u32> {
        self.places.winner(at).map(|(place, _)| place.0)
    }

    fn near(&self, at: &Point3<f64>, reach_m: f64) -> Vec<(u32, Point3<f64>)> {
        let radius_m = reach_m.min(NEAR_REACHES * self.places.reach_m());
        let mut found = self.places.within(at, radius_m);
        found.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        let positions = found.into_iter().filter_map(|(id, _)| {
            let place = self.places.get(id)?;
            Some((id.0, *place.position()))
        });
        positions.collect()
    }

    fn level(&self, place: u32, channel: u8) -> Option<f64> {
        Some(self.trace(PlaceId(place), channel)?.value)
    }

    fn support(&self, place: u32, channel: u8) -> Option<Support> {
        let place = PlaceId(place);
        let trace = self.trace(place, channel)?;
        let is_own = trace.teacher == self.agent;
        Some(Support {
            at: self.places.get(place)?.position() + trace.offset_m,
            value: trace.value,
            spread_m2: trace.spread_m2,
            own_m2: if is_own { trace.spread_m2 } else { 0.0 },
        })
    }

    fn places_from(&self, first: u32) -> Box<dyn Iterator<Item = u32> + '_> {
        let places = self.places.iter_from(PlaceId(first));
        Box::new(places.map(|(place, _)| place.0))
    }

    fn extent_m(&self) -> Vector3<f64> {
        let least = 2.0 * self.places.reach_m();
        self.places.extent_m().map(|extent_m| extent_m.max(least))
    }
}

/// Largest variance of a position along an axis of the body \[m²\].
fn axis_variance_m2(covariance: &PoseCovariance) -> f64 {
    let diagonal = covariance.matrix().diagonal();
    diagonal.fixed_rows::<3>(0).max().max(0.0)
}
