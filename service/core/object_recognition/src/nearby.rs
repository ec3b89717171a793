//! Places that a touch could be of, by where it should be.

use std::ops::Range;

use nalgebra::{Point3, Vector3};
use pulp::Arch;

use super::feeling::{LANES, Local, exp};
use super::spots::{DISTANCE_MAX, Spots, narrow};

/// A place that could be the one touched.
#[derive(Clone, Copy, Debug)]
pub(super) struct Answer {
    /// Density of the touch there \[m⁻³\], times (2π)^1.5 and as if it were the only place.
    pub(super) density: f64,
    /// Where it lies from where the touch should be \[m\].
    pub(super) apart: Vector3<f64>,
    /// Variance of a touch of it, per axis \[m²\].
    pub(super) variance: f64,
}

/// A place near where a touch should be.
#[derive(Clone, Copy, Debug, Default)]
struct Near {
    number: u32,
    /// Where it lies from there \[m\].
    apart: [f32; 3],
    square: f32,
    /// Variance of a touch of it about that, per axis \[m²\].
    variance: f32,
}

/// Lists that are filled again and again.
#[derive(Debug, Default)]
pub(super) struct Nearby {
    arch: Arch,
    runs: Vec<Range<u32>>,
    all: Vec<Near>,
}

impl Nearby {
    /// Lists the places that a touch could be of which should be at `point`, with a variance `prior` of that and `noise` of its own,
    /// per axis \[m²\], and gives the sum of their densities.
    pub(super) fn answers(
        &mut self,
        spots: &Spots,
        point: &Point3<f64>,
        (prior, noise): (f64, f64),
        local: &Local<'_>,
        answers: &mut Vec<Answer>,
    ) -> f64 {
        answers.clear();
        self.weigh(spots, (point, prior + noise), [local], |near, [density]| {
            answers.push(Answer {
                density,
                apart: Vector3::from(near.apart).cast(),
                variance: noise + f64::from(spots.all[near.number as usize].variance_m2),
            });
        })[0]
    }

    /// Density of a touch that should be at `point`, with this variance per axis \[m²\], for each of several percepts: as
    /// [`answers`](Self::answers) has it.
    pub(super) fn densities<const N: usize>(
        &mut self,
        spots: &Spots,
        point: &Point3<f64>,
        variance_m2: f64,
        locals: [&Local<'_>; N],
    ) -> [f64; N] {
        self.weigh(spots, (point, variance_m2), locals, |_, _| ())
    }

    /// Visits the places with the density of the touch there for each of the percepts, and sums these up.
    fn weigh<const N: usize>(
        &mut self,
        spots: &Spots,
        (point, variance_m2): (&Point3<f64>, f64),
        locals: [&Local<'_>; N],
        mut visit: impl FnMut(&Near, [f64; N]),
    ) -> [f64; N] {
        let count = self.look(spots, point, variance_m2);
        let all = &self.all[..count];
        self.arch.dispatch(
            #[inline(always)]
            || {
                let mut totals = [0.0; N];
                for some in all.chunks(LANES) {
                    // Nobody asks for what is too much in the last lanes.
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
                    let felt = locals.map(|local| local.likelihoods_of(&numbers, some.len()));
                    for (k, near) in some.iter().enumerate() {
                        let fall = f64::from(falls[k]);
                        let densities = felt.map(|felt| fall * f64::from(felt[k]));
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

    /// Lists the places, and says how many they are; what comes behind is of before.
    fn look(&mut self, spots: &Spots, point: &Point3<f64>, variance_m2: f64) -> usize {
        let Self { runs, all, .. } = self;
        let reach_m = (DISTANCE_MAX * (variance_m2 + spots.variance_max_m2)).sqrt();
        spots.reaches.runs(point, reach_m, runs);
        let at: [f32; 3] = (point - spots.middle).map(narrow).into();
        let wide = narrow(variance_m2);
        let most = { runs.iter() }.map(|run| (run.end - run.start) as usize);
        let most = most.sum::<usize>();
        if all.len() < most {
            all.resize(most, Near::default());
        }
        let mut count = 0;
        for run in runs {
            let own = &spots.all[run.start as usize..run.end as usize];
            for (number, spot) in run.zip(own) {
                let apart: [f32; 3] = [spot.at[0] - at[0], spot.at[1] - at[1], spot.at[2] - at[2]];
                let square = apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2];
                let variance = wide + spot.variance_m2;
                // Which are within reach is as good as random: without a branch, the next ones come from memory meanwhile.
                all[count] = Near {
                    number,
                    apart,
                    square,
                    variance,
                };
                let is_beyond = square > narrow(DISTANCE_MAX) * variance;
                count += usize::from(!is_beyond);
            }
        }
        count
    }
}
