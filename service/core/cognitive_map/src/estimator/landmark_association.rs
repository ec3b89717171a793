//! Association of landmarks of one frame that agents call by different names.
//!
//! A landmark of one agent that lies where others know a landmark may be the same. One such pair
//! proves nothing: as many must agree as chance would bring together once in ten thousand times,
//! given how densely landmarks lie. Landmarks that were associated before count with them, so that
//! later ones follow one by one. Two landmarks that one agent has called by different names are
//! never one.

use nalgebra::Matrix3;

use super::effect::Effect;
use super::frame::{Frame, LANDMARK_DIM, LandmarkState};
use super::joint::Estimator;
use super::parameters::Parameters;
use super::registration::{GATE, PointIndex, UncertainPoint, log10_at_least};
use super::tuning::{
    ASSOCIATION_CHANCE_MAX, ASSOCIATION_LOG10_CHANCE_MAX, LANDMARK_WIDENING,
    SAME_LANDMARK_VARIANCE_M2,
};
use crate::input::Label;

impl Estimator {
    /// Looks whether an agent has names of its own for landmarks of its frame that others know.
    pub(super) fn associate_within_frame(
        &mut self,
        number: usize,
        agent: u32,
        effects: &mut Vec<Effect>,
    ) {
        let found = self.find_associations(self.frame(number), agent);
        if !self.associations.has_room(found.len()) {
            return;
        }
        let parameters = self.parameters.clone();
        for (label, name) in &found {
            self.frame_mut(number).unite(label, name, &parameters);
            self.associations.insert(label, name);
            self.rename_landmark(label, name);
        }
        if !found.is_empty() {
            effects.push(Effect::LandmarksAssociated(found));
        }
    }

    /// The landmarks that an agent calls otherwise than others do: the younger name, and the older
    /// one.
    fn find_associations(&self, frame: &Frame, agent: u32) -> Vec<(Label, Label)> {
        let is_planar = frame.is_planar();
        let landmarks = || frame.landmarks.iter();
        let is_own = |landmark: &LandmarkState| landmark.observers.contains(agent);
        // Most often all landmarks are everybody's.
        let others: Vec<(&Label, &LandmarkState)> = landmarks()
            .filter(|(_, landmark)| !is_own(landmark))
            .collect();
        if others.is_empty() {
            return Vec::new();
        }
        let point = |landmark: &LandmarkState| UncertainPoint {
            position: landmark.position,
            variance: 0.0,
        };
        let points: Vec<UncertainPoint> =
            landmarks().map(|(_, landmark)| point(landmark)).collect();
        let index = PointIndex::new(&points, is_planar);
        let proven = self.associations.names_of_others();
        let is_proven = |label: &Label| proven.binary_search(&label).is_ok();
        let (mut chances, mut found) = (Vec::new(), Vec::new());
        let (mut n_sought, mut n_proven) = (0, 0);
        for (label, landmark) in landmarks().filter(|(_, landmark)| is_own(landmark)) {
            n_proven += usize::from(is_proven(label));
            let near = others.iter().filter_map(|(name, other)| {
                let is_apart = landmark.observers.is_apart_from(&other.observers);
                is_apart.then(|| (*name, *other, frame.separation(landmark, other, is_planar)))
            });
            // Where the others know nothing there is nothing to be found.
            let near =
                near.filter(|(_, _, separation)| index.chance_within(separation.distance_m) < 1.0);
            let near: Vec<_> = near.collect();
            let mut within = near
                .iter()
                .filter(|(_, _, separation)| separation.is_within_gate);
            let (nearest, second) = (within.next(), within.next());
            let Some((name, other, separation)) = nearest.filter(|_| second.is_none()) else {
                n_sought += usize::from(!near.is_empty() && second.is_none() && !is_proven(label));
                continue;
            };
            if index.chance_within(GATE * separation.sd_m) > ASSOCIATION_CHANCE_MAX {
                continue;
            }
            n_sought += 1;
            chances.push(index.chance_within(separation.distance_m.max(separation.sd_m)));
            found.push(if landmark.number < other.number {
                ((*name).clone(), label.clone())
            } else {
                (label.clone(), (*name).clone())
            });
        }
        let agreeing = found.len() + n_proven;
        if is_beyond_chance(agreeing, n_sought + n_proven, &chances) && are_pairs(&found) {
            found
        } else {
            Vec::new()
        }
    }
}

/// Whether chance brings so many landmarks together seldom enough; `chances` are those of each one
/// alone.
fn is_beyond_chance(agreeing: usize, sought: usize, chances: &[f64]) -> bool {
    let largest = chances.iter().copied().fold(0.0, f64::max);
    log10_at_least(agreeing, sought, largest) < ASSOCIATION_LOG10_CHANCE_MAX
}

/// Whether no name is in more than one of the pairs.
fn are_pairs(found: &[(Label, Label)]) -> bool {
    let names = found.iter().flat_map(|(label, name)| [label, name]);
    let mut names: Vec<&Label> = names.collect();
    names.sort_unstable();
    names.windows(2).all(|two| two[0] != two[1])
}

/// How far two landmarks are estimated to be from one another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Separation {
    distance_m: f64,
    /// Deviation of it along an axis \[m\].
    pub(super) sd_m: f64,
    /// Whether they may be in one place.
    is_within_gate: bool,
}

impl Frame {
    pub(super) fn separation(
        &self,
        one: &LandmarkState,
        other: &LandmarkState,
        is_planar: bool,
    ) -> Separation {
        let mixed: Matrix3<f64> = self.covariance.block(one.offset, other.offset);
        let spread = self.landmark_covariance(one) + self.landmark_covariance(other)
            - mixed
            - mixed.transpose();
        let variance = if is_planar {
            f64::midpoint(spread[(0, 0)], spread[(1, 1)])
        } else {
            spread.trace() / 3.0
        };
        let variance = LANDMARK_WIDENING * variance.max(0.0) + 2.0 * SAME_LANDMARK_VARIANCE_M2;
        let distance_m = (one.position - other.position).norm();
        Separation {
            distance_m,
            sd_m: variance.sqrt(),
            is_within_gate: distance_m * distance_m <= GATE * GATE * variance,
        }
    }

    /// A landmark is one that has another name.
    fn unite(&mut self, label: &Label, name: &Label, parameters: &Parameters) {
        self.flush();
        let Some(landmark) = self.take_out(label) else {
            return;
        };
        let mut duplicates = [(name.clone(), landmark)];
        self.equate(&mut duplicates, 0, parameters);
        let [(_, duplicate)] = duplicates;
        self.drop_components(duplicate.offset, LANDMARK_DIM);
    }
}
