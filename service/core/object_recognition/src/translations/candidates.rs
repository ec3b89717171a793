//! Candidates: the places that a touch could be of, given where a hypothesis predicts it.

use nalgebra::{Point3, Vector3};
use pulp::Arch;

use crate::index::packed_places::PackedPlaces;
use crate::index::shortlist::Shortlist;
use crate::numeric::exp;
use crate::percept_likelihood::{LANES, PerceptLikelihood};

/// A place that could be the one touched.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    /// Density of the touch there \[1/m³\], times (2π)^1.5, as if it were the only place.
    pub(crate) density: f64,
    /// Offset of the place from the predicted point \[m\].
    pub(crate) apart: Vector3<f64>,
    /// Variance of a touch of it, per axis \[m²\].
    pub(crate) variance: f64,
}

/// Buffers of a search, used again for every hypothesis.
#[derive(Debug, Default)]
pub(crate) struct CandidateSearch {
    arch: Arch,
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
        visit: impl FnMut([f64; N]),
    ) -> [f64; N] {
        let all = self.shortlist.found();
        self.arch.dispatch(
            #[inline(always)]
            move || {
                // Given away, so that it is inlined: see `Shortlist::choose`.
                let mut visit = visit;
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
