//! Frames whose landmarks lie alike, though they are called otherwise.

use std::cmp::Reverse;

use nalgebra::Isometry3;

use super::constellation::{
    GATE, Likeness, SOUGHT_MAX, SURE_MARGIN, Star, apart_m, likeness, mean_variance,
};
use super::frame::{Frame, Mark};
use super::joint::{Estimator, MAP};
use super::tie::{Pair, tie};
use crate::input::Label;

/// Sightings of a frame between two looks.
///
/// A prime, so that it is not always the same agent's turn where agents see in turn.
const LOOK_EVERY: u64 = 31;
/// Looks at which the same motion is found before it is believed.
const LOOKS_MIN: u32 = 3;
/// Rounds of looking whether pairs of twins fit better crosswise.
const CROSSED_ROUNDS: usize = 3;
/// Landmarks of the older frame among which others are sought, in the plane and in space, where it takes three to a motion.
const KNOWN_MAX: (usize, usize) = (64, 32);
/// Most pairs of frames of which it is remembered what was found.
pub(super) const RESEMBLANCES_MAX: usize = 64;
/// Frames among which the next one to look at is sought.
const TURNED_MAX: usize = 16;
/// By how much the landmarks' variances are widened: sensors err alike for a while, which the estimate takes for more
/// independent than it is, so that it is too sure of itself.
pub(super) const WIDENING: f64 = 4.0;
/// Variance of the distance between two estimates of one landmark, beside their own \[m²\].
pub(super) const SAME_VARIANCE_M2: f64 = 1e-4;

/// How a frame seems to lie in another one.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Resemblance {
    /// The older one and the newer one.
    pub(super) frames: [usize; 2],
    /// Pose of the newer one in the older one, as found last.
    pub(super) pose: Isometry3<f64>,
    /// At how many looks in a row.
    pub(super) looks: u32,
}

/// Landmarks of a frame that the other frame has no name for.
#[derive(Clone, Debug)]
struct Strangers {
    labels: Vec<Label>,
    stars: Vec<Star>,
}

impl Estimator {
    /// Looks now and then whether landmarks have other names, too: in an agent's frame for the agent itself, and, if that is not the
    /// map's, for another frame. When that is depends on the sightings alone.
    pub(super) fn look_at_names(&mut self, own: usize, agent: u32) {
        let sightings = self.frame(own).sightings;
        if !sightings.is_multiple_of(LOOK_EVERY) {
            return;
        }
        if own != MAP
            && let Some(other) = self.next_to_look_at(own, sightings / LOOK_EVERY)
        {
            self.look_alike(own, other);
        } else {
            self.look_for_synonyms(own, agent);
        }
    }

    /// Looks whether the landmarks of a frame lie like those of another one.
    fn look_alike(&mut self, own: usize, other: usize) {
        let (older, newer) = (own.min(other), own.max(other));
        let is_planar = self.frame(older).is_planar() && self.frame(newer).is_planar();
        let known_max = if is_planar { KNOWN_MAX.0 } else { KNOWN_MAX.1 };
        let [known, sought] =
            [(older, newer, known_max), (newer, older, SOUGHT_MAX)].map(|(one, other, most)| {
                self.frame(one)
                    .strangers(self.frame(other), most, is_planar)
            });
        match likeness(&known.stars, &sought.stars, is_planar) {
            Some(likeness) => {
                if self.note(older, newer, &likeness, &sought.stars) >= LOOKS_MIN {
                    self.believe(older, newer, &likeness, &known, &sought);
                }
            }
            None => self
                .resemblances
                .retain(|resemblance| resemblance.frames != [older, newer]),
        }
    }

    /// The frame that one is compared with at a look: every second time that of the map, and the others in turn.
    fn next_to_look_at(&self, own: usize, look: u64) -> Option<usize> {
        let count = self.frames.len();
        if look.is_multiple_of(2) {
            return (self.frame(MAP).population > 0).then_some(MAP);
        }
        let start = usize::try_from(look / 2 % count as u64).ok()?;
        let turn = (0..count.min(TURNED_MAX)).map(|k| (start + k) % count);
        let is_other = |&other: &usize| other != own && !self.frame(other).marks.is_empty();
        turn.filter(|&other| other != MAP).find(is_other)
    }

    /// Notes what was found; answers at how many looks in a row it was the same.
    fn note(&mut self, older: usize, newer: usize, found: &Likeness, stars: &[Star]) -> u32 {
        let frames = [older, newer];
        let near_m = 2.0 * GATE * mean_variance(stars).sqrt();
        let earlier = self
            .resemblances
            .iter()
            .position(|one| one.frames == frames);
        let earlier = earlier.map(|at| self.resemblances.remove(at));
        let same = earlier.filter(|one| apart_m(&one.pose, &found.pose, stars) < near_m);
        let looks = same.map_or(0, |one| one.looks).saturating_add(1);
        if self.resemblances.len() >= RESEMBLANCES_MAX {
            self.resemblances.remove(0);
        }
        self.resemblances.push(Resemblance {
            frames,
            pose: found.pose,
            looks,
        });
        looks
    }

    /// Lays a frame into an older one by landmarks that are the same, which go by the older one's names from now on.
    fn believe(
        &mut self,
        older: usize,
        newer: usize,
        found: &Likeness,
        known: &Strangers,
        sought: &Strangers,
    ) {
        let pair = |&(one, other): &(usize, usize)| Pair {
            older: known.stars[one].position,
            newer: sought.stars[other].position,
            variance: known.stars[one].variance + sought.stars[other].variance,
        };
        let twins = self.sure_twins(older, newer, found, known, sought);
        let pairs: Vec<Pair> = twins.iter().map(pair).collect();
        let is_planar = self.frame(older).is_planar() && self.frame(newer).is_planar();
        let Some(tie) = tie(&pairs, is_planar).filter(|_| self.aliases.has_room(pairs.len()))
        else {
            return;
        };
        let twins = twins.iter();
        let same: Vec<(Label, Label)> = twins
            .map(|&(one, other)| (sought.labels[other].clone(), known.labels[one].clone()))
            .collect();
        for (label, name) in &same {
            self.aliases.insert(label, name);
            self.rename_elsewhere(label, name);
        }
        self.merge(older, newer, &tie);
        self.same = same;
    }

    /// The twins of which it is sure which is which.
    ///
    /// How two landmarks close together lie to one another is known far better than where they are: two pairs are taken crosswise if
    /// that fits better, and neither counts unless the other way fits much worse. The same holds of landmarks that are no
    /// twins, of which only the positions can be compared.
    fn sure_twins(
        &self,
        older: usize,
        newer: usize,
        found: &Likeness,
        known: &Strangers,
        sought: &Strangers,
    ) -> Vec<(usize, usize)> {
        let (older, newer) = (self.frame(older), self.frame(newer));
        let is_planar = older.is_planar() && newer.is_planar();
        let lies_at = |at: usize| found.pose * sought.stars[at].position;
        let apart_m2 =
            |one: usize, other: usize| (lies_at(other) - known.stars[one].position).norm_squared();
        // By how much farther apart the differences are if two pairs are taken crosswise.
        let margin = |&(p, i): &(usize, usize), &(q, j): &(usize, usize)| {
            let there = known.stars[p].position - known.stars[q].position;
            4.0 * there.dot(&(lies_at(i) - lies_at(j)))
        };
        let mut twins = found.twins.clone();
        for _ in 0..CROSSED_ROUNDS {
            for one in 0..twins.len() {
                for other in 0..one {
                    if margin(&twins[one], &twins[other]) < 0.0 {
                        let (p, q) = (twins[one].0, twins[other].0);
                        (twins[one].0, twins[other].0) = (q, p);
                    }
                }
            }
        }
        let variance = |frame: &Frame, strangers: &Strangers, one: usize, other: usize| {
            let marks = [one, other].map(|at| frame.marks.get(&strangers.labels[at]));
            let [Some(one), Some(other)] = marks else {
                return f64::INFINITY;
            };
            frame.apart(one, other, is_planar).sd_m.powi(2)
        };
        let is_sure = |&(p, i): &(usize, usize)| {
            let is_crossed_worse = |&(q, j): &(usize, usize)| {
                let variance = variance(older, known, p, q) + variance(newer, sought, i, j);
                (p, i) == (q, j) || margin(&(p, i), &(q, j)) > SURE_MARGIN * variance
            };
            let here = apart_m2(p, i);
            let is_worse = |one: usize, other: usize| {
                let variance = known.stars[one].variance + sought.stars[other].variance;
                apart_m2(one, other) - here > SURE_MARGIN * variance
            };
            let mut free_older =
                (0..known.stars.len()).filter(|at| twins.iter().all(|twin| twin.0 != *at));
            let mut free_newer =
                (0..sought.stars.len()).filter(|at| twins.iter().all(|twin| twin.1 != *at));
            twins.iter().all(is_crossed_worse)
                && free_older.all(|at| is_worse(at, i))
                && free_newer.all(|at| is_worse(p, at))
        };
        twins.iter().filter(|twin| is_sure(twin)).copied().collect()
    }

    /// A landmark goes by another name in every frame that does not know that yet.
    pub(super) fn rename_elsewhere(&mut self, label: &Label, name: &Label) {
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
    fn has_name(&self, label: &Label) -> bool {
        self.marks.contains_key(label) || self.dormant.contains(label)
    }

    /// The landmarks that another frame has no name for, the `most` seen last of them, the best known first.
    fn strangers(&self, other: &Self, most: usize, is_planar: bool) -> Strangers {
        let marks = self.marks.iter();
        let mut marks: Vec<(&Label, &Mark)> =
            marks.filter(|(label, _)| !other.has_name(label)).collect();
        marks.sort_by_key(|(_, mark)| Reverse(mark.used));
        marks.truncate(most);
        let only: Vec<&Mark> = marks.iter().map(|(_, mark)| *mark).collect();
        let variances = self.shape_variances(&only, is_planar);
        let mut known: Vec<(f64, (&Label, &Mark))> = variances.into_iter().zip(marks).collect();
        known.sort_by(|a, b| a.0.total_cmp(&b.0));
        let star = |&(variance, (_, mark)): &(f64, (&Label, &Mark))| Star {
            position: mark.position,
            variance: WIDENING * variance + SAME_VARIANCE_M2,
        };
        Strangers {
            stars: known.iter().map(star).collect(),
            labels: known
                .iter()
                .map(|(_, (label, _))| (*label).clone())
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests;
