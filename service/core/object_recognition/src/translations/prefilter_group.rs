//! The seeds of one model in one rotation.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::UnitQuaternion;

use crate::contact::Contact;
use crate::index::nearest_grid::NearestGrid;
use crate::index::packed_places::PackedPlaces;
use crate::indexed_model::IndexedModel;
use crate::numeric::{exp, to_f32};
use crate::percept_likelihood::{ContactPercepts, PerceptLikelihood};
use crate::translations::hypothesis::{Falls, TranslationHypothesis};
use crate::translations::touch_update::{TouchUpdate, share};
use crate::tuning::{GAIN_MAX, LIVE_SEEDS_RATIO};
use crate::variant::VariantId;

/// The places of a model in one rotation, each taken for the one touched first.
#[derive(Clone, Debug)]
pub(crate) struct PrefilterGroup {
    pub(crate) of: VariantId,
    pub(crate) rotation: u16,
    /// The model at the first touch.
    known: Arc<IndexedModel>,
    /// Prior probability of each seed, given the model.
    each: f64,
    /// Mass of each seed, on the prefilter's scale; 0 for promoted and dropped ones.
    pub(crate) weights: Vec<f32>,
    /// Their places, if not all.
    some: Option<Vec<u32>>,
    pub(crate) sum: f64,
    pub(crate) most: f32,
    /// Number of seeds with a mass.
    live: usize,
}

/// Sums, maxima and counts of weights, in eight lanes.
#[derive(Clone, Copy, Default)]
struct Sums {
    all: [f32; 8],
    most: [f32; 8],
    live: [u32; 8],
}

/// Buffers of an update, used again for every group.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    /// Positions of the seeds, axis by axis.
    axes: [Vec<f32>; 3],
    /// Cells of the predicted points, then the nearest place of each.
    cells: Vec<u32>,
    /// Likelihood ratio of the percepts at each place of the model, then 0 for no place.
    likelihoods: Vec<f32>,
    /// The model of these likelihoods, if they are the same in all rotations.
    likelihoods_of: Option<VariantId>,
    /// Squared distance \[m²\] and likelihood ratio of the nearest place.
    squares: Vec<f32>,
    found: Vec<f32>,
}

impl Scratch {
    /// Finds the place nearest to each seed after a step \[m\].
    fn find(
        &mut self,
        packed: &PackedPlaces,
        some: Option<&[u32]>,
        nearest: &NearestGrid,
        step: [f32; 3],
    ) {
        let count = some.map_or(packed.all.len(), <[u32]>::len);
        self.cells.resize(count, 0);
        self.squares.resize(count, 0.0);
        if let Some(some) = some {
            for (list, axis) in self.axes.iter_mut().zip(&packed.axes) {
                list.resize(count, 0.0);
                for (at, packed_place) in list.iter_mut().zip(some) {
                    *at = axis[*packed_place as usize];
                }
            }
        }
        let [x, y, z] = if some.is_some() {
            &self.axes
        } else {
            &packed.axes
        };
        nearest.cells([x, y, z], step, &mut self.cells);
        // A pass of its own: the cells are far apart in memory, and their loads overlap.
        nearest.places(&mut self.cells);
        let last = packed.all.len() - 1;
        let [to_x, to_y, to_z] = packed.axes.each_ref().map(|axis| &axis[..=last]);
        let points = x.iter().zip(y).zip(z).zip(&self.cells);
        for ((((x, y), z), place), square) in points.zip(&mut self.squares) {
            let place = (*place as usize).min(last);
            let apart = [
                x + step[0] - to_x[place],
                y + step[1] - to_y[place],
                z + step[2] - to_z[place],
            ];
            *square = apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2];
        }
    }

    /// Evaluates the percepts at the nearest places.
    fn evaluate(&mut self, packed: &PackedPlaces, of: VariantId, local: &PerceptLikelihood<'_>) {
        let places = packed.all.len();
        self.found.resize(self.cells.len(), 0.0);
        let found = self.found.iter_mut().zip(&self.cells);
        if self.cells.len() * local.sparse() < places {
            for (likelihood, place) in found {
                let place = *place as usize;
                let packed_place = packed.all.get(place);
                *likelihood =
                    packed_place.map_or(0.0, |packed_place| local.likelihood(place, packed_place));
            }
            return;
        }
        if self.likelihoods_of != Some(of) || !local.is_rotation_invariant() {
            local.likelihoods(&mut self.likelihoods);
            // The entry for no place makes the lookup branch-free.
            self.likelihoods.push(0.0);
            self.likelihoods_of = Some(of);
        }
        let likelihoods = &self.likelihoods[..=places];
        for (likelihood, place) in found {
            *likelihood = likelihoods[(*place as usize).min(places)];
        }
    }
}

impl PrefilterGroup {
    /// After the first touch, from its likelihood at each place. One place in `stride` stands for
    /// all.
    pub(crate) fn new(
        (of, rotation): (VariantId, u16),
        known: Arc<IndexedModel>,
        each: f64,
        stride: usize,
        likelihoods: &[f32],
    ) -> Self {
        let scale = to_f32(each);
        let mut group = Self {
            of,
            rotation,
            known,
            each,
            weights: likelihoods
                .iter()
                .map(|likelihood| scale * likelihood)
                .collect(),
            some: None,
            sum: 0.0,
            most: 0.0,
            live: 0,
        };
        if stride > 1 {
            group.keep(|packed_place, _| packed_place.is_multiple_of(stride));
        }
        group.drop_below(0.0);
        group
    }

    /// The model at the first touch.
    pub(crate) fn known(&self) -> &IndexedModel {
        &self.known
    }

    /// Updates the weights with a touch, and writes those of seeds with a place near to
    /// `supported`.
    pub(crate) fn update(
        &mut self,
        first: &Contact,
        rotation: &UnitQuaternion<f64>,
        touch: &TouchUpdate<'_>,
        lists: &mut Scratch,
        supported: &mut [f32],
    ) {
        let contact = touch.percepts.contact;
        let indexed = &*self.known;
        let packed = &indexed.packed;
        let drift = (contact.drift_sd_m.powi(2) - first.drift_sd_m.powi(2)).max(0.0);
        let noise = contact.position_sd_m.powi(2) + packed.variance_m2;
        let variance = first.variance_m2() + packed.variance_m2 + drift + noise;
        let step = rotation * (contact.position_m - first.position_m);
        let step = [to_f32(step.x), to_f32(step.y), to_f32(step.z)];
        if self.weights.is_empty() {
            return;
        }
        lists.find(packed, self.some.as_deref(), packed.nearest(variance), step);
        lists.evaluate(packed, self.of, &touch.percepts.at(indexed, rotation));
        let per = to_f32(-0.5 / variance);
        let area = TAU * variance;
        let peak = share(indexed.places.len()) / (touch.outlier * area * area.sqrt());
        let peak = to_f32(peak);
        let (weights, Scratch { squares, found, .. }) = (&mut self.weights, lists);
        simd::dispatch(
            #[inline(always)]
            || {
                let places = squares.iter().zip(&mut *found);
                for ((weight, supported), (square, likelihood)) in
                    weights.iter_mut().zip(&mut *supported).zip(places)
                {
                    let gain = peak * *likelihood * exp(per * square);
                    let gain = if gain < GAIN_MAX { gain } else { GAIN_MAX };
                    *weight *= 1.0 + gain;
                    *supported = if *likelihood > 0.0 { *weight } else { 0.0 };
                }
            },
        );
        self.weigh(0.0);
    }

    /// A seed as a hypothesis after the first touch.
    pub(crate) fn hypothesis(
        &self,
        seed: usize,
        rotation: &UnitQuaternion<f64>,
        first: &ContactPercepts<'_>,
    ) -> TranslationHypothesis {
        let indexed = &*self.known;
        let packed_place = { self.some.as_ref() }.map_or(seed, |some| some[seed] as usize);
        let place = &indexed.places[indexed.packed.place(packed_place)];
        let contact = first.contact;
        let local = first.at(indexed, rotation);
        let likelihood = local.likelihood(packed_place, &indexed.packed.all[packed_place]);
        TranslationHypothesis {
            object: self.of.object,
            variant: self.of.variant,
            rotation: self.rotation,
            translation: place.position.coords - rotation * contact.position_m.coords,
            variance_m2: contact.variance_m2() + place.variance_m2,
            evidence: (self.each * f64::from(likelihood)).ln(),
            falls: Falls::default(),
        }
    }

    /// Drops seeds whose weight is below `least`.
    pub(crate) fn drop_below(&mut self, least: f32) {
        self.weigh(least);
        if LIVE_SEEDS_RATIO * self.live < self.weights.len() {
            self.keep(|_, weight| weight > 0.0);
        }
    }

    /// Multiplies all weights.
    pub(crate) fn multiply(&mut self, by: f32) {
        self.scale(by, 0.0);
    }

    /// Drops all seeds.
    pub(crate) fn forget(&mut self) {
        self.weights.fill(0.0);
        self.weigh(0.0);
    }

    /// Sums up the weights; those below `least` become 0.
    fn weigh(&mut self, least: f32) {
        self.scale(1.0, least);
    }

    /// Multiplies all weights and sums them up; those below `least` become 0.
    fn scale(&mut self, by: f32, least: f32) {
        let (weights, rest) = self.weights.as_chunks_mut::<8>();
        let mut sums = simd::dispatch(
            #[inline(always)]
            || {
                let mut sums = Sums::default();
                for weights in weights.iter_mut() {
                    sums.add(weights, by, least);
                }
                sums
            },
        );
        sums.add(rest, by, least);
        self.sum = sums.all.iter().copied().map(f64::from).sum();
        self.most = sums.most.iter().copied().fold(0.0, f32::max);
        self.live = sums.live.iter().sum::<u32>() as usize;
    }

    /// Retains seeds by their place and weight.
    fn keep(&mut self, is_kept: impl Fn(usize, f32) -> bool) {
        let own = self.some.take();
        let mut kept = vec![0; self.weights.len()];
        let mut count = 0;
        for seed in 0..self.weights.len() {
            let packed_place = own.as_ref().map_or(seed, |own| own[seed] as usize);
            let weight = self.weights[seed];
            // Branch-free, since the outcome is unpredictable.
            self.weights[count] = weight;
            kept[count] = u32::try_from(packed_place).expect("a model has few places");
            count += usize::from(is_kept(packed_place, weight));
        }
        kept.truncate(count);
        kept.shrink_to_fit();
        self.weights.truncate(count);
        self.some = Some(kept);
    }
}

impl Sums {
    /// Adds up to eight weights, multiplied; those below `least` become 0.
    #[expect(
        clippy::inline_always,
        reason = "inlined into dispatched closures: compiled for their vectors"
    )]
    #[inline(always)]
    fn add(&mut self, weights: &mut [f32], by: f32, least: f32) {
        let sums = { self.all.iter_mut() }
            .zip(&mut self.most)
            .zip(&mut self.live);
        for (weight, ((sum, most), live)) in weights.iter_mut().zip(sums) {
            *weight *= by;
            *weight = if *weight < least { 0.0 } else { *weight };
            *sum += *weight;
            *most = if *weight > *most { *weight } else { *most };
            *live += u32::from(*weight > 0.0);
        }
    }
}
