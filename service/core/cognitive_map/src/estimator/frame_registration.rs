//! Registration of two frames by their landmarks, whatever these are called.

use std::cmp::Reverse;

use super::effect::Effect;
use super::frame::{Frame, LandmarkState};
use super::frame_alignment::{PointPair, align_frames};
use super::frame_match::FrameMatch;
use super::joint::{Estimator, MAP};
use super::registration::{
    GATE, Registration, SOUGHT_MAX, SURE_MARGIN, UncertainPoint, apart_m, mean_variance, register,
};
use super::tuning::{
    ASSOCIATE_EVERY, FRAME_MATCH_FOUND_MIN, FRAME_MATCHES_MAX, FRAMES_SCANNED_MAX,
    LANDMARK_WIDENING, REGISTERED_MAX, SAME_LANDMARK_VARIANCE_M2, SWAP_ROUNDS,
};
use crate::input::Label;

/// Landmarks of a frame that the other frame has no name for.
#[derive(Clone, Debug)]
struct UnsharedLandmarks {
    labels: Vec<Label>,
    points: Vec<UncertainPoint>,
}

impl Estimator {
    /// Looks now and then whether landmarks have other names, too: in an agent's frame for the
    /// agent itself, and, if that is not the map's, for another frame. When that is depends on the
    /// sightings alone.
    pub(super) fn associate_landmarks(
        &mut self,
        own: usize,
        agent: u32,
        effects: &mut Vec<Effect>,
    ) {
        let sightings = self.frame(own).sightings;
        if !sightings.is_multiple_of(ASSOCIATE_EVERY) {
            return;
        }
        if own != MAP
            && let Some(other) = self.next_to_register(own, sightings / ASSOCIATE_EVERY)
        {
            self.register_frames(own, other, effects);
        } else {
            self.associate_within_frame(own, agent, effects);
        }
    }

    /// Looks whether the landmarks of a frame lie like those of another one.
    fn register_frames(&mut self, own: usize, other: usize, effects: &mut Vec<Effect>) {
        let (older, newer) = (own.min(other), own.max(other));
        let is_planar = self.frame(older).is_planar() && self.frame(newer).is_planar();
        let known_max = if is_planar {
            REGISTERED_MAX.0
        } else {
            REGISTERED_MAX.1
        };
        let [known, sought] = [(older, newer, known_max), (newer, older, SOUGHT_MAX)]
            .map(|(one, other, most)| self.frame(one).unshared(self.frame(other), most, is_planar));
        match register(&known.points, &sought.points, is_planar) {
            Some(register) => {
                if self.note_match(older, newer, &register, &sought.points) >= FRAME_MATCH_FOUND_MIN
                {
                    self.accept([older, newer], &register, &known, &sought, effects);
                }
            }
            None => self
                .frame_matches
                .retain(|frame_match| frame_match.frames != [older, newer]),
        }
    }

    /// The frame that one is compared with at a turn: every second time that of the map, and the
    /// others in turn.
    fn next_to_register(&self, own: usize, turn: u64) -> Option<usize> {
        let count = self.frames.len();
        if turn.is_multiple_of(2) {
            return (self.frame(MAP).population > 0).then_some(MAP);
        }
        let start = usize::try_from(turn / 2 % count as u64).ok()?;
        let turn = (0..count.min(FRAMES_SCANNED_MAX)).map(|k| (start + k) % count);
        let is_other = |&other: &usize| other != own && !self.frame(other).landmarks.is_empty();
        turn.filter(|&other| other != MAP).find(is_other)
    }

    /// Notes what was found; answers at how many looks in a row it was the same.
    fn note_match(
        &mut self,
        older: usize,
        newer: usize,
        found: &Registration,
        points: &[UncertainPoint],
    ) -> u32 {
        let frames = [older, newer];
        let near_m = 2.0 * GATE * mean_variance(points).sqrt();
        let earlier = self
            .frame_matches
            .iter()
            .position(|one| one.frames == frames);
        let earlier = earlier.map(|at| self.frame_matches.remove(at));
        let same = earlier.filter(|one| apart_m(&one.pose, &found.pose, points) < near_m);
        let n_found = same.map_or(0, |one| one.n_found).saturating_add(1);
        if self.frame_matches.len() >= FRAME_MATCHES_MAX {
            self.frame_matches.remove(0);
        }
        self.frame_matches.push(FrameMatch {
            frames,
            pose: found.pose,
            n_found,
        });
        n_found
    }

    /// Merges a frame into an older one by landmarks that are the same, which go by the older one's
    /// names from now on.
    fn accept(
        &mut self,
        [older, newer]: [usize; 2],
        found: &Registration,
        known: &UnsharedLandmarks,
        sought: &UnsharedLandmarks,
        effects: &mut Vec<Effect>,
    ) {
        let pair = |&(one, other): &(usize, usize)| PointPair {
            older: known.points[one].position,
            newer: sought.points[other].position,
            variance: known.points[one].variance + sought.points[other].variance,
        };
        let correspondences = self.sure_correspondences(older, newer, found, known, sought);
        let pairs: Vec<PointPair> = correspondences.iter().map(pair).collect();
        let is_planar = self.frame(older).is_planar() && self.frame(newer).is_planar();
        let Some(alignment) =
            align_frames(&pairs, is_planar).filter(|_| self.associations.has_room(pairs.len()))
        else {
            return;
        };
        let correspondences = correspondences.iter();
        let same: Vec<(Label, Label)> = correspondences
            .map(|&(one, other)| (sought.labels[other].clone(), known.labels[one].clone()))
            .collect();
        for (label, name) in &same {
            self.associations.insert(label, name);
            self.rename_landmark(label, name);
        }
        self.merge(older, newer, &alignment, effects);
        if !same.is_empty() {
            effects.push(Effect::LandmarksAssociated(same));
        }
    }

    /// The correspondences of which it is sure which is which.
    ///
    /// How two landmarks close together lie to one another is known far better than where they are:
    /// two pairs are taken crosswise if that fits better, and neither counts unless the other way
    /// fits much worse. The same holds of landmarks that are no correspondences, of which only the
    /// positions can be compared.
    fn sure_correspondences(
        &self,
        older: usize,
        newer: usize,
        found: &Registration,
        known: &UnsharedLandmarks,
        sought: &UnsharedLandmarks,
    ) -> Vec<(usize, usize)> {
        let (older, newer) = (self.frame(older), self.frame(newer));
        let is_planar = older.is_planar() && newer.is_planar();
        let lies_at = |at: usize| found.pose * sought.points[at].position;
        let apart_m2 =
            |one: usize, other: usize| (lies_at(other) - known.points[one].position).norm_squared();
        // By how much farther apart the differences are if two pairs are taken crosswise.
        let margin = |&(p, i): &(usize, usize), &(q, j): &(usize, usize)| {
            let there = known.points[p].position - known.points[q].position;
            4.0 * there.dot(&(lies_at(i) - lies_at(j)))
        };
        let mut correspondences = found.correspondences.clone();
        for _ in 0..SWAP_ROUNDS {
            for one in 0..correspondences.len() {
                for other in 0..one {
                    if margin(&correspondences[one], &correspondences[other]) < 0.0 {
                        let (p, q) = (correspondences[one].0, correspondences[other].0);
                        (correspondences[one].0, correspondences[other].0) = (q, p);
                    }
                }
            }
        }
        let variance = |frame: &Frame, unshared: &UnsharedLandmarks, one: usize, other: usize| {
            let landmarks = [one, other].map(|at| frame.landmarks.get(&unshared.labels[at]));
            let [Some(one), Some(other)] = landmarks else {
                return f64::INFINITY;
            };
            frame.separation(one, other, is_planar).sd_m.powi(2)
        };
        let is_sure = |&(p, i): &(usize, usize)| {
            let is_crossed_worse = |&(q, j): &(usize, usize)| {
                let variance = variance(older, known, p, q) + variance(newer, sought, i, j);
                (p, i) == (q, j) || margin(&(p, i), &(q, j)) > SURE_MARGIN * variance
            };
            let here = apart_m2(p, i);
            let is_worse = |one: usize, other: usize| {
                let variance = known.points[one].variance + sought.points[other].variance;
                apart_m2(one, other) - here > SURE_MARGIN * variance
            };
            let mut free_older = (0..known.points.len()).filter(|at| {
                correspondences
                    .iter()
                    .all(|correspondence| correspondence.0 != *at)
            });
            let mut free_newer = (0..sought.points.len()).filter(|at| {
                correspondences
                    .iter()
                    .all(|correspondence| correspondence.1 != *at)
            });
            correspondences.iter().all(is_crossed_worse)
                && free_older.all(|at| is_worse(at, i))
                && free_newer.all(|at| is_worse(p, at))
        };
        correspondences
            .iter()
            .filter(|correspondence| is_sure(correspondence))
            .copied()
            .collect()
    }

    /// A landmark goes by another name in every frame that does not know that yet.
    pub(super) fn rename_landmark(&mut self, label: &Label, name: &Label) {
        for number in 0..self.frames.len() {
            let frame = self.frame(number);
            if frame.has_name(label) && !frame.has_name(name) {
                self.frame_mut(number).rename(label, name);
            }
        }
    }
}

impl Frame {
    /// Whether it has a landmark of a name.
    pub(super) fn has_name(&self, label: &Label) -> bool {
        self.landmarks.contains_key(label) || self.archive.contains(label)
    }

    /// The landmarks that another frame has no name for, the `most` seen last of them, the best
    /// known first.
    fn unshared(&self, other: &Self, most: usize, is_planar: bool) -> UnsharedLandmarks {
        let landmarks = self.landmarks.iter();
        let mut landmarks: Vec<(&Label, &LandmarkState)> = landmarks
            .filter(|(label, _)| !other.has_name(label))
            .collect();
        landmarks.sort_by_key(|(_, landmark)| Reverse(landmark.used));
        landmarks.truncate(most);
        let only: Vec<&LandmarkState> = landmarks.iter().map(|(_, landmark)| *landmark).collect();
        let variances = self.gauge_free_variances(&only, is_planar);
        let mut known: Vec<(f64, (&Label, &LandmarkState))> =
            variances.into_iter().zip(landmarks).collect();
        known.sort_by(|a, b| a.0.total_cmp(&b.0));
        let point = |&(variance, (_, landmark)): &(f64, (&Label, &LandmarkState))| UncertainPoint {
            position: landmark.position,
            variance: LANDMARK_WIDENING * variance + SAME_LANDMARK_VARIANCE_M2,
        };
        UnsharedLandmarks {
            points: known.iter().map(point).collect(),
            labels: known
                .iter()
                .map(|(_, (label, _))| (*label).clone())
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests;
