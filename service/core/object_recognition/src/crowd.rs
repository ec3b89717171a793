//! Hypotheses that nobody has looked at yet: every place, taken for the one that was touched first.

use std::sync::Arc;

use nalgebra::UnitQuaternion;

use super::contact::Contact;
use super::feeling::Feeling;
use super::group::{Group, Lists};
use super::library::{Known, ObjectId, ObjectLibrary};
use super::ranks::Ranks;
use super::shifts::{Shift, Taken};
use super::spots::narrow;

/// Most roots; of larger libraries every second place stands for two, or every third for three.
const ROOTS_MAX: usize = 1 << 22;
/// Weights are brought back to one when the heaviest is so far from it.
const HEAVY: f32 = 1_048_576.0;

/// All of them, as far as they hold something and have not been looked at: the *roots*.
///
/// What a touch says of them is estimated: the place that is nearest to where it would be is the one touched, or none. Where none is near,
/// that is exact.
#[derive(Clone, Debug, Default)]
pub(super) struct Crowd {
    /// By object and rotation.
    groups: Vec<Group>,
    first: Option<Contact>,
    /// What weights are multiplied by; a log.
    log: f64,
}

/// One of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Root {
    group: usize,
    number: usize,
    weight: f32,
}

impl Crowd {
    /// After the first touch.
    pub(super) fn new(
        library: &ObjectLibrary,
        rotations: &[UnitQuaternion<f64>],
        contact: &Contact,
    ) -> Self {
        let places = library.surfaces().map(|(_, own)| own.patches.len());
        let stride = (places.sum::<usize>() * rotations.len()).div_ceil(ROOTS_MAX);
        let stride = stride.max(1);
        let mut crowd = Self {
            groups: Vec::new(),
            first: Some(contact.clone()),
            log: 0.0,
        };
        let feeling = Feeling::new(contact, library.wide());
        let mut likelihoods = Vec::new();
        for (object, known) in library.all() {
            let places = known.surface.patches.len() * rotations.len();
            let each = stride as f64 / places.max(1) as f64;
            for (rotation, turn) in (0u16..).zip(rotations) {
                let local = feeling.at(&known.surface, turn);
                if rotation == 0 || !local.is_unturned() {
                    local.likelihoods(&mut likelihoods);
                }
                let known = Arc::clone(known);
                let group = Group::new((object, rotation), known, each, stride, &likelihoods);
                crowd.groups.push(group);
            }
        }
        crowd.settle();
        crowd
    }

    /// Whether none is left.
    pub(super) fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// How many there are; some of them may hold nothing any more.
    pub(super) fn len(&self) -> usize {
        self.groups.iter().map(|group| group.weights.len()).sum()
    }

    fn most(&self) -> f32 {
        { self.groups.iter() }
            .map(|group| group.most)
            .fold(0.0, f32::max)
    }

    /// Log of the mass of the heaviest.
    pub(super) fn best_log(&self) -> f64 {
        f64::from(self.most()).ln() + self.log
    }

    /// Log of the mass of each group, with its object.
    pub(super) fn masses(&self) -> impl Iterator<Item = (ObjectId, f64)> {
        self.groups
            .iter()
            .map(|group| (group.object, group.sum.ln() + self.log))
    }

    /// Counts all masses, each times e^`log` of its object.
    pub(super) fn count(&self, ranks: &mut Ranks, log: impl Fn(ObjectId) -> Option<f64>) {
        for group in &self.groups {
            if let Some(log) = log(group.object) {
                ranks.add_all(&group.weights, narrow((self.log + log).exp()));
            }
        }
    }

    /// Takes a touch in, and gives the weight of each that it makes worth a look, group after group: of those that have a
    /// place near. That of others is nothing.
    pub(super) fn sift(
        &mut self,
        library: &ObjectLibrary,
        rotations: &[UnitQuaternion<f64>],
        touch: &Taken<'_>,
    ) -> Vec<f32> {
        let mut worth = vec![0.0; self.len()];
        let Some(first) = &self.first else {
            return worth;
        };
        let mut lists = Lists::default();
        let mut from = 0;
        for group in &mut self.groups {
            let own = &mut worth[from..from + group.weights.len()];
            from += own.len();
            if library.surface(group.object).is_none() {
                group.forget();
                continue;
            }
            let rotation = &rotations[usize::from(group.rotation)];
            group.sift(first, rotation, touch, &mut lists, own);
        }
        // All were taken for hypotheses whose touch was an outlier.
        self.log += touch.outlier.ln();
        worth
    }

    /// How many roots hold all of the mass of those that are worth a look but next to nothing, e^`rest_log`.
    pub(super) fn holding(&self, worth: &[f32], rest_log: f64) -> usize {
        let (ranks, per_top) = self.ranks(worth);
        let rest = (rest_log - self.log).exp() * f64::from(per_top);
        ranks.holding((ranks.sum() - rest).max(0.0))
    }

    /// Of the roots that are worth a look so many heaviest.
    pub(super) fn heaviest(&self, worth: &[f32], count: usize) -> Vec<Root> {
        let (ranks, per_top) = self.ranks(worth);
        if count == 0 {
            return Vec::new();
        }
        let (least, heavy) = ranks.least(count);
        // Of more than that which are alike, some, wherever they are.
        let step = heavy.div_ceil(count).max(1);
        let mut heaviest = Vec::with_capacity(count);
        let (mut from, mut met) = (0, 0);
        for (number, group) in self.groups.iter().enumerate() {
            let own = &worth[from..from + group.weights.len()];
            from += own.len();
            for (root, weight) in own.iter().enumerate() {
                if weight * per_top >= least && heaviest.len() < count {
                    if met % step == 0 {
                        heaviest.push(Root {
                            group: number,
                            number: root,
                            weight: *weight,
                        });
                    }
                    met += 1;
                }
            }
        }
        heaviest
    }

    /// Weights by rank, and what they are multiplied by for that.
    fn ranks(&self, worth: &[f32]) -> (Ranks, f32) {
        let per_top = 1.0 / self.most().max(f32::MIN_POSITIVE);
        let mut ranks = Ranks::new(worth.len());
        ranks.add_all(worth, per_top);
        (ranks, per_top)
    }

    /// Takes one out, as it was after the first touch, with the map that it is in.
    pub(super) fn take(
        &mut self,
        root: &Root,
        rotations: &[UnitQuaternion<f64>],
        first: &Feeling<'_>,
    ) -> (Shift, &Known) {
        let group = &mut self.groups[root.group];
        group.weights[root.number] = 0.0;
        let rotation = &rotations[usize::from(group.rotation)];
        (group.shift(root.number, rotation, first), group.known())
    }

    /// The heaviest of an object, heaviest first, so many at most.
    pub(super) fn best_of(&self, object: ObjectId, most: usize) -> Vec<Root> {
        let mut best: Vec<Root> = Vec::new();
        let from = self.groups.partition_point(|group| group.object < object);
        let to = self.groups.partition_point(|group| group.object <= object);
        for (number, group) in (from..to).zip(&self.groups[from..to]) {
            for (root, weight) in group.weights.iter().enumerate() {
                let least = best.get(most - 1).map_or(0.0, |least| least.weight);
                if *weight > least {
                    let at = best.partition_point(|other| other.weight >= *weight);
                    best.truncate(most - 1);
                    let root = Root {
                        group: number,
                        number: root,
                        weight: *weight,
                    };
                    best.insert(at.min(best.len()), root);
                }
            }
        }
        best
    }

    /// What one would be as a hypothesis of its own, with its mass so far.
    pub(super) fn as_shift(&self, root: &Root, rotations: &[UnitQuaternion<f64>]) -> Option<Shift> {
        let first = Feeling::new(self.first.as_ref()?, &[]);
        let group = self.groups.get(root.group)?;
        let rotation = &rotations[usize::from(group.rotation)];
        Some(Shift {
            evidence: f64::from(root.weight).ln() + self.log,
            ..group.shift(root.number, rotation, &first)
        })
    }

    /// Objects none of whose places holds so much.
    pub(super) fn fading(&self, least_log: f64) -> Vec<ObjectId> {
        let least = narrow((least_log - self.log).exp());
        let own = self.groups.chunk_by(|a, b| a.object == b.object);
        let fading = own.filter(|own| own.iter().all(|group| group.most < least));
        fading.map(|own| own[0].object).collect()
    }

    /// Drops those whose mass is below e^`least_log`.
    pub(super) fn drop_below(&mut self, least_log: f64) {
        let least = narrow((least_log - self.log).exp());
        for group in &mut self.groups {
            group.drop_below(least);
        }
        self.settle();
    }

    /// Brings weights back to about one, and forgets groups of which nothing is left.
    fn settle(&mut self) {
        self.groups.retain(|group| group.most > 0.0);
        let most = self.most();
        if most > 0.0 && !(1.0 / HEAVY..=HEAVY).contains(&most) {
            self.log += f64::from(most).ln();
            for group in &mut self.groups {
                group.divide(most);
            }
        }
    }
}
