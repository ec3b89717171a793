//! Landmarks that leave a frame's joint estimate, and come back into it.
//!
//! Those seen longest ago leave, but for anchors ([`landmark_anchors`](super::landmark_anchors)).
//! One comes back when a sighting of it fits, or when it tells where an agent or another frame is.
//! A sighting that does not fit is judged as of any other landmark, by all that is known: it may
//! have seen something else, its observer may be elsewhere, or the landmark was moved.

use std::sync::Arc;

use nalgebra::{Matrix3, Point3};

use super::archived_landmark::{ArchivedLandmark, Tie};
use super::frame::{Frame, LANDMARK_DIM, LandmarkState};
use super::jacobian::Block;
use super::measurement_update::point_block;
use super::observers::Observers;
use super::tuning::{LANDMARKS_MAX, RESTORED_MAX, TIED_DEPTH_MAX, TIES_FOLLOWED_MAX};
use super::verdict::Outcome;
use crate::input::Label;

impl Frame {
    /// Makes room for one more landmark.
    pub(super) fn make_room(&mut self) {
        self.archive_oldest(LANDMARKS_MAX - 1);
    }

    /// Archives the landmarks seen longest ago, until there are so many left at most.
    pub(super) fn archive_oldest(&mut self, most: usize) {
        while self.landmarks.len() > most {
            let Some(label) = self.next_to_leave() else {
                return;
            };
            self.archive_landmark(&label);
        }
    }

    /// The landmark seen longest ago that is no anchor, once those are chosen that are.
    fn next_to_leave(&mut self) -> Option<Label> {
        loop {
            let landmarks = self.landmarks.iter();
            let oldest = landmarks.min_by_key(|(_, landmark)| (landmark.is_anchor, landmark.used));
            let (label, landmark) = oldest?;
            let label = label.clone();
            if landmark.is_anchor {
                return Some(label); // there are no others
            }
            let Some(change) = self.as_anchor(landmark) else {
                return Some(label);
            };
            let landmarks = Arc::make_mut(&mut self.landmarks);
            landmarks.get_mut(&label)?.is_anchor = true;
            if let Some(other) = change.instead_of {
                landmarks.get_mut(&other)?.is_anchor = false;
            }
        }
    }

    /// Archives a landmark that is estimated jointly.
    fn archive_landmark(&mut self, label: &Label) {
        let Some(landmark) = self.take_out(label) else {
            return;
        };
        let (ties, rest) = self.ties(&landmark);
        let archived = ArchivedLandmark {
            number: landmark.number,
            position: landmark.position,
            covariance: self.landmark_covariance(&landmark),
            ties,
            rest,
            left: self.sightings,
            only: landmark.observers.only(),
            evidence: landmark.evidence,
        };
        self.drop_components(landmark.offset, LANDMARK_DIM);
        self.archive.insert(label.clone(), archived);
    }

    /// An observer saw a landmark; answers nothing if it is not archived. `update` takes the
    /// sighting in as of any landmark that is estimated jointly, as it is for that time; it stays
    /// so if the sighting fits.
    pub(super) fn update_by_archived(
        &mut self,
        observer: usize,
        label: &Label,
        update: impl FnOnce(&mut Self) -> Outcome,
    ) -> Option<Outcome> {
        let archived = self.archive.get(label)?.clone();
        self.restore(label);
        let outcome = update(self);
        // Refused, it may have helped to find where its observer is.
        let recent = &self.members[observer].state.recent;
        if !outcome.verdict.is_accepted()
            && !recent.fits(label)
            && let Some(landmark) = self.take_out(label)
        {
            self.drop_components(landmark.offset, LANDMARK_DIM);
            let archived = ArchivedLandmark {
                evidence: landmark.evidence,
                ..archived
            };
            self.archive.insert(label.clone(), archived);
        }
        self.archive_oldest(LANDMARKS_MAX);
        Some(outcome)
    }

    /// Where a landmark is, whether it is estimated jointly or archived: position \[m\] and
    /// covariance \[m²\].
    pub(super) fn known_landmark(&self, label: &Label) -> Option<(Point3<f64>, Matrix3<f64>)> {
        let Some(landmark) = self.landmarks.get(label) else {
            let archived = self.archive.get(label)?;
            return Some((self.by_now(archived, 0).position, archived.covariance));
        };
        Some((landmark.position, self.landmark_covariance(landmark)))
    }

    /// An archived landmark as those of its anchors have it by now that are still known.
    pub(super) fn by_now(&self, archived: &ArchivedLandmark, depth: u32) -> ArchivedLandmark {
        let position = |tie: &Tie| {
            if let Some(anchor) = self.joint_anchor(tie) {
                return Some(anchor.position);
            }
            let anchor = self.archive.get(&tie.anchor);
            let anchor = anchor.filter(|anchor| anchor.number == tie.number)?;
            if depth == TIES_FOLLOWED_MAX {
                return Some(anchor.position);
            }
            Some(self.by_now(anchor, depth + 1).position)
        };
        let (tied, anchors) = archived.tied_to(position);
        if anchors.is_empty() {
            return tied;
        }
        tied.moved_with(&anchors, self.is_planar())
    }

    /// An anchor that is estimated jointly, whatever it is called by now.
    fn joint_anchor(&self, tie: &Tie) -> Option<&LandmarkState> {
        let mut landmarks = self.landmarks.values();
        landmarks.find(|landmark| landmark.number == tie.number)
    }

    /// Takes a landmark back into the joint estimate, if it is archived, and before it the anchors
    /// that it is tied to.
    pub(super) fn restore(&mut self, label: &Label) {
        self.restore_within(label, 0);
    }

    fn restore_within(&mut self, label: &Label, depth: u32) {
        if self.landmarks.contains_key(label) {
            return;
        }
        let Some(archived) = self.archive.remove(label) else {
            return;
        };
        for tie in &archived.ties {
            if depth < TIED_DEPTH_MAX && self.landmarks.len() < RESTORED_MAX {
                self.restore_within(&tie.anchor, depth + 1);
            }
        }
        // What is tied to anchors that did not come back is unknown, too.
        let (archived, _) = archived.tied_to(|tie| Some(self.joint_anchor(tie)?.position));
        let archived = self.by_now(&archived, 0);
        let blocks = archived.ties.iter().filter_map(|tie| {
            let anchor = self.joint_anchor(tie)?;
            Some(point_block(anchor.offset, &tie.gain))
        });
        let blocks: Vec<Block<3>> = blocks.collect();
        let offset = self.covariance.append(&blocks, &archived.rest);
        let mut observers = Observers::default();
        match archived.only {
            Some(agent) => observers.note(agent),
            None => observers = Observers::unknown(),
        }
        // Anchors that come with it were not seen: they are the first that leave again.
        let used = if depth == 0 {
            self.sightings
        } else {
            archived.left
        };
        let landmark = LandmarkState {
            number: archived.number,
            position: archived.position,
            offset,
            used,
            is_anchor: false,
            evidence: archived.evidence,
            observers,
        };
        Arc::make_mut(&mut self.landmarks).insert(label.clone(), landmark);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Matrix6, Vector3};

    use super::super::frame_alignment::FrameAlignment;
    use super::super::joint::{Estimator, MAP};
    use super::super::parameters::Parameters;
    use super::super::tests::polar;
    use super::*;
    use crate::input::{Motion, Range, Relation};

    /// More than are estimated jointly.
    const POSTS: usize = 130;

    /// Posts on circles of different radii, no two of them as far from a third one.
    fn post(number: usize) -> Point3<f64> {
        let angle = 2.4 * number as f64;
        let radius_m = 2.0 + 0.05 * number as f64;
        Point3::new(radius_m * angle.cos(), radius_m * angle.sin(), 0.0)
    }

    fn label(number: usize) -> Label {
        Label::new(&format!("post {number}")).unwrap()
    }

    fn see(estimator: &mut Estimator, agent: u32, number: usize, at: &Point3<f64>) {
        let relation = polar(&Isometry3::identity(), at);
        estimator.landmark(agent, 0, &label(number), &relation, &mut Vec::new());
    }

    /// An agent at the identity of a map that it knows well, and a post of it that is archived.
    fn one() -> (Estimator, u32, usize) {
        let mut estimator = Estimator::new(Parameters::default());
        let agent = estimator.enrol();
        assert!(estimator.found(agent));
        // To and fro, so that it is unsure where it is, and all posts are off together.
        for shift in [2.0, -2.0] {
            let straight = [0.0, 0.0, 0.0, 1.0];
            let driven = Motion::from_increment([shift, 0.0, 0.0], straight, None).unwrap();
            estimator.motion(agent, 0, &driven, &mut Vec::new());
        }
        for seen in 0..3 * POSTS {
            see(&mut estimator, agent, seen / 3, &post(seen / 3));
        }
        let frame = estimator.frame(MAP);
        assert_eq!(frame.landmarks.len(), LANDMARKS_MAX);
        let archived = archived_of(&estimator)[0];
        (estimator, agent, archived)
    }

    fn archived_of(estimator: &Estimator) -> Vec<usize> {
        let archive = &estimator.frame(MAP).archive;
        let numbers = (0..POSTS).filter(|&number| archive.contains(&label(number)));
        numbers.collect()
    }

    fn known(estimator: &Estimator, number: usize) -> (Point3<f64>, Matrix3<f64>) {
        let known = estimator.frame(MAP).known_landmark(&label(number));
        known.unwrap()
    }

    /// What others know with a landmark they know with it after it was away, too.
    #[test]
    fn a_landmark_that_comes_back_is_tied_to_its_anchors_as_before() {
        let (mut estimator, _, number) = one();
        let frame = estimator.frame_mut(MAP);
        frame.restore(&label(number));
        let anchor = frame.ties(&frame.landmarks[&label(number)]).0[0].clone();
        let state = |frame: &Frame| {
            let [one, other] = [&label(number), &anchor.anchor].map(|name| &frame.landmarks[name]);
            let (offset, across) = (one.offset, other.offset);
            let across: Matrix3<f64> = frame.covariance.block(offset, across);
            (one.position, frame.landmark_covariance(one), across)
        };
        let (position, own, across) = state(frame);
        assert!(across.norm() > 0.01 * own.norm(), "{across}");
        for _ in 0..20 {
            frame.archive_landmark(&label(number));
            frame.restore(&label(number));
            let (position_now, own_now, across_now) = state(frame);
            assert!((position_now - position).norm() < 1e-6);
            assert!((own_now - own).norm() < 1e-4 * own.norm());
            assert!((across_now - across).norm() < 1e-4 * own.norm());
        }
    }

    #[test]
    fn a_landmark_whose_anchor_is_forgotten_stays_tied_to_the_others() {
        let (mut estimator, _, number) = one();
        let frame = estimator.frame_mut(MAP);
        let ties = frame.archive.get(&label(number)).unwrap().ties.clone();
        frame.forget(&ties[0].anchor);
        frame.restore(&label(number));
        let landmark = &frame.landmarks[&label(number)];
        let across = |tie: &Tie| -> Matrix3<f64> {
            let anchor = &frame.landmarks[&tie.anchor];
            frame.covariance.block(landmark.offset, anchor.offset)
        };
        let own = frame.landmark_covariance(landmark);
        for tie in &ties[1..] {
            assert!(across(tie).norm() > 0.01 * own.norm(), "{}", across(tie));
        }
    }

    /// What was seen once far off may not be there.
    #[test]
    fn no_landmark_that_was_seen_once_stays_for_the_others() {
        let mut estimator = Estimator::new(Parameters::default());
        let agent = estimator.enrol();
        assert!(estimator.found(agent));
        for number in 0..POSTS {
            see(&mut estimator, agent, number, &post(number));
        }
        let frame = estimator.frame(MAP);
        assert!(frame.landmarks.values().all(|landmark| !landmark.is_anchor));
        assert!(frame.archive.contains(&label(0)));
    }

    #[test]
    fn sightings_of_anything_else_leave_a_landmark_archived_as_it_is() {
        let (mut estimator, agent, number) = one();
        let before = known(&estimator, number);
        for turn in 0..60 {
            let angle = 2.4 * f64::from(turn);
            let anywhere = Point3::new(20.0 * angle.cos(), 20.0 * angle.sin(), 0.0);
            see(&mut estimator, agent, number, &anywhere);
            assert!(estimator.frame(MAP).archive.contains(&label(number)));
            let (position, covariance) = known(&estimator, number);
            assert!((position - before.0).norm() < 0.02, "{turn}");
            assert_eq!(covariance, before.1, "{turn}");
            see(&mut estimator, agent, POSTS - 1, &post(POSTS - 1));
        }
        see(&mut estimator, agent, number, &post(number));
        let frame = estimator.frame(MAP);
        assert!(frame.landmarks.contains_key(&label(number)));
        assert!(!frame.archive.contains(&label(number)));
        assert!((known(&estimator, number).0 - post(number)).norm() < 0.1);
    }

    #[test]
    fn an_archived_landmark_that_was_moved_is_found() {
        let (mut estimator, agent, number) = one();
        let there = Point3::new(-14.0, 2.0, 0.0);
        let is_there = |estimator: &Estimator| {
            let known = estimator.frame(MAP).known_landmark(&label(number));
            known.is_some_and(|(at, _)| (at - there).norm() < 0.2)
        };
        let mut seen = 0;
        while !is_there(&estimator) {
            see(&mut estimator, agent, number, &there);
            see(&mut estimator, agent, POSTS - 1, &post(POSTS - 1));
            seen += 1;
            assert!(seen < 20, "votes are kept while it is archived");
        }
        assert!(seen > 2, "a confirmed landmark is not given up at once");
    }

    #[test]
    fn distances_of_anything_else_leave_a_landmark_archived_as_it_is() {
        let (mut estimator, agent, number) = one();
        let before = known(&estimator, number);
        let seen = |estimator: &mut Estimator, range_m: f64| {
            let range = Range::new(range_m, 0.1, [0.0; 3]).unwrap();
            let relation = Relation::Range(range);
            estimator.landmark(agent, 0, &label(number), &relation, &mut Vec::new());
        };
        for range_m in [0.2, 30.0, 0.4] {
            seen(&mut estimator, range_m);
            assert!(estimator.frame(MAP).archive.contains(&label(number)));
            assert_eq!(known(&estimator, number), before, "{range_m}");
        }
        seen(&mut estimator, post(number).coords.norm());
        let landmarks = &estimator.frame(MAP).landmarks;
        assert!(landmarks.contains_key(&label(number)));
        assert_eq!(landmarks.len(), LANDMARKS_MAX);
    }

    #[test]
    fn a_newcomer_joins_the_map_by_archived_landmarks() {
        let (mut estimator, _, _) = one();
        let newcomer = estimator.enrol();
        let at = Isometry3::new(Vector3::new(1.0, -2.0, 0.0), Vector3::z() * 2.0);
        let mut joined = false;
        for number in archived_of(&estimator).into_iter().take(6) {
            let relation = polar(&at, &post(number));
            let called = label(number);
            estimator.landmark(newcomer, 0, &called, &relation, &mut Vec::new());
            joined |= estimator.is_in_map(newcomer);
        }
        assert!(joined);
        let pose = estimator.in_frame(newcomer).unwrap();
        assert!(at.inv_mul(pose).translation.vector.norm() < 0.2, "{pose}");
        let frame = estimator.frame(MAP);
        assert_eq!(frame.landmarks.len() + frame.archive.len(), POSTS);
        assert!(frame.landmarks.len() <= LANDMARKS_MAX);
    }

    /// In a frame that joins another one, it makes no difference whether a landmark is archived.
    #[test]
    fn archived_landmarks_join_another_frame_with_their_own() {
        let (estimator, _, number) = one();
        let label = label(number);
        let alignment = FrameAlignment {
            pose: Isometry3::new(Vector3::new(3.0, -1.0, 0.0), Vector3::z() * 2.0),
            covariance: Matrix6::from_diagonal_element(1e-4),
        };
        let merged = |newer: Frame| {
            let mut older = Frame::default();
            older.merge(newer, &alignment, &Parameters::default());
            older.restore(&label);
            let landmark = &older.landmarks[&label];
            (landmark.position, older.landmark_covariance(landmark))
        };
        let newer = estimator.frame(MAP);
        let mut restored = newer.clone();
        restored.restore(&label);
        let (archived, joint) = (merged(newer.clone()), merged(restored));
        assert!((archived.0 - joint.0).norm() < 1e-6);
        assert!((archived.0 - alignment.pose * known(&estimator, number).0).norm() < 1e-6);
        assert!((archived.1 - joint.1).norm() < 0.02 * joint.1.norm());
    }
}
