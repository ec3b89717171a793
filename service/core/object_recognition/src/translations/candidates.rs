//! Candidates: the places that a touch could be of, given where a hypothesis predicts it.

use std::ops::Range;

use nalgebra::{Point3, Vector3};
use pulp::Arch;

use crate::index::packed_places::{PackedPlace, PackedPlaces};
use crate::numeric::{exp, to_f32};
use crate::percept_likelihood::{LANES, PerceptLikelihood};
use crate::tuning::GATE_SQUARED;

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

/// A place near the predicted point.
#[derive(Clone, Copy, Debug, Default)]
struct NearPlace {
    number: u32,
    /// Offset from the predicted point \[m\].
    apart: [f32; 3],
    square: f32,
    /// Variance of that offset, per axis \[m²\].
    variance: f32,
}

/// Buffers of a search, used again for every hypothesis.
#[derive(Debug, Default)]
pub(crate) struct CandidateSearch {
    arch: Arch,
    runs: Vec<Range<u32>>,
    all: Vec<NearPlace>,
}

impl CandidateSearch {
    /// Lists the places that a touch predicted at `point` could be of, and returns the sum of their
    /// densities. `prior` is the variance of the prediction and `noise` that of the touch, per axis
    /// \[m²\].
    pub(crate) fn candidates(
        &mut self,
        packed: &PackedPlaces,
        point: &Point3<f64>,
        (prior, noise): (f64, f64),
        local: &PerceptLikelihood<'_>,
        candidates: &mut Vec<Candidate>,
    ) -> f64 {
        candidates.clear();
        self.weigh(
            packed,
            (point, prior + noise),
            [local],
            |near, [density]| {
                candidates.push(Candidate {
                    density,
                    apart: Vector3::from(near.apart).cast(),
                    variance: noise + f64::from(packed.all[near.number as usize].variance_m2),
                });
            },
        )[0]
    }

    /// Density of a touch that should be at `point`, with this variance per axis \[m²\], for each
    /// of several percepts: as [`candidates`](Self::candidates) has it.
    pub(crate) fn densities<const N: usize>(
        &mut self,
        packed: &PackedPlaces,
        point: &Point3<f64>,
        variance_m2: f64,
        locals: [&PerceptLikelihood<'_>; N],
    ) -> [f64; N] {
        self.weigh(packed, (point, variance_m2), locals, |_, _| ())
    }

    /// Visits the places with their densities for each of the percepts, and sums these up.
    fn weigh<const N: usize>(
        &mut self,
        packed: &PackedPlaces,
        (point, variance_m2): (&Point3<f64>, f64),
        locals: [&PerceptLikelihood<'_>; N],
        mut visit: impl FnMut(&NearPlace, [f64; N]),
    ) -> [f64; N] {
        let count = self.gather(packed, point, variance_m2);
        let all = &self.all[..count];
        self.arch.dispatch(
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
                    let falls: [f32; LANES] = std::array::from_fn(|k| {
                        let per = 1.0 / variances[k];
                        exp(-0.5 * squares[k] * per) * per * per.sqrt()
                    });
                    let likelihoods =
                        locals.map(|local| local.likelihoods_of(&numbers, some.len()));
                    for (k, near) in some.iter().enumerate() {
                        let fall = f64::from(falls[k]);
                        let densities = likelihoods.map(|own| fall * f64::from(own[k]));
                        for (total, density) in totals.iter_mut().zip(densities) {
                            *total += density;
                        }
                        visit(near, densities);
                    }
                }
                totals
            },
        )
    }

    /// Fills `all` with the places within the gate, and returns their number; what follows is
    /// stale.
    fn gather(&mut self, packed: &PackedPlaces, point: &Point3<f64>, variance_m2: f64) -> usize {
        let Self { runs, all, .. } = self;
        packed.runs(point, variance_m2, runs);
        let at: [f32; 3] = (point - packed.middle).map(to_f32).into();
        let variance_m2 = to_f32(variance_m2);
        let wide = &packed.wide;
        let most = { runs.iter() }.map(|run| (run.end - run.start) as usize);
        let most = most.sum::<usize>() + wide.numbers.len();
        if all.len() < most {
            all.resize(most, NearPlace::default());
        }
        let near = |number: u32, packed_place: &PackedPlace| {
            let apart: [f32; 3] = [
                packed_place.at[0] - at[0],
                packed_place.at[1] - at[1],
                packed_place.at[2] - at[2],
            ];
            let square = apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2];
            let variance = variance_m2 + packed_place.variance_m2;
            let near = NearPlace {
                number,
                apart,
                square,
                variance,
            };
            let is_beyond = square > to_f32(GATE_SQUARED) * variance;
            (near, !is_beyond)
        };
        let mut count = 0;
        for run in runs {
            let own = &packed.all[run.start as usize..run.end as usize];
            for (number, packed_place) in run.zip(own) {
                // Branch-free, since the outcome is unpredictable: loads then overlap.
                let is_wide = packed_place.variance_m2 > wide.narrow_max_m2;
                let (near, is_near) = near(number, packed_place);
                all[count] = near;
                count += usize::from(is_near && !is_wide);
            }
        }
        for number in &wide.numbers {
            let (near, is_near) = near(*number, &packed.all[*number as usize]);
            all[count] = near;
            count += usize::from(is_near);
        }
        count
    }
}
