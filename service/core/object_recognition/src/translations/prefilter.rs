//! Prefilter: every place of every model, taken for the one touched first, with an estimated mass.

use std::sync::Arc;

use nalgebra::UnitQuaternion;

use crate::contact::Contact;
use crate::indexed_model::IndexedModel;
use crate::library::ObjectLibrary;
use crate::numeric::to_f32;
use crate::percept_likelihood::ContactPercepts;
use crate::translations::hypothesis::TranslationHypothesis;
use crate::translations::mass_histogram::MassHistogram;
use crate::translations::prefilter_group::{PrefilterGroup, Scratch};
use crate::translations::touch_update::TouchUpdate;
use crate::tuning::{RESCALE, RESIZE_NATS_MAX, SEEDS_MAX};
use crate::variant::VariantId;

/// The *seeds*: all first places that hold a mass and were not promoted to hypotheses of their own.
///
/// Their likelihood of a touch is estimated: the place nearest to the predicted point is the one
/// touched, or none. Without a place near, that is exact.
#[derive(Clone, Debug, Default)]
pub(crate) struct Prefilter {
    /// By model and rotation.
    groups: Vec<PrefilterGroup>,
    first: Option<Contact>,
    /// Log of the common factor of all weights.
    log: f64,
}

/// A first place, by its indices and weight.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seed {
    group: usize,
    number: usize,
    weight: f32,
}

impl Prefilter {
    /// After the first touch of an episode, over these models.
    pub(crate) fn new(
        library: &ObjectLibrary,
        rotations: &[UnitQuaternion<f64>],
        contact: &Contact,
        holds: &impl Fn(VariantId, &IndexedModel) -> bool,
    ) -> Self {
        let variants = || library.variants().filter(|(of, own)| holds(*of, own));
        let places = variants().map(|(_, own)| own.places.len());
        let stride = (places.sum::<usize>() * rotations.len()).div_ceil(SEEDS_MAX);
        let stride = stride.max(1);
        let mut prefilter = Self {
            groups: Vec::new(),
            first: Some(contact.clone()),
            log: 0.0,
        };
        let percepts = ContactPercepts::new(contact, library.level_prior());
        let mut likelihoods = Vec::new();
        for (of, known) in variants() {
            let places = known.places.len() * rotations.len();
            let unexplored = known.open.as_ref().map_or(0.0, |open| open.unexplored);
            let each = (1.0 - unexplored) * stride as f64 / places.max(1) as f64;
            for (rotation, turn) in (0u16..).zip(rotations) {
                let local = percepts.at(known, turn);
                if rotation == 0 || !local.is_rotation_invariant() {
                    local.likelihoods(&mut likelihoods);
                }
                let known = Arc::clone(known);
                let group = PrefilterGroup::new((of, rotation), known, each, stride, &likelihoods);
                prefilter.groups.push(group);
            }
        }
        prefilter.normalise();
        prefilter
    }

    /// Whether no seed is left.
    pub(crate) fn is_empty(&self) -> bool {
        self.groups.is_empty()
    }

    /// Number of seeds; some may have no mass.
    pub(crate) fn len(&self) -> usize {
        self.groups.iter().map(|group| group.weights.len()).sum()
    }

    fn most(&self) -> f32 {
        { self.groups.iter() }
            .map(|group| group.most)
            .fold(0.0, f32::max)
    }

    /// Log of the mass of the heaviest seed.
    pub(crate) fn best_log(&self) -> f64 {
        f64::from(self.most()).ln() + self.log
    }

    /// Log of the mass of each group, with its model.
    pub(crate) fn masses(&self) -> impl Iterator<Item = (VariantId, f64)> {
        self.groups
            .iter()
            .map(|group| (group.of, group.sum.ln() + self.log))
    }

    /// Counts the masses of the models that count, multiplied by e^`log`.
    pub(crate) fn count(
        &self,
        histogram: &mut MassHistogram,
        log: f64,
        counts: impl Fn(VariantId) -> bool,
    ) {
        let scale = to_f32((self.log + log).exp());
        for group in self.groups.iter().filter(|group| counts(group.of)) {
            histogram.add_all(&group.weights, scale);
        }
    }

    /// Multiplies the masses of each model by e^`log`.
    pub(crate) fn resize(&mut self, log: impl Fn(VariantId) -> f64) {
        let logs: Vec<f64> = { self.groups.iter() }.map(|group| log(group.of)).collect();
        // What all have in common is no matter of weights.
        let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        for (group, log) in self.groups.iter_mut().zip(logs) {
            if log < most {
                group.multiply(to_f32((log - most).max(-RESIZE_NATS_MAX).exp()));
            }
        }
        if most.is_finite() {
            self.log += most;
        }
        self.normalise();
    }

    /// Updates all weights with a touch. Returns them, group after group, for the seeds that the
    /// touch supports by a place near the predicted point, and 0 for the others.
    pub(crate) fn update(
        &mut self,
        library: &ObjectLibrary,
        rotations: &[UnitQuaternion<f64>],
        touch: &TouchUpdate<'_>,
    ) -> Vec<f32> {
        let mut supported = vec![0.0; self.len()];
        let Some(first) = &self.first else {
            return supported;
        };
        let mut lists = Scratch::default();
        let mut from = 0;
        for group in &mut self.groups {
            let own = &mut supported[from..from + group.weights.len()];
            from += own.len();
            if library.variant(group.of).is_none() {
                group.forget();
                continue;
            }
            let rotation = &rotations[usize::from(group.rotation)];
            group.update(first, rotation, touch, &mut lists, own);
        }
        // Weights are relative to an outlier: the common factor is that of one.
        self.log += touch.outlier.ln();
        supported
    }

    /// Number of the heaviest supported seeds that hold all but e^`rest_log` of their mass.
    pub(crate) fn holding(&self, supported: &[f32], rest_log: f64) -> usize {
        let (histogram, per_top) = self.histogram(supported);
        let rest = (rest_log - self.log).exp() * f64::from(per_top);
        histogram.holding((histogram.sum() - rest).max(0.0))
    }

    /// The `count` heaviest supported seeds.
    pub(crate) fn heaviest(&self, supported: &[f32], count: usize) -> Vec<Seed> {
        let (histogram, per_top) = self.histogram(supported);
        if count == 0 {
            return Vec::new();
        }
        let (least, heavy) = histogram.least(count);
        // Of more equal ones every `step`-th, all over the models.
        let step = heavy.div_ceil(count).max(1);
        let mut heaviest = Vec::with_capacity(count);
        let (mut from, mut met) = (0, 0);
        for (number, group) in self.groups.iter().enumerate() {
            let own = &supported[from..from + group.weights.len()];
            from += own.len();
            for (seed, weight) in own.iter().enumerate() {
                if weight * per_top >= least && heaviest.len() < count {
                    if met % step == 0 {
                        heaviest.push(Seed {
                            group: number,
                            number: seed,
                            weight: *weight,
                        });
                    }
                    met += 1;
                }
            }
        }
        heaviest
    }

    /// Histogram of weights, and the factor by which they are scaled for it.
    fn histogram(&self, supported: &[f32]) -> (MassHistogram, f32) {
        let per_top = 1.0 / self.most().max(f32::MIN_POSITIVE);
        let mut histogram = MassHistogram::new(supported.len());
        histogram.add_all(supported, per_top);
        (histogram, per_top)
    }

    /// Removes a seed: the hypothesis that it was after the first touch, with its model.
    pub(crate) fn take(
        &mut self,
        seed: &Seed,
        rotations: &[UnitQuaternion<f64>],
        first: &ContactPercepts<'_>,
    ) -> (TranslationHypothesis, &IndexedModel) {
        let group = &mut self.groups[seed.group];
        group.weights[seed.number] = 0.0;
        let rotation = &rotations[usize::from(group.rotation)];
        (
            group.hypothesis(seed.number, rotation, first),
            group.known(),
        )
    }

    /// The `most` heaviest seeds of a model, heaviest first.
    pub(crate) fn best_of(&self, of: VariantId, most: usize) -> Vec<Seed> {
        let mut best: Vec<Seed> = Vec::new();
        let from = self.groups.partition_point(|group| group.of < of);
        let to = self.groups.partition_point(|group| group.of <= of);
        for (number, group) in (from..to).zip(&self.groups[from..to]) {
            for (seed, weight) in group.weights.iter().enumerate() {
                let least = best.get(most - 1).map_or(0.0, |least| least.weight);
                if *weight > least {
                    let at = best.partition_point(|other| other.weight >= *weight);
                    best.truncate(most - 1);
                    let seed = Seed {
                        group: number,
                        number: seed,
                        weight: *weight,
                    };
                    best.insert(at.min(best.len()), seed);
                }
            }
        }
        best
    }

    /// The `most` seeds of a hypothesis' model and rotation that are nearest to it.
    pub(crate) fn nearest(
        &self,
        own: &TranslationHypothesis,
        rotations: &[UnitQuaternion<f64>],
        most: usize,
    ) -> Vec<Seed> {
        let Some(contact) = self.first.as_ref() else {
            return Vec::new();
        };
        let first = ContactPercepts::new(contact, &[]);
        let mut near: Vec<(f64, Seed)> = Vec::new();
        for (group, of) in self.groups.iter().enumerate() {
            if (of.of, of.rotation) != own.map() {
                continue;
            }
            for (number, weight) in of.weights.iter().copied().enumerate() {
                let seed = of.hypothesis(number, &rotations[usize::from(of.rotation)], &first);
                let square = (seed.translation - own.translation).norm_squared();
                let seed = Seed {
                    group,
                    number,
                    weight,
                };
                near.push((square, seed));
            }
        }
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.into_iter().take(most).map(|(_, seed)| seed).collect()
    }

    /// Removes the seed that this hypothesis was after the first touch, if it waits. Masses are
    /// summed up anew by [`drop_below`](Self::drop_below).
    pub(crate) fn remove(
        &mut self,
        own: &TranslationHypothesis,
        rotations: &[UnitQuaternion<f64>],
    ) {
        let nearest = self.nearest(own, rotations, 1);
        let is_own = |seed: &&Seed| {
            let other = self.hypothesis(seed, rotations);
            other.is_some_and(|other| other.translation == own.translation)
        };
        if let Some(seed) = nearest.iter().find(is_own) {
            self.groups[seed.group].weights[seed.number] = 0.0;
        }
    }

    /// Whether a seed was not taken.
    pub(crate) fn has(&self, seed: &Seed) -> bool {
        self.groups[seed.group].weights[seed.number] > 0.0
    }

    /// A seed as a hypothesis with its estimated mass.
    pub(crate) fn hypothesis(
        &self,
        seed: &Seed,
        rotations: &[UnitQuaternion<f64>],
    ) -> Option<TranslationHypothesis> {
        let first = ContactPercepts::new(self.first.as_ref()?, &[]);
        let group = self.groups.get(seed.group)?;
        let rotation = &rotations[usize::from(group.rotation)];
        Some(TranslationHypothesis {
            evidence: f64::from(seed.weight).ln() + self.log,
            ..group.hypothesis(seed.number, rotation, &first)
        })
    }

    /// Models whose seeds all have a mass below e^`least_log`.
    pub(crate) fn exhausted(&self, least_log: f64) -> Vec<VariantId> {
        let least = to_f32((least_log - self.log).exp());
        let own = self.groups.chunk_by(|a, b| a.of == b.of);
        let exhausted = own.filter(|own| own.iter().all(|group| group.most < least));
        exhausted.map(|own| own[0].of).collect()
    }

    /// Drops seeds whose mass is below e^`least_log`.
    pub(crate) fn drop_below(&mut self, least_log: f64) {
        let least = to_f32((least_log - self.log).exp());
        for group in &mut self.groups {
            group.drop_below(least);
        }
        self.normalise();
    }

    /// Rescales weights to about one, and drops empty groups.
    fn normalise(&mut self) {
        self.groups.retain(|group| group.most > 0.0);
        let most = self.most();
        if most > 0.0 && !(1.0 / RESCALE..=RESCALE).contains(&most) {
            self.log += f64::from(most).ln();
            for group in &mut self.groups {
                group.multiply(1.0 / most);
            }
        }
    }
}
