//! What becomes of a landmark by the sightings of it.

use std::sync::Arc;

use nalgebra::Point3;

use super::frame::Frame;
use super::landmark_evidence::Rival;
use super::landmark_initialisation::SightedPoint;
use super::measurement_update::{Measurement, PastPose};
use super::tuning::{
    DOUBT_BY_SIGHTING, REFUSED_TO_FORGET, REFUSED_TO_WIDEN, VOTES_AGAINST_UNCONFIRMED,
};
use super::verdict::Verdict;
use crate::input::Label;
use geometry::{seen_by_pose, symmetric};

impl Frame {
    /// A landmark's position has been found by more than one sighting.
    pub(super) fn confirm(&mut self, label: &Label) {
        if let Some(landmark) = Arc::make_mut(&mut self.landmarks).get_mut(label) {
            landmark.evidence.is_confirmed = true;
        }
    }

    /// Notes for or against a landmark what became of a sighting of it. One that is where most of
    /// the refused sightings do not see it is forgotten.
    pub(super) fn weigh_landmark(
        &mut self,
        measurement: &Measurement<'_>,
        label: &Label,
        verdict: Verdict,
    ) {
        let sightings = self.sightings;
        let observer = &self.members[measurement.observer];
        let agent = observer.agent;
        let (refused, doubt) = (observer.state.refused, observer.state.doubt);
        let is_doubted = observer.state.is_doubted();
        let is_refused = verdict == Verdict::Refused;
        let seen = if is_refused && !is_doubted {
            self.seen_in_frame(measurement)
        } else {
            None
        };
        let Some(landmark) = Arc::make_mut(&mut self.landmarks).get_mut(label) else {
            return;
        };
        landmark.used = sightings;
        if !is_refused {
            landmark.observers.note(agent);
        }
        if is_doubted {
            return; // who is doubted speaks neither against a landmark nor for it
        }
        if !is_refused {
            landmark.evidence.accept();
        }
        let Some(seen) = seen else {
            return;
        };
        let agrees = landmark.evidence.refuse(seen);
        let votes = landmark.evidence.votes();
        let is_outvoted = if landmark.evidence.is_confirmed {
            // Of an agent that contradicts everything, the landmark is not to blame.
            votes >= REFUSED_TO_FORGET && refused < REFUSED_TO_WIDEN / 2
        } else {
            // Who placed it may have cast both votes: so much doubt is about this landmark alone.
            let own = u32::from(landmark.observers.contains(agent));
            let others_fit = doubt <= (1 + own) * DOUBT_BY_SIGHTING;
            votes >= VOTES_AGAINST_UNCONFIRMED && others_fit
        };
        if agrees && is_outvoted {
            self.forget(label);
        }
    }

    /// Where a sighting sees its target in the frame.
    fn seen_in_frame(&self, measurement: &Measurement<'_>) -> Option<Rival> {
        let SightedPoint { point, noise, .. } = self.sighted(measurement)?;
        let observer = &self.members[measurement.observer];
        let past = PastPose::new(observer, measurement.back);
        let world = past.pose.rotation.to_rotation_matrix().into_inner();
        let by_pose = past.block(&-(world * seen_by_pose(&point)));
        let spread = self.covariance.project(&[by_pose]).spread;
        Some(Rival {
            position: past.pose * Point3::from(point),
            covariance: symmetric(&(spread + world * noise * world.transpose())),
            votes: 0,
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::super::joint::{Estimator, MAP};
    use super::super::parameters::Parameters;
    use super::super::tests::polar;
    use super::*;

    const POST: Point3<f64> = Point3::new(4.0, 1.0, 0.0);
    const OTHER: Point3<f64> = Point3::new(2.0, -3.0, 0.0);

    /// An agent at the identity of the map.
    fn one() -> (Estimator, u32) {
        let mut estimator = Estimator::new(Parameters::default());
        let agent = estimator.enrol();
        assert!(estimator.found(agent));
        (estimator, agent)
    }

    /// It sees something at a point that it takes for the landmark with this label.
    fn see(estimator: &mut Estimator, agent: u32, label: &str, at: &Point3<f64>) {
        let relation = polar(&Isometry3::identity(), at);
        let label = Label::new(label).unwrap();
        estimator.landmark(agent, 0, &label, &relation, &mut Vec::new());
    }

    fn position_of(estimator: &Estimator, label: &str) -> Option<Point3<f64>> {
        let landmarks = &estimator.frame(MAP).landmarks;
        Some(landmarks.get(&Label::new(label).unwrap())?.position)
    }

    /// A point on a circle, always another one.
    fn anywhere(turn: usize) -> Point3<f64> {
        let angle = 2.4 * turn as f64;
        Point3::new(6.0 * angle.cos(), 6.0 * angle.sin(), 0.0)
    }

    fn is_at(estimator: &Estimator, label: &str, at: &Point3<f64>) -> bool {
        position_of(estimator, label).is_some_and(|position| (position - at).norm() < 0.2)
    }

    #[test]
    fn sightings_of_anything_else_do_not_move_a_landmark() {
        let (mut estimator, agent) = one();
        for _ in 0..2 {
            see(&mut estimator, agent, "post", &POST);
        }
        for turn in 0..200 {
            see(&mut estimator, agent, "post", &anywhere(turn));
            see(&mut estimator, agent, "other", &OTHER);
            assert!(is_at(&estimator, "post", &POST), "{turn}");
        }
    }

    #[test]
    fn a_landmark_that_was_moved_is_found_among_sightings_of_anything_else() {
        let (mut estimator, agent) = one();
        for _ in 0..50 {
            see(&mut estimator, agent, "post", &POST);
        }
        let there = Point3::new(-4.0, 2.0, 0.0);
        let mut seen = 0;
        while !is_at(&estimator, "post", &there) {
            for at in [there, there, anywhere(seen), there] {
                see(&mut estimator, agent, "post", &at);
                see(&mut estimator, agent, "other", &OTHER);
            }
            seen += 1;
            assert!(seen < 8);
        }
    }

    #[test]
    fn two_sightings_outweigh_the_one_that_placed_a_landmark() {
        let (mut estimator, agent) = one();
        see(&mut estimator, agent, "post", &anywhere(1));
        for _ in 0..3 {
            see(&mut estimator, agent, "post", &POST);
        }
        assert!(is_at(&estimator, "post", &POST));
        let state = estimator.agent_state(agent).unwrap();
        assert_eq!(state.refused, 0, "it is the landmark that is elsewhere");
        let pose = estimator.in_frame(agent).unwrap();
        assert!(pose.translation.vector.norm() < 0.05);
    }

    const LABELS: [&str; 10] = ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j"];

    fn sd_m(estimator: &Estimator, agent: u32) -> f64 {
        let covariance = estimator.covariance(agent).unwrap();
        covariance.matrix()[(0, 0)].sqrt()
    }

    #[test]
    fn what_was_placed_wrongly_does_not_make_an_agent_search_around() {
        let (mut estimator, agent) = one();
        for (number, label) in LABELS.iter().enumerate() {
            see(&mut estimator, agent, label, &anywhere(number));
        }
        let before_m = sd_m(&estimator, agent);
        for (number, label) in LABELS.iter().enumerate() {
            // No pose would have them all so.
            see(&mut estimator, agent, label, &anywhere(number * number + 3));
        }
        assert!(sd_m(&estimator, agent) < before_m + 0.1);
    }

    #[test]
    fn an_agent_that_is_turned_after_its_first_look_finds_back() {
        let (mut estimator, agent) = one();
        for (number, label) in LABELS.iter().enumerate() {
            see(&mut estimator, agent, label, &anywhere(number));
        }
        let turned = Isometry3::rotation(Vector3::z() * 0.9);
        for _ in 0..6 {
            for (number, label) in LABELS.iter().enumerate() {
                let at = turned.inverse_transform_point(&anywhere(number));
                see(&mut estimator, agent, label, &at);
                assert!(!estimator.is_aside(agent));
            }
        }
        let pose = estimator.in_frame(agent).unwrap();
        assert!(pose.rotation.angle_to(&turned.rotation) < 0.1);
        assert!(is_at(&estimator, LABELS[0], &anywhere(0)));
    }
}
