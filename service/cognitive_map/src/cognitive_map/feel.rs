//! What levels and descriptors do to the map.

use nalgebra::Point3;

use super::fold::Fold;
use super::motion::ANSWER_MIN;
use crate::chronicle::Viewed;
use crate::event::EventKind;
use crate::percept::Compared;
use crate::place::{PlaceId, confidence};
use crate::sample::{Descriptor, Level};

impl Fold<'_> {
    /// A level was felt, where the sensor is.
    pub(super) fn level(&mut self, level: &Level) {
        self.agent.percepts += 1;
        self.touch(|episode, objects| episode.level(level, objects));
        let sensor = self.agent.body.in_map() * Point3::from(*level.offset_m());
        let Some((place, weight)) = self.answering(&sensor) else {
            return;
        };
        let compared =
            self.percepts
                .feel_level(level.channel(), level.value(), place, weight, self.revision);
        self.compared(place, compared);
    }

    /// A descriptor was seen, where the body is.
    pub(super) fn descriptor(&mut self, descriptor: &Descriptor) {
        self.agent.percepts += 1;
        self.touch(|episode, objects| episode.descriptor(descriptor, objects));
        self.look_back(descriptor);
        let body = self.agent.body.in_map().translation.vector.into();
        let Some((place, weight)) = self.answering(&body) else {
            return;
        };
        let revision = self.revision;
        let compared = self
            .percepts
            .feel_descriptor(descriptor, place, weight, revision);
        self.compared(place, compared);
    }

    /// Remembers what an agent of the map saw, and finds out whether it has come where something like it was seen.
    fn look_back(&mut self, descriptor: &Descriptor) {
        let number = self.agent_id.0;
        if !self.agent.placed {
            return;
        }
        let Some((_, covariance)) = self.estimator.pose(number) else {
            return;
        };
        let Some(in_odom) = self.estimator.in_odom(number) else {
            return;
        };
        let viewed = Viewed {
            descriptor,
            in_odom: *in_odom,
            covariance,
        };
        self.chronicle.viewed(&self.moment(), &viewed);
    }

    /// The place that answers at a position, with its confidence; none for an agent that is not
    /// placed, whose positions are those of no map.
    fn answering(&self, position: &Point3<f64>) -> Option<(PlaceId, f64)> {
        if !self.agent.placed {
            return None;
        }
        let (place, distance_m) = self.places.winner(position)?;
        let confidence = confidence(distance_m, self.settings.field_radius_m);
        (confidence >= ANSWER_MIN).then_some((place, confidence))
    }

    /// Says how well a percept was expected, if the place remembered anything of its channel.
    fn compared(&mut self, place: PlaceId, compared: Option<Compared>) {
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
