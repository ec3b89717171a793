//! Landmarks of one frame that have another name for some of its agents.
//!
//! What one agent calls by names of its own lies, landmark by landmark, where others know something. One such pair is no
//! proof: as many must agree as chance would bring together once in ten thousand times, by how densely landmarks lie. Those
//! that were found to be the same before count with them, so that what the agent comes to see later follows one by one. Two
//! landmarks that one agent has told apart are never one.

use nalgebra::Matrix3;

use super::constellation::{GATE, Sky, Star, log10_at_least};
use super::frame::{Frame, MARK_DIM, Mark};
use super::joint::Estimator;
use super::parameters::Parameters;
use super::resemblance::{SAME_VARIANCE_M2, WIDENING};
use crate::input::Label;

/// Log₁₀ of the probability that as many landmarks agree by chance, for them to be believed.
const LOG10_CHANCE_MAX: f64 = -4.0;
/// Largest probability that something lies by chance where a landmark would be taken for another. One that is known less well says
/// nothing yet.
const CHANCE_MAX: f64 = 0.25;

impl Estimator {
    /// Looks whether an agent has names of its own for landmarks of its frame that others know.
    pub(super) fn look_for_synonyms(&mut self, number: usize, agent: u32) {
        let found = self.synonyms(self.frame(number), agent);
        if !self.aliases.has_room(found.len()) {
            return;
        }
        let parameters = self.parameters.clone();
        for (label, name) in found {
            self.frame_mut(number).unite(&label, &name, &parameters);
            self.aliases.insert(&label, &name);
            self.rename_elsewhere(&label, &name);
            self.same.push((label, name));
        }
    }

    /// The landmarks that an agent calls otherwise than others do: the younger name, and the older one.
    fn synonyms(&self, frame: &Frame, agent: u32) -> Vec<(Label, Label)> {
        let is_planar = frame.is_planar();
        let marks = || frame.marks.iter();
        let is_own = |mark: &Mark| mark.observers.contains(agent);
        // Most often all landmarks are everybody's.
        let others: Vec<(&Label, &Mark)> = marks().filter(|(_, mark)| !is_own(mark)).collect();
        if others.is_empty() {
            return Vec::new();
        }
        let star = |mark: &Mark| Star {
            position: mark.position,
            variance: 0.0,
        };
        let stars: Vec<Star> = marks().map(|(_, mark)| star(mark)).collect();
        let sky = Sky::new(&stars, is_planar);
        let proven = self.aliases.names_of_others();
        let is_proven = |label: &Label| proven.binary_search(&label).is_ok();
        let (mut chances, mut found) = (Vec::new(), Vec::new());
        let (mut n_sought, mut n_proven) = (0, 0);
        for (label, mark) in marks().filter(|(_, mark)| is_own(mark)) {
            n_proven += usize::from(is_proven(label));
            let near = others.iter().filter_map(|(name, other)| {
                let is_apart = mark.observers.is_apart_from(&other.observers);
                is_apart.then(|| (*name, *other, frame.apart(mark, other, is_planar)))
            });
            // Where the others know nothing there is nothing to be found.
            let near = near.filter(|(_, _, apart)| sky.chance_within(apart.distance_m) < 1.0);
            let near: Vec<_> = near.collect();
            let mut within = near.iter().filter(|(_, _, apart)| apart.is_within_gate);
            let (nearest, second) = (within.next(), within.next());
            let Some((name, other, apart)) = nearest.filter(|_| second.is_none()) else {
                n_sought += usize::from(!near.is_empty() && second.is_none() && !is_proven(label));
                continue;
            };
            if sky.chance_within(GATE * apart.sd_m) > CHANCE_MAX {
                continue;
            }
            n_sought += 1;
            chances.push(sky.chance_within(apart.distance_m.max(apart.sd_m)));
            found.push(if mark.number < other.number {
                ((*name).clone(), label.clone())
            } else {
                (label.clone(), (*name).clone())
            });
        }
        let largest = chances.iter().copied().fold(0.0, f64::max);
        let agreeing = found.len() + n_proven;
        let is_proven = log10_at_least(agreeing, n_sought + n_proven, largest) < LOG10_CHANCE_MAX;
        let mut names: Vec<&Label> = found
            .iter()
            .flat_map(|(label, name)| [label, name])
            .collect();
        names.sort_unstable();
        let are_pairs = names.windows(2).all(|two| two[0] != two[1]);
        if is_proven && are_pairs {
            found
        } else {
            Vec::new()
        }
    }
}

/// How far two landmarks are estimated to be from one another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Apart {
    distance_m: f64,
    /// Deviation of it along an axis \[m\].
    pub(super) sd_m: f64,
    /// Whether they may be in one place.
    is_within_gate: bool,
}

impl Frame {
    pub(super) fn apart(&self, one: &Mark, other: &Mark, is_planar: bool) -> Apart {
        let mixed: Matrix3<f64> = self.covariance.block(one.offset, other.offset);
        let spread =
            self.mark_covariance(one) + self.mark_covariance(other) - mixed - mixed.transpose();
        let variance = if is_planar {
            f64::midpoint(spread[(0, 0)], spread[(1, 1)])
        } else {
            spread.trace() / 3.0
        };
        let variance = WIDENING * variance.max(0.0) + 2.0 * SAME_VARIANCE_M2;
        let distance_m = (one.position - other.position).norm();
        Apart {
            distance_m,
            sd_m: variance.sqrt(),
            is_within_gate: distance_m * distance_m <= GATE * GATE * variance,
        }
    }

    /// A landmark is one that has another name.
    fn unite(&mut self, label: &Label, name: &Label, parameters: &Parameters) {
        self.flush();
        let Some(mark) = self.take_out(label) else {
            return;
        };
        let mut twins = [(name.clone(), mark)];
        self.equate(&mut twins, 0, parameters);
        let [(_, twin)] = twins;
        self.drop_components(twin.offset, MARK_DIM);
    }
}
