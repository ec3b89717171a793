//! The levels of a channel over an object, as one Gaussian process.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Point3};

use super::tuning::{
    BETWEEN_MIN, FIELD_SAMPLES, PROCESS_LENGTHS, PROCESS_NUGGET, PROCESS_PLACES,
    PROCESS_ROUGH_LENGTHS, PROCESS_ROUGHNESS, PROCESS_ROUGHNESS_MIN,
};
use crate::gaussian_process::{factor, independent, log_density, log_root, matern};
use crate::model::ModelPlace;
use crate::tuning::{JOINT_SDS, LEVEL_ROUNDING, WRONG_PERCEPT_SHARE};

/// The levels of a channel: a smooth process about a mean that is not known, and what is rough
/// besides, as at the borders of patterns.
///
/// With what was learned it predicts the levels of the object; without, those of another one that
/// was never felt. The ratio of both likelihoods of all levels of an episode together is what they
/// tell of the object (Bayes factor; Kass and Raftery 1995).
#[derive(Clone, Debug)]
pub(crate) struct LevelProcess {
    pub(crate) channel: u16,
    /// Where levels were learned.
    positions: Vec<Point3<f64>>,
    /// By how far what is rough is common: places far apart do not tell it, a walk does.
    forms: Vec<LearnedLevels>,
}

/// How levels vary over a surface.
#[derive(Clone, Copy, Debug)]
struct ProcessForm {
    mean: f64,
    variance: f64,
    length_m: f64,
    /// Variance of what is rough, per that of the process.
    roughness: f64,
    /// How far that is common \[m\].
    rough_m: f64,
    /// How far places lie from one another \[m\].
    gap_m: f64,
    /// Variance of the noise of a level, at least.
    noise: f64,
}

/// What was learned, for one form.
#[derive(Clone, Debug)]
struct LearnedLevels {
    form: ProcessForm,
    /// Factor of the covariance of the levels, with that of the mean.
    factor: Cholesky<f64, Dyn>,
    /// Their differences from the mean, by the inverse of it.
    weights: DVector<f64>,
}

/// A level that was read at a point of an object, with the standard deviation of its noise.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedLevel {
    pub(crate) at: Point3<f64>,
    pub(crate) level: f64,
    pub(crate) sd: f64,
}

impl ProcessForm {
    /// Covariance of two levels at a distance \[m\].
    fn covariance(&self, apart_m: f64) -> f64 {
        let rough = self.roughness * (-apart_m / self.rough_m).exp();
        self.variance * (matern(apart_m / self.length_m) + rough)
    }

    /// Covariance of two of these levels, with their noise, about the mean.
    fn of_levels(&self, levels: &[PlacedLevel], row: usize, column: usize) -> f64 {
        let (own, other) = (&levels[row], &levels[column]);
        let noise = if row == column {
            (own.sd * own.sd).max(self.noise)
        } else {
            0.0
        };
        self.covariance((own.at - other.at).norm()) + noise
    }

    /// The largest likelihood of levels at these points, over lengths and roughnesses; mean and
    /// variance follow (Rasmussen and Williams 2006, ch. 5.4 and 2.7).
    fn learned(levels: &[(Point3<f64>, f64)], gap_m: f64) -> Option<Self> {
        let count = levels.len();
        let values = DVector::from_iterator(count, levels.iter().map(|own| own.1));
        let ones = DVector::from_element(count, 1.0);
        let mut best: Option<(f64, Self)> = None;
        for length in PROCESS_LENGTHS {
            for roughness in PROCESS_ROUGHNESS {
                let length_m = length * gap_m;
                let factor = factor(count, |row, column| {
                    let apart_m = (levels[row].0 - levels[column].0).norm();
                    let own = if row == column { roughness } else { 0.0 };
                    matern(apart_m / length_m) + own
                })?;
                let by_ones = factor.solve(&ones);
                let mean = by_ones.dot(&values) / by_ones.dot(&ones);
                let off = values.add_scalar(-mean);
                let least = LEVEL_ROUNDING * (1.0 + mean * mean);
                let variance = (off.dot(&factor.solve(&off)) / count as f64).max(least);
                let log = -0.5 * (count as f64 * variance.ln() + by_ones.dot(&ones).ln())
                    - log_root(&factor);
                if best.as_ref().is_none_or(|(most, _)| log > *most) {
                    let own = Self {
                        mean,
                        variance,
                        length_m,
                        roughness: roughness.max(PROCESS_ROUGHNESS_MIN),
                        rough_m: gap_m,
                        gap_m,
                        noise: PROCESS_NUGGET * variance,
                    };
                    best = Some((log, own));
                }
            }
        }
        best.map(|(_, own)| own)
    }
}

impl LevelProcess {
    /// Of the levels of a channel at places that lie so far from one another \[m\]; none of few.
    pub(crate) fn learned(channel: u16, places: &[ModelPlace], gap_m: f64) -> Option<Self> {
        let level = |place: &ModelPlace| {
            let own = place.levels.iter().find(|own| own.channel == channel)?;
            Some((place.position_m, own.mean, own.variance()))
        };
        let levels = places.iter().filter_map(level);
        let levels: Vec<_> = levels.filter(|own| own.2.is_finite()).collect();
        if levels.len() < BETWEEN_MIN || gap_m <= 0.0 {
            return None;
        }
        let every = |most: usize| levels.len().div_ceil(most).max(1);
        let some = { levels.iter().step_by(every(FIELD_SAMPLES)) }.map(|own| (own.0, own.1));
        let form = ProcessForm::learned(&some.collect::<Vec<_>>(), gap_m)?;
        let kept: Vec<_> = levels.iter().step_by(every(PROCESS_PLACES)).collect();
        let noise = kept.iter().map(|own| own.2).sum::<f64>() / kept.len() as f64;
        let forms = PROCESS_ROUGH_LENGTHS.map(|length| ProcessForm {
            rough_m: length * gap_m,
            noise: form.noise.max(noise),
            ..form
        });
        let forms = forms
            .into_iter()
            .filter_map(|form| LearnedLevels::new(form, &kept));
        Some(Self {
            channel,
            forms: forms.collect(),
            positions: kept.iter().map(|own| own.0).collect(),
        })
    }

    /// By how much these levels are likelier of this object than of one that was never felt, whose
    /// mean has this mean and variance \[nats\].
    ///
    /// Levels many deviations off are misread or have changed, each time over a gap between places,
    /// and tell nothing but that.
    pub(crate) fn log_bayes_factor(
        &self,
        levels: &[PlacedLevel],
        prior: (f64, f64),
    ) -> Option<f64> {
        // The form by which the usual levels are likeliest, whatever they are of.
        let usual: Vec<PlacedLevel> = { levels.iter() }
            .filter(|own| {
                self.forms
                    .first()
                    .is_some_and(|form| form.is_usual(own, prior))
            })
            .copied()
            .collect();
        let logs =
            { self.forms.iter() }.filter_map(|own| Some((own, own.other_log(&usual, prior)?)));
        let best = logs.max_by(|a, b| a.1.total_cmp(&b.1));
        best?.0.log_factor(&self.positions, levels, prior)
    }
}

impl LearnedLevels {
    /// Of levels at places, with the variances of their means.
    fn new(form: ProcessForm, levels: &[&(Point3<f64>, f64, f64)]) -> Option<Self> {
        let factor = factor(levels.len(), |row, column| {
            let apart_m = (levels[row].0 - levels[column].0).norm();
            let noise = if row == column {
                f64::max(levels[row].2, PROCESS_NUGGET * form.variance)
            } else {
                0.0
            };
            form.covariance(apart_m) + form.variance + noise
        })?;
        let off = levels.iter().map(|own| own.1 - form.mean);
        let weights = factor.solve(&DVector::from_iterator(levels.len(), off));
        Some(Self {
            form,
            factor,
            weights,
        })
    }

    /// Whether a level may be one of another object, whose mean has this mean and variance.
    fn is_usual(&self, level: &PlacedLevel, (mean, variance): (f64, f64)) -> bool {
        let variance = self.form.covariance(0.0) + f64::max(variance, self.form.variance);
        (level.level - mean).powi(2) <= JOINT_SDS.powi(2) * (variance + level.sd * level.sd)
    }

    /// Log density of levels of another object, whose mean has this mean and variance.
    fn other_log(&self, levels: &[PlacedLevel], (mean, variance): (f64, f64)) -> Option<f64> {
        let variance = f64::max(variance, self.form.variance);
        let factor = factor(levels.len(), |row, column| {
            self.form.of_levels(levels, row, column) + variance
        })?;
        let off = levels.iter().map(|own| own.level - mean);
        Some(log_density(
            &factor,
            &DVector::from_iterator(levels.len(), off),
        ))
    }

    /// See [`LevelProcess::log_bayes_factor`].
    fn log_factor(
        &self,
        positions: &[Point3<f64>],
        levels: &[PlacedLevel],
        prior: (f64, f64),
    ) -> Option<f64> {
        let form = &self.form;
        let mut told = DMatrix::from_fn(positions.len(), levels.len(), |row, column| {
            let apart_m = (positions[row] - levels[column].at).norm();
            form.covariance(apart_m) + form.variance
        });
        let predicted = told.tr_mul(&self.weights).add_scalar(form.mean);
        { self.factor.l_dirty() }.solve_lower_triangular_mut(&mut told);
        let known = |row: usize, column: usize| {
            let known = told.column(row).dot(&told.column(column));
            form.of_levels(levels, row, column) + form.variance - known
        };
        let off = |number: usize| levels[number].level - predicted[number];
        let is_usual =
            |number: &usize| off(*number).powi(2) <= JOINT_SDS.powi(2) * known(*number, *number);
        let (usual, wrong): (Vec<usize>, Vec<usize>) = (0..levels.len()).partition(is_usual);
        let wrong: Vec<_> = wrong.iter().map(|number| levels[*number].at).collect();
        let wrong = independent(&wrong, form.gap_m) * WRONG_PERCEPT_SHARE.ln();
        let factor = factor(usual.len(), |row, column| known(usual[row], usual[column]))?;
        let off = DVector::from_iterator(usual.len(), usual.iter().map(|own| off(*own)));
        let usual: Vec<PlacedLevel> = usual.iter().map(|own| levels[*own]).collect();
        let other = self.other_log(&usual, prior)?;
        Some(log_density(&factor, &off) - other + wrong)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Contact, ModelSettings, ObjectModel};

    const NOISE: f64 = 0.03;
    const GAP_M: f64 = 0.02;
    /// What another object's levels may be.
    const PRIOR: (f64, f64) = (0.0, 0.5);

    /// A point of a plate, of all that `key` numbers.
    fn point(key: u64) -> Point3<f64> {
        let [x, y] = [0, 1].map(|axis| 0.1 * random::uniform(11, [key, axis, 0]));
        Point3::new(x, y, 0.0)
    }

    /// The level of a plate at a point.
    fn level(plate: u64, at: &Point3<f64>) -> f64 {
        let wave = |k: u64| 100.0 * (random::uniform(12, [plate, k, 0]) - 0.5);
        (wave(0) * at.x + wave(1) * at.y + 6.0 * random::uniform(12, [plate, 2, 0])).sin()
    }

    /// Noisy levels of a plate.
    fn placed(plate: u64, keys: std::ops::Range<u64>) -> Vec<PlacedLevel> {
        let of = |key: u64| {
            let at = point(key);
            // A sum of twelve uniform numbers is normal enough.
            let noise = (0..12).map(|k| random::uniform(13, [key, plate, k]));
            let noise = NOISE * (noise.sum::<f64>() - 6.0);
            PlacedLevel {
                at,
                level: level(plate, &at) + noise,
                sd: NOISE,
            }
        };
        keys.map(of).collect()
    }

    fn learned(plate: u64, contacts: u64) -> LevelProcess {
        let mut model = ObjectModel::new(ModelSettings::default());
        for own in placed(plate, 1000..1000 + contacts) {
            model.learn(&Contact::at(own.at, 0.0005).with_level(0, own.level, own.sd));
        }
        LevelProcess::learned(0, model.places(), GAP_M).expect("it has levels")
    }

    #[test]
    fn levels_tell_the_object_from_others() {
        for plate in 0..8 {
            let process = learned(plate, 30);
            let factor = |of| process.log_bayes_factor(&placed(of, 0..60), PRIOR);
            let own = factor(plate).expect("it is known");
            let other = factor(plate + 100).expect("it is known");
            assert!(own > 5.0, "{plate}: {own}");
            assert!(other < -5.0, "{plate}: {other}");
        }
    }

    #[test]
    fn a_level_that_is_read_again_tells_next_to_nothing_more() {
        let process = learned(0, 30);
        let once = placed(0, 0..8);
        let again: Vec<_> = std::iter::repeat_n(&once, 8).flatten().copied().collect();
        let [once, again] = [once, again].map(|levels| process.log_bayes_factor(&levels, PRIOR));
        let (once, again) = once.zip(again).expect("it is known");
        assert!((again - once).abs() < 2.0, "{once} {again}");
        let nothing = process.log_bayes_factor(&[], PRIOR);
        assert_eq!(nothing, Some(0.0));
    }

    /// The density of new levels after the learned ones is that of all by that of the learned.
    #[test]
    fn factor_is_the_ratio_of_the_densities_of_all_levels() {
        let process = learned(3, 30);
        let levels = placed(3, 0..20);
        let own = &process.forms[0];
        let found = { own.log_factor(&process.positions, &levels, PRIOR) }.expect("it is known");
        let learned = process.positions.len();
        let noise = |row: usize| {
            let learned = own.factor.l().row(row).norm_squared();
            learned - own.form.covariance(0.0) - own.form.variance
        };
        let at = |row: usize| {
            let new = || levels[row - learned].at;
            if row < learned {
                process.positions[row]
            } else {
                new()
            }
        };
        let all = factor(learned + levels.len(), |row, column| {
            let apart_m = (at(row) - at(column)).norm();
            let covariance = own.form.covariance(apart_m) + own.form.variance;
            let own_noise = if row < learned {
                noise(row)
            } else {
                own.form.noise.max(NOISE * NOISE)
            };
            covariance + if row == column { own_noise } else { 0.0 }
        });
        // What was learned, from its weights: K w is the difference from the mean.
        let l = own.factor.l();
        let off = &l * (l.transpose() * &own.weights);
        let new = levels.iter().map(|level| level.level - own.form.mean);
        let together = off.iter().copied().chain(new);
        let together = DVector::from_iterator(learned + levels.len(), together);
        let known =
            log_density(&all.expect("it is positive"), &together) - log_density(&own.factor, &off);
        let other = own.other_log(&levels, PRIOR).expect("it is positive");
        assert!(
            (found - (known - other)).abs() < 1e-6,
            "{found} {}",
            known - other
        );
    }

    #[test]
    fn levels_of_another_kind_count_once_over_a_gap() {
        let process = learned(0, 30);
        let mut levels = placed(0, 0..40);
        let before = process
            .log_bayes_factor(&levels, PRIOR)
            .expect("it is known");
        for own in &mut levels[..10] {
            own.at = point(0);
            own.level = 1e6;
        }
        let after = process
            .log_bayes_factor(&levels, PRIOR)
            .expect("it is known");
        assert!(after > 0.0 && after < before, "{before} {after}");
    }
}
