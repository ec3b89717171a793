//! Descriptors: they teach places, and recognise them.

use nalgebra::Point3;

use super::apply::Fold;
use super::tuning::{ANSWER_MIN, DRIFT_MAX, KIDNAPPED_SD};
use crate::agent::Status;
use crate::estimator::ExternalEstimate;
use crate::event::EventKind;
use crate::input::Descriptor;
use crate::keyframes::{Relocalised, View};
use crate::memory::percept::Compared;
use crate::memory::place::{PlaceId, confidence};
use crate::memory::trip::TripEnd;
use geometry::PoseCovariance;

impl Fold<'_> {
    /// A descriptor was seen, where the body is.
    pub(super) fn descriptor(&mut self, descriptor: &Descriptor) {
        self.agent.percepts += 1;
        self.touch(|episode, objects| episode.descriptor(descriptor, objects));
        self.recognise_place(descriptor);
        let body = self.agent.announced.in_map().translation.vector.into();
        let Some(answering) = self.answering(&body) else {
            return;
        };
        let (stamp_ns, revision) = (self.stamp_ns, self.revision);
        let compared = self
            .percepts
            .learn_descriptor(descriptor, answering, stamp_ns, revision);
        self.compared(answering.0, compared);
    }

    /// Remembers what an agent of the map saw, and finds out whether it has come where something
    /// like it was seen. One that does not know where it is finds that out.
    fn recognise_place(&mut self, descriptor: &Descriptor) {
        let number = self.agent_id.0;
        let Some((_, covariance)) = self.estimator.pose(number) else {
            return;
        };
        let Some(in_odom) = self.estimator.in_odom(number) else {
            return;
        };
        let moment = self.moment();
        let view = self
            .keyframes
            .observe(&moment, descriptor, in_odom, covariance);
        let is_lost = self.is_lost(&covariance);
        if self.agent.placed() && !is_lost {
            let accepted = self.agent.evidence().accepted;
            if self.keyframes.is_contradicted(&view, accepted) {
                return self.lose_agent();
            }
        }
        if self.wake(&view) {
            return;
        }
        let is_sought = self.keyframes.is_seeking(number);
        if self.agent.placed() && !is_sought {
            // Where a kidnapped agent sees it is not known.
            if !(is_lost && self.keyframes.is_kidnapped(number)) {
                self.keyframes.view(&view);
            }
            if !is_lost {
                return self.track(&view);
            }
        }
        let sd_max_m = self.settings.field_radius_m;
        if let Some(found) = self.keyframes.seek(&view, sd_max_m) {
            self.relocalised(&found);
        }
    }

    /// Corrects the pose of an agent that knows about where it is, by what it sees in a map that
    /// views hold together. One that is followed since it was found is corrected by that.
    fn track(&mut self, view: &View<'_>) {
        if self.keyframes.is_waking(self.agent_id.0) {
            return;
        }
        let Some(tracked) = self.keyframes.track(view, self.stamp_ns) else {
            return;
        };
        let (pose, covariance) = (&tracked.pose, &tracked.covariance);
        self.estimator
            .settle(self.agent_id.0, pose, covariance, &mut self.effects);
        self.apply_effects();
        self.update_pose();
    }

    /// Lets an agent that knows where it is teach what views say of cells, and finds one that does
    /// not among them. Answers whether it was found now.
    fn wake(&mut self, view: &View<'_>) -> bool {
        let number = self.agent_id.0;
        let is_placed = self.agent.placed() && !self.keyframes.is_kidnapped(number);
        let is_followed = is_placed && self.keyframes.is_waking(number);
        if is_placed && !is_followed {
            self.keyframes.teach_cells(view, self.sensed_turn());
            return false;
        }
        let turn = self.sensed_turn();
        let Some(found) = self.keyframes.wake(view, turn) else {
            return false;
        };
        let estimate = ExternalEstimate {
            pose: found.pose,
            covariance: found.covariance,
            calibration: None,
            prevails: false,
        };
        if is_followed && self.estimator.fuse(number, &estimate, &mut self.effects) {
            self.apply_effects();
            self.update_pose();
            return false;
        }
        let was_placed = self.agent.placed();
        self.estimator
            .recognised(number, &found.pose, &found.covariance, &mut self.effects);
        self.apply_effects();
        let moment = self.moment();
        self.keyframes
            .found_among_cells(&moment, was_placed.then_some(&found.pose));
        self.end_trip(TripEnd::StartPose);
        self.place_agent();
        let position = found.pose.translation.vector.into();
        self.emit(EventKind::AgentPlaced { position });
        true
    }

    /// Whether an agent in the map is known so little that it may be anywhere.
    pub(super) fn is_lost(&self, covariance: &PoseCovariance) -> bool {
        let is_doubted = self.estimator.is_doubted(self.agent_id.0);
        let sd_m = covariance.position_sd_m();
        Status::of(self.agent, sd_m, is_doubted, self.settings) == Status::Lost
    }

    /// Whether an agent of the map may be anywhere in it, since what it saw contradicted where it
    /// was thought to be: what it does until it is found again belongs to no place.
    pub(super) fn may_be_anywhere(&self) -> bool {
        let number = self.agent_id.0;
        let covariance = || self.estimator.covariance(number);
        self.keyframes.is_kidnapped(number) && covariance().is_none_or(|own| self.is_lost(&own))
    }

    /// What the agent sees contradicts its estimate: it may be anywhere from now on, and what it
    /// sensed before was elsewhere.
    pub(super) fn lose_agent(&mut self) {
        self.agent.filter.cut();
        let moment = self.moment();
        self.end_trip(TripEnd::Gap);
        self.end_episode();
        let sd_m = KIDNAPPED_SD * self.settings.lost_sd_m;
        self.estimator.lose(self.agent_id.0, sd_m);
        self.keyframes.declare_kidnapped(&moment);
        self.place_agent();
    }

    /// The agent recognised where it is.
    fn relocalised(&mut self, found: &Relocalised) {
        let number = self.agent_id.0;
        let was_placed = self.agent.placed();
        // One that only drifted is where it may have drifted to: its way leads there. One that was
        // put in a wrong place, by views of two places that look the same, is put anew.
        let is_refused = was_placed && !found.is_first && !self.fuse(found);
        let is_elsewhere = is_refused || (was_placed && found.is_first && self.is_elsewhere(found));
        if is_elsewhere || !was_placed {
            let (pose, covariance) = (&found.pose, &found.covariance);
            self.estimator
                .recognised(number, pose, covariance, &mut self.effects);
            self.apply_effects();
        }
        if found.is_first {
            self.fuse(found);
        }
        if found.is_first || found.is_last || is_elsewhere {
            let moment = self.moment();
            self.keyframes.relocalised(&moment, found, is_elsewhere);
        }
        if found.is_first || is_elsewhere {
            let seq = self.moment().seq;
            self.keyframes.confirm_pose(number, seq);
        }
        if is_elsewhere {
            self.end_trip(TripEnd::StartPose);
            self.place_agent();
            let position = found.pose.translation.vector.into();
            self.emit(EventKind::AgentPlaced { position });
        } else {
            self.update_pose();
        }
    }

    /// Fuses the pose at which the agent recognised itself; answers whether it was accepted.
    fn fuse(&mut self, found: &Relocalised) -> bool {
        let estimate = ExternalEstimate {
            pose: found.pose,
            covariance: found.covariance,
            calibration: None,
            prevails: false,
        };
        let is_accepted = self
            .estimator
            .fuse(self.agent_id.0, &estimate, &mut self.effects);
        self.apply_effects();
        is_accepted
    }

    /// Whether an agent of the map was recognised where it cannot have come to.
    fn is_elsewhere(&self, found: &Relocalised) -> bool {
        let number = self.agent_id.0;
        let Some((pose, covariance)) = self.estimator.pose(number) else {
            return true;
        };
        if self.keyframes.is_kidnapped(number) {
            return true;
        }
        let apart_m = (pose.translation.vector - found.pose.translation.vector).norm();
        let sd_m = covariance
            .position_sd_m()
            .hypot(found.covariance.position_sd_m());
        apart_m > DRIFT_MAX * sd_m
    }

    /// The place that answers at a position, with its confidence; none for an agent that is not
    /// placed, whose positions are those of no map, or that may be anywhere.
    pub(super) fn answering(&self, position: &Point3<f64>) -> Option<(PlaceId, f64)> {
        if !self.agent.placed() || self.may_be_anywhere() {
            return None;
        }
        let (place, distance_m) = self.places.winner(position)?;
        let confidence = confidence(distance_m, self.settings.field_radius_m);
        (confidence >= ANSWER_MIN).then_some((place, confidence))
    }

    /// Says how well a percept was expected, if the place remembered anything of its channel.
    pub(super) fn compared(&mut self, place: PlaceId, compared: Option<Compared>) {
        if let Some(compared) = compared {
            self.emit(EventKind::PerceptCompared {
                place,
                channel: compared.channel,
                percepts: compared.percepts,
                surprise: compared.surprise,
            });
        }
    }
}
