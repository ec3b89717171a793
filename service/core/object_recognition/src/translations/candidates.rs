//! Candidates: the places that a touch could be of, given where a hypothesis predicts it.

use nalgebra::{Point3, Vector3};

use crate::index::packed_places::PackedPlaces;
use crate::index::shortlist::Shortlist;
use crate::indexed_model::IndexedModel;
use crate::indexed_place::{Across, IndexedPlace};
use crate::numeric::{exp, to_f32};
use crate::percept_likelihood::{LANES, PerceptLikelihood};
use crate::translations::shared_error::SharedError;
use crate::tuning::CONDITIONED_MIN;

/// A place that could be the one touched.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    /// Density of the touch there \[1/m³\], times (2π)^1.5, as if it were the only place.
    pub(crate) density: f64,
    /// Offset of the place from the predicted point \[m\].
    pub(crate) apart: Vector3<f64>,
    /// Variance of a touch of it, per axis \[m²\].
    pub(crate) variance: f64,
    /// What is across the surface, how far an error of the translation shows in the offset there,
    /// and the variance of a touch there \[m²\]; none where all directions are alike.
    pub(crate) across: Option<(Across, f64, f64)>,
}

impl Candidate {
    /// The translation's error and its variance per axis after the touch, if this is the place, by
    /// the Kalman gain P h/(h² P + R): h is how far an error of the translation shows in the
    /// offset. The variance is the mean over the axes.
    pub(crate) fn update(&self, prior_m2: f64) -> (Vector3<f64>, f64) {
        let gain = |shown: f64, variance_m2: f64| {
            prior_m2 * shown / (shown * shown * prior_m2 + variance_m2)
        };
        let along = gain(1.0, self.variance);
        let Some((across, shown, across_m2)) = &self.across else {
            return (self.apart * along, prior_m2 - along * prior_m2);
        };
        let gained = gain(*shown, *across_m2);
        let offset = across.projection * self.apart;
        let dimensions = f64::from(across.dimensions);
        let told = dimensions * gained * shown + (3.0 - dimensions) * along;
        let moved = offset * gained + (self.apart - offset) * along;
        (moved, prior_m2 - told / 3.0 * prior_m2)
    }
}

/// Buffers of a search, used again for every hypothesis.
#[derive(Debug, Default)]
pub(crate) struct CandidateSearch {
    shortlist: Shortlist,
    /// Densities of the places that the shortlist found last.
    densities: Vec<f64>,
}

impl CandidateSearch {
    /// The searches that follow are elsewhere, or in another model: several beside one another, or
    /// one alone.
    pub(crate) fn begin(&mut self, several: bool) {
        self.shortlist.begin(several);
    }

    /// Finds the places that a touch predicted at `point`, with this variance per axis \[m²\],
    /// could be of, and returns the sum of their densities. Before the first search in another
    /// model, [`begin`](Self::begin) must come.
    pub(crate) fn find(
        &mut self,
        packed: &PackedPlaces,
        point: &Point3<f64>,
        variance_m2: f64,
        local: &PerceptLikelihood<'_>,
    ) -> f64 {
        self.shortlist.find(packed, point, variance_m2);
        let mut densities = std::mem::take(&mut self.densities);
        densities.clear();
        let [total] = self.weigh([local], |[density]| densities.push(density));
        self.densities = densities;
        total
    }

    /// The place of which a touch predicted at `point` is most likely, if its density there is
    /// `least` or more.
    pub(crate) fn best<'a>(
        &mut self,
        indexed: &'a IndexedModel,
        point: &Point3<f64>,
        variance_m2: f64,
        (local, least): (&PerceptLikelihood<'_>, f64),
    ) -> Option<&'a IndexedPlace> {
        self.find(&indexed.packed, point, variance_m2, local);
        let found = self.shortlist.found().iter().zip(&self.densities);
        let (best, density) = found.max_by(|a, b| a.1.total_cmp(b.1))?;
        let place = || &indexed.places[indexed.packed.place(best.number as usize)];
        (*density >= least).then(place)
    }

    /// Lists those that were found in a model of which some were predicted, after an earlier
    /// contact if it told of the model's errors, and returns the sum of their densities. The
    /// variances per axis \[m²\] are those of the translation and of the touch's noise.
    pub(crate) fn conditioned(
        &self,
        indexed: &IndexedModel,
        error: Option<&SharedError>,
        [translation_m2, noise_m2]: [f64; 2],
        candidates: &mut Vec<Candidate>,
    ) -> f64 {
        candidates.clear();
        let least = CONDITIONED_MIN * self.densities.iter().copied().fold(0.0, f64::max);
        let found = self.shortlist.found().iter().zip(&self.densities);
        for (near, density) in found.filter(|(_, density)| **density >= least) {
            let place = &indexed.places[indexed.packed.place(near.number as usize)];
            let own = error.map_or_else(
                || SharedError::unknown(place),
                |error| error.condition(place),
            );
            let apart: Vector3<f64> = self.shortlist.apart(near).cast() + own.offset;
            let mut candidate = Candidate {
                density: density * own.level_ratio,
                apart,
                variance: noise_m2 + own.variance_m2,
                across: None,
            };
            if let Some(prediction) = &place.prediction {
                let own_across_m2 = noise_m2 + own.across_m2;
                candidate.across = Some((prediction.across, own.shown, own_across_m2));
                let across = prediction.across.projection * apart;
                let dimensions = prediction.across.dimensions;
                let along_m2 = candidate.variance + translation_m2;
                let across_m2 = own_across_m2 + own.shown * own.shown * translation_m2;
                let before_m2 = f64::from(near.variance);
                let fall = f64::from(near.square) / before_m2
                    - across.norm_squared() / across_m2
                    - (apart - across).norm_squared() / along_m2;
                let width = (before_m2 / across_m2).sqrt().powi(dimensions)
                    * (before_m2 / along_m2).sqrt().powi(3 - dimensions);
                candidate.density *= f64::from(exp(to_f32(0.5 * fall))) * width;
            }
            candidates.push(candidate);
        }
        candidates.iter().map(|own| own.density).sum()
    }

    /// Lists those that were found with a density of `least` at least. `noise_m2` is the variance
    /// of the touch, per axis \[m²\].
    pub(crate) fn candidates(
        &self,
        packed: &PackedPlaces,
        (least, noise_m2): (f64, f64),
        candidates: &mut Vec<Candidate>,
    ) {
        debug_assert_eq!(self.shortlist.found().len(), self.densities.len());
        candidates.clear();
        for (near, density) in self.shortlist.found().iter().zip(&self.densities) {
            if *density >= least {
                let own = &packed.all[near.number as usize];
                candidates.push(Candidate {
                    density: *density,
                    apart: self.shortlist.apart(near).cast(),
                    variance: noise_m2 + f64::from(own.variance_m2),
                    across: None,
                });
            }
        }
    }

    /// Sums of the densities of a touch that should be at `point`, with this variance per axis
    /// \[m²\], for each of several percepts.
    pub(crate) fn densities<const N: usize>(
        &mut self,
        packed: &PackedPlaces,
        point: &Point3<f64>,
        variance_m2: f64,
        locals: [&PerceptLikelihood<'_>; N],
    ) -> [f64; N] {
        self.shortlist.begin(false);
        self.shortlist.find(packed, point, variance_m2);
        self.weigh(locals, |_| ())
    }

    /// Visits the densities of the places that were found for each of the percepts, and sums these
    /// up.
    fn weigh<const N: usize>(
        &self,
        locals: [&PerceptLikelihood<'_>; N],
        mut visit: impl FnMut([f64; N]),
    ) -> [f64; N] {
        let all = self.shortlist.found();
        simd::dispatch(
            #[inline(always)]
            || {
                let mut totals = [0.0; N];
                for some in all.chunks(LANES) {
                    // Results of the unused lanes are dropped.
                    let (mut numbers, mut squares, mut variances) =
                        ([some[0].number; LANES], [0.0; LANES], [1.0; LANES]);
                    for (k, near) in some.iter().enumerate() {
                        numbers[k] = near.number;
                        squares[k] = near.square;
                        variances[k] = near.variance;
                    }
                    let mut falls = [0.0_f32; LANES];
                    for ((fall, square), variance) in falls.iter_mut().zip(&squares).zip(&variances)
                    {
                        let per = 1.0 / variance;
                        *fall = exp(-0.5 * square * per) * per * per.sqrt();
                    }
                    let mut likelihoods = [[0.0; LANES]; N];
                    for (own, local) in likelihoods.iter_mut().zip(locals) {
                        *own = local.likelihoods_of(&numbers, some.len());
                    }
                    for (k, fall) in falls.iter().enumerate().take(some.len()) {
                        let mut densities = [0.0; N];
                        for ((density, total), own) in
                            densities.iter_mut().zip(&mut totals).zip(&likelihoods)
                        {
                            *density = f64::from(*fall) * f64::from(own[k]);
                            *total += *density;
                        }
                        visit(densities);
                    }
                }
                totals
            },
        )
    }
}
