//! Relocation of an agent whose sightings contradict its pose.
//!
//! Sightings that are refused speak against the pose, or against themselves. What was seen lately
//! decides: where it agrees on another pose, the agent is put there; where it agrees on nothing for
//! long, the agent searches farther around.

use nalgebra::Isometry3;

use super::consensus::{Consensus, KnownPoint, consensus};
use super::frame::{Frame, LandmarkState};
use super::gauge_free::variance_along;
use super::innovation::PointInnovation;
use super::landmark_initialisation::SightedPoint;
use super::measurement_update::{CorrectionScope, Measurement, PastPose};
use super::recent_sightings::SeenPoint;
use super::tuning::{LANDMARKS_MAX, REFUSED_TO_DOUBT_POSE, REFUSED_TO_WIDEN, WIDENED_SD};
use super::verdict::Verdict;
use crate::input::{Label, Relation, RelativePosition};

impl Frame {
    /// Notes where a known landmark was seen.
    pub(super) fn note_sighting(
        &mut self,
        measurement: &Measurement<'_>,
        label: &Label,
        verdict: Verdict,
    ) {
        let Some(SightedPoint { point, noise, .. }) = self.sighted(measurement) else {
            return;
        };
        let state = self.members[measurement.observer].state_mut();
        let variance = variance_along(&noise, state.filter.is_planar);
        let is_refused = verdict == Verdict::Refused;
        let (point, back) = (point.into(), measurement.back);
        state.recent.push(label, &point, back, variance, is_refused);
    }

    /// Judges the pose of an agent that has just seen a known landmark, if its sightings contradict
    /// it.
    pub(super) fn doubt_pose(&mut self, measurement: &Measurement<'_>, verdict: Verdict) {
        let observer = measurement.observer;
        let state = &self.members[observer].state;
        let is_contradicted = state.refused >= REFUSED_TO_DOUBT_POSE || state.is_doubted();
        if verdict != Verdict::Refused || !is_contradicted {
            return;
        }
        let found = self.consensus(observer);
        // What is nearer, a wider search finds: there the sensor may be worse than it says.
        let found = found.filter(|found| self.is_beyond_search(observer, &found.pose));
        match found {
            Some(found) => self.relocate(measurement, &found),
            None => self.widen_if_refused(observer),
        }
    }

    /// Whether a pose of an agent is farther off than where it searches when it is unsure.
    fn is_beyond_search(&self, observer: usize, pose: &Isometry3<f64>) -> bool {
        let off = self.members[observer].filter().pose.inv_mul(pose);
        let (off_m, off_rad) = (off.translation.vector.norm(), off.rotation.angle());
        (off_m / WIDENED_SD.0).hypot(off_rad / WIDENED_SD.1) > 1.0
    }

    /// Lets an agent whose sightings contradict the estimate search farther around.
    pub(super) fn widen_if_refused(&mut self, observer: usize) {
        if self.members[observer].state.refused >= REFUSED_TO_WIDEN {
            self.members[observer].state_mut().refused = 0;
            self.widen(observer, WIDENED_SD.0, WIDENED_SD.1);
        }
    }

    /// Puts an agent where sightings agree that it is. It alone is corrected by them: they may have
    /// counted before. It counts as contradicted until another one fits.
    fn relocate(&mut self, measurement: &Measurement<'_>, found: &Consensus) {
        let observer = measurement.observer;
        self.move_unsure(observer, &found.pose);
        let agreeing = &found.agreeing;
        for seen in agreeing {
            self.restore(&seen.label);
            // What odometry was off by, all of them share.
            let sd_m = (seen.variance + agreeing.len() as f64 * seen.motion_variance).sqrt();
            let Ok(position) = RelativePosition::new(seen.in_body.coords.into(), [sd_m; 3]) else {
                continue;
            };
            let measurement = Measurement {
                back: &Isometry3::identity(),
                relation: &Relation::Position(position),
                ..*measurement
            };
            self.settle_by(&measurement, &seen.label);
        }
        self.archive_oldest(LANDMARKS_MAX);
        let state = self.members[observer].state_mut();
        state.recent.fit(agreeing);
        state.refused = REFUSED_TO_WIDEN / 2;
    }

    /// Takes in a sighting that is known to fit.
    fn settle_by(&mut self, measurement: &Measurement<'_>, label: &Label) -> Option<()> {
        self.flush();
        let past = PastPose::new(&self.members[measurement.observer], measurement.back);
        let landmark = self.landmarks.get(label)?;
        let expected = past.pose.inverse_transform_point(&landmark.position).coords;
        let innovation = PointInnovation::new(measurement.relation, &expected)?;
        let blocks = past.landmark_blocks(&expected, landmark.offset, &innovation);
        let projection = self.covariance.project(&blocks);
        let (residual, variance) = (innovation.residual, innovation.variance);
        let scope = CorrectionScope {
            corrected: self.members[measurement.observer].pose_components(),
            counts: false,
            is_confirmed: true,
        };
        self.take_in(measurement, projection, &residual, &variance, &scope);
        Some(())
    }

    /// What an agent saw lately says of its pose.
    fn consensus(&self, observer: usize) -> Option<Consensus> {
        let member = &self.members[observer];
        let (filter, seen) = (member.filter(), member.state.recent.by_now());
        let landmarks = self.known_points(&seen, filter.is_planar);
        consensus(&seen, &landmarks, &filter.pose, filter.is_planar)
    }

    /// The landmarks of what was seen, if they are known.
    ///
    /// How far each is off beside the others says what they have in common, or, where some are
    /// archived, what the anchors of each leave open.
    fn known_points(&self, seen: &[SeenPoint], is_planar: bool) -> Vec<Option<KnownPoint>> {
        let joint = seen.iter().map(|seen| self.landmarks.get(&seen.label));
        let joint: Vec<Option<&LandmarkState>> = joint.collect();
        let only: Vec<&LandmarkState> = joint.iter().copied().flatten().collect();
        if seen.iter().any(|seen| self.archive.contains(&seen.label)) {
            let by_anchors = |(joint, seen): (Option<&LandmarkState>, &SeenPoint)| {
                let (position, rest) = if let Some(landmark) = joint {
                    (landmark.position, self.ties(landmark).1)
                } else {
                    let archived = self.by_now(self.archive.get(&seen.label)?, 0);
                    (archived.position, archived.rest)
                };
                let variance = variance_along(&rest, is_planar);
                Some(KnownPoint { position, variance })
            };
            return joint.into_iter().zip(seen).map(by_anchors).collect();
        }
        let mut variances = self.gauge_free_variances(&only, is_planar).into_iter();
        let point = |landmark: Option<&LandmarkState>| {
            Some(KnownPoint {
                position: landmark?.position,
                variance: variances.next()?,
            })
        };
        joint.into_iter().map(point).collect()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Point3, Vector3};

    use super::super::joint::{Estimator, MAP};
    use super::super::parameters::Parameters;
    use super::super::recent_sightings::RecentSighting;
    use super::*;
    use crate::input::RangeBearing;

    const POSTS: usize = 10;

    /// A post on a circle or another, no two of them as far from a third one.
    fn post(number: usize) -> Point3<f64> {
        let angle = 2.4 * number as f64;
        let radius_m = 2.0 + 0.3 * number as f64;
        Point3::new(radius_m * angle.cos(), radius_m * angle.sin(), 0.0)
    }

    fn label(number: usize) -> Label {
        Label::new(&format!("post {number}")).unwrap()
    }

    /// Two agents at the identity of a map that one of them knows well.
    fn two() -> (Estimator, u32, u32) {
        let mut estimator = Estimator::new(Parameters::default());
        let (one, other) = (estimator.enrol(), estimator.enrol());
        assert!(estimator.found(one));
        for _ in 0..10 {
            for number in 0..POSTS {
                see(&mut estimator, one, &Isometry3::identity(), number);
            }
        }
        for number in 0..POSTS {
            see(&mut estimator, other, &Isometry3::identity(), number);
        }
        assert!(estimator.is_in_map(other));
        (estimator, one, other)
    }

    /// An agent that is at a pose sees a post.
    fn see(estimator: &mut Estimator, agent: u32, at: &Isometry3<f64>, number: usize) {
        let seen = at.inverse_transform_point(&post(number)).coords;
        let azimuth = seen.y.atan2(seen.x);
        let seen = RangeBearing::new(seen.norm(), azimuth, 0.0, 0.02, 0.01).unwrap();
        let relation = Relation::RangeBearing(seen);
        estimator.landmark(agent, 0, &label(number), &relation, &mut Vec::new());
    }

    fn off_m(estimator: &Estimator, agent: u32, at: &Isometry3<f64>) -> f64 {
        let pose = estimator.in_frame(agent).unwrap();
        at.inv_mul(pose).translation.vector.norm()
    }

    fn elsewhere() -> Isometry3<f64> {
        Isometry3::new(Vector3::new(-2.0, 1.5, 0.0), Vector3::z() * 2.5)
    }

    /// Looks about from elsewhere until it is there, and answers how often.
    fn find(estimator: &mut Estimator, agent: u32) -> usize {
        for number in 0..POSTS {
            if off_m(estimator, agent, &elsewhere()) < 0.2 {
                return number;
            }
            see(estimator, agent, &elsewhere(), number);
        }
        panic!("it is not found");
    }

    #[test]
    fn a_carried_agent_is_put_where_few_sightings_agree() {
        let (mut estimator, one, other) = two();
        let map: Vec<_> = estimator.landmarks().map(|(_, at, _)| at).collect();
        let seen = find(&mut estimator, other);
        assert!((3..6).contains(&seen), "{seen}");
        // Nothing else moves, and it is contradicted until another sighting fits.
        let after: Vec<_> = estimator.landmarks().map(|(_, at, _)| at).collect();
        assert_eq!(map, after);
        assert!(off_m(&estimator, one, &Isometry3::identity()) < 0.1);
        let refused = |estimator: &Estimator| estimator.agent_state(other).unwrap().refused;
        assert_eq!(refused(&estimator), REFUSED_TO_WIDEN / 2);
        see(&mut estimator, other, &elsewhere(), seen);
        assert_eq!(refused(&estimator), 0);
        assert!(off_m(&estimator, other, &elsewhere()) < 0.1);
    }

    #[test]
    fn archived_landmarks_tell_where_a_carried_agent_is() {
        let (mut estimator, one, other) = two();
        estimator.frame_mut(MAP).archive_oldest(0);
        let seen = find(&mut estimator, other);
        assert!((3..7).contains(&seen), "{seen}");
        assert!(off_m(&estimator, one, &Isometry3::identity()) < 0.1);
        let frame = estimator.frame(MAP);
        assert_eq!(frame.landmarks.len() + frame.archive.len(), POSTS);
        for number in 0..POSTS {
            let (at, _) = frame.known_landmark(&label(number)).unwrap();
            assert!((at - post(number)).norm() < 0.1, "{number}");
        }
    }

    #[test]
    fn a_relocated_agent_is_as_unsure_as_its_sightings_are() {
        let (mut estimator, _, other) = two();
        find(&mut estimator, other);
        let covariance = estimator.covariance(other).unwrap();
        let matrix = covariance.matrix();
        let sd_m = (matrix[(0, 0)] + matrix[(1, 1)]).sqrt();
        assert!((0.02..0.3).contains(&sd_m), "{sd_m}");
        assert!(matrix.iter().all(|entry| entry.is_finite()));
        let frame = estimator.frame(MAP);
        assert!(
            frame
                .members
                .iter()
                .all(|member| !member.filter().is_nowhere())
        );
    }

    /// Two landmarks do not tell where it is, and what it saw before does not hold it.
    #[test]
    fn a_carried_agent_that_sees_two_posts_searches_around() {
        let (mut estimator, _, other) = two();
        let sd_m =
            |estimator: &Estimator| estimator.covariance(other).unwrap().matrix()[(0, 0)].sqrt();
        let before_m = sd_m(&estimator);
        for seen in 0..REFUSED_TO_WIDEN as usize {
            assert!(sd_m(&estimator) < before_m + 0.1, "{seen}");
            see(&mut estimator, other, &elsewhere(), seen % 2);
        }
        assert!(sd_m(&estimator) > 0.5);
    }

    /// Four posts are moved together, and the others tell that it was they: one of six, or four of
    /// five.
    #[test]
    fn an_agent_that_went_with_moved_posts_comes_back() {
        for (others, looks) in [(6, 1), (5, 4)] {
            let (mut estimator, one, other) = two();
            let here = Isometry3::identity();
            let state = estimator.agent_state_mut(other).unwrap();
            let is_kept = |seen: &RecentSighting| (0..4 + others).any(|k| seen.label == label(k));
            state.recent.seen.retain(is_kept);
            for number in 0..4 {
                see(&mut estimator, other, &elsewhere(), number);
            }
            assert!(off_m(&estimator, other, &here) > 1.0, "{others}");
            for number in 0..looks {
                assert!(off_m(&estimator, other, &here) > 1.0, "{others}");
                see(&mut estimator, other, &here, 4 + number);
            }
            assert!(off_m(&estimator, other, &here) < 0.2, "{others}");
            assert!(off_m(&estimator, one, &here) < 0.1, "{others}");
        }
    }

    /// Who is sure to be where the map begins is not when it is carried off.
    #[test]
    fn the_founder_of_a_map_is_unsure_once_it_is_put_elsewhere() {
        let (mut estimator, one, _) = two();
        let sd_m =
            |estimator: &Estimator| estimator.covariance(one).unwrap().matrix()[(0, 0)].sqrt();
        assert!(sd_m(&estimator) < 1e-6);
        find(&mut estimator, one);
        assert!(sd_m(&estimator) > 0.01);
        let height = estimator.covariance(one).unwrap().matrix()[(2, 2)];
        assert!(height < 1e-12, "{height}");
    }
}
