//! Errors that contacts share: what is predicted between the places of a model errs alike nearby.

use nalgebra::{Point3, Vector3};

use crate::indexed_model::IndexedModel;
use crate::indexed_place::{Across, IndexedPlace, Prediction};
use crate::level_prior::RatedLevel;
use crate::translations::touch_update::TouchUpdate;
use crate::tuning::{ERROR_REACH, SHARED_DEVIATIONS, SHARED_MIN};

/// What an earlier contact tells of the error of a model's prediction.
///
/// The errors at two points of a gap are Gaussian with standard deviations s and s′ and correlation
/// ρ = exp(−d²/4ℓ²). A contact with noise σ and residual r at the one leaves at the other a mean of
/// s′ g r and a variance of s′² (1 − ρ g s), with g = ρ s/(s² + σ²): the conditional distribution,
/// given the nearest contact alone (Vecchia 1988, Estimation and model identification for
/// continuous spatial processes). An error of the hypothesis' translation is in both residuals, so
/// that it shows by 1 − s′ g only.
#[derive(Clone, Debug)]
pub(crate) struct SharedError {
    position: Told,
    /// The residual across the surface \[m\].
    offset: Vector3<f64>,
    /// What is across the surface there.
    across: Across,
    levels: Vec<SharedLevel>,
}

/// What a residual tells of another.
#[derive(Clone, Copy, Debug)]
struct Told {
    /// Mean of the error per residual and its standard deviation: g.
    gain: f64,
    /// Share of the error's variance that is known: ρ g s.
    known: f64,
}

/// The same of a level.
#[derive(Clone, Copy, Debug)]
struct SharedLevel {
    channel: u16,
    told: Told,
    residual: f64,
    /// The level of the other contact.
    now: RatedLevel,
}

/// A place as it is after an earlier contact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Conditioned {
    /// Offset of the place from where it was predicted \[m\].
    pub(crate) offset: Vector3<f64>,
    /// Variance of a touch of it along the surface, without the touch's noise, per axis \[m²\].
    pub(crate) variance_m2: f64,
    /// The same across the surface \[m²\].
    pub(crate) across_m2: f64,
    /// How far an error of the translation shows across the surface in the offset of a touch.
    pub(crate) shown: f64,
    /// Likelihood of the touch's levels, per that without the earlier contact.
    pub(crate) level_ratio: f64,
}

impl Told {
    fn new(correlation: f64, error_sd: f64, noise: f64) -> Self {
        let gain = correlation * error_sd / (error_sd * error_sd + noise).max(f64::MIN_POSITIVE);
        Self {
            gain,
            known: gain * correlation * error_sd,
        }
    }
}

impl SharedError {
    /// Correlation of the errors at a touch and at the nearest contact before; none where they have
    /// hardly any, and in a model of which nothing was predicted.
    pub(crate) fn correlation(indexed: &IndexedModel, touch: &TouchUpdate<'_>) -> Option<f64> {
        if !indexed.shares_errors() {
            return None;
        }
        let apart = touch.percepts.contact.position_m - touch.nearest.contact.position_m;
        let correlation = indexed.error_correlation(apart.norm_squared(), ERROR_REACH);
        Some(correlation).filter(|own| *own >= SHARED_MIN)
    }

    /// At the nearest contact before a touch, which a hypothesis has at a point of its model, known
    /// to a variance of `variance_m2` per axis, and takes for one with this place. None where the
    /// place was felt, and where the contact is not as the model predicts at all.
    pub(crate) fn new(
        place: &IndexedPlace,
        touch: &TouchUpdate<'_>,
        correlation: f64,
        (point, variance_m2): (&Point3<f64>, f64),
    ) -> Option<Self> {
        let prediction = place.prediction.as_ref()?;
        let (error_m, across) = (prediction.error_m, prediction.across);
        let offset = across.projection * (point - place.position);
        let is_usual = |square: f64, variance: f64| square <= SHARED_DEVIATIONS.powi(2) * variance;
        if !is_usual(offset.norm_squared(), error_m * error_m + variance_m2) {
            return None;
        }
        let levels = touch.level_pairs.iter().filter_map(|pair| {
            let own = place.level(pair.channel)?;
            let (variance, noise) = (own.variance(), pair.earlier.noise);
            let residual = pair.earlier.value - own.mean;
            is_usual(residual * residual, variance + noise).then(|| SharedLevel {
                channel: pair.channel,
                told: Told::new(correlation, variance.sqrt(), noise),
                residual,
                now: pair.now,
            })
        });
        Some(Self {
            position: Told::new(correlation, error_m, touch.nearest_m2),
            offset,
            across,
            levels: levels.collect(),
        })
    }

    /// A place about a touch of which none before tells anything.
    pub(crate) fn unknown(place: &IndexedPlace) -> Conditioned {
        let own = place.prediction.as_ref();
        Conditioned {
            offset: Vector3::zeros(),
            variance_m2: place.variance_m2,
            across_m2: own.map_or(place.variance_m2, Prediction::across_m2),
            shown: 1.0,
            level_ratio: 1.0,
        }
    }

    /// A place about the touch; of one that was felt nothing changes. Errors of the position are
    /// shared as far as both surfaces have the same normal, those of levels round edges too.
    pub(crate) fn condition(&self, place: &IndexedPlace) -> Conditioned {
        let Some(prediction) = &place.prediction else {
            return Self::unknown(place);
        };
        let alike = self.across.common(&prediction.across);
        let gain = alike * self.position.gain * prediction.error_m;
        let known = alike * alike * self.position.known * prediction.error_m * prediction.error_m;
        let ratios = self.levels.iter().filter_map(|own| own.ratio(place));
        Conditioned {
            offset: prediction.across.projection * self.offset * gain,
            variance_m2: place.variance_m2 - known,
            across_m2: prediction.across_m2() - known,
            shown: 1.0 - gain,
            level_ratio: ratios.product(),
        }
    }
}

impl SharedLevel {
    fn ratio(&self, place: &IndexedPlace) -> Option<f64> {
        let own = place.level(self.channel)?;
        let variance = own.variance();
        let mean = own.mean + self.told.gain * variance.sqrt() * self.residual;
        let told = self.now.ratio(mean, variance * (1.0 - self.told.known));
        Some(told / self.now.ratio(own.mean, variance))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Vector2};

    use super::*;

    /// The errors at both contacts and what one tells of the other, by the joint Gaussian of both.
    #[test]
    fn an_earlier_contact_tells_what_the_joint_distribution_says() {
        for (error, noise, correlation, residual) in [
            (4.0, 1.0, 0.9, 1.5),
            (0.25, 4.0, 0.5, -3.0),
            (1e-6, 1e-8, 0.999, 2e-3),
            (9.0, 0.0, 0.3, 5.0),
        ] {
            let told = Told::new(correlation, f64::sqrt(error), noise);
            for other in [0.5, 1.0, 7.0] {
                let other = other * error;
                let across = correlation * f64::sqrt(error * other);
                let joint = Matrix2::new(error + noise, across, across, other);
                let mean = joint[(1, 0)] / joint[(0, 0)] * residual;
                let left = joint.determinant() / joint[(0, 0)];
                let of_mean = told.gain * other.sqrt() * residual;
                assert!((of_mean - mean).abs() <= 1e-9 * mean.abs());
                assert!((other * (1.0 - told.known) - left).abs() <= 1e-9 * other);
            }
        }
    }

    /// An error of the translation is in both residuals: what one contact tells of the next takes
    /// its part of it away. The oracle is the posterior of the translation by both at once.
    #[test]
    fn a_translation_is_not_learned_twice_from_one_error() {
        for other in [0.5, 9.0, 90.0] {
            learned_once([25.0, 9.0, other, 1.0, 0.8]);
        }
    }

    fn learned_once([prior, error, other, noise, correlation]: [f64; 5]) {
        let residuals = Vector2::new(3.0, 4.0);
        let (own, next) = (error + noise, other + noise);
        let common = correlation * f64::sqrt(error * other);
        let information = Matrix2::new(own, common, common, next).try_inverse();
        let information = information.expect("positive definite");
        let seen = Vector2::repeat(1.0);
        let precision = 1.0 / prior + seen.dot(&(information * seen));
        let mean = seen.dot(&(information * residuals)) / precision;

        let step = |[mean, prior]: [f64; 2], residual: f64, shown: f64, variance: f64| {
            let gain = prior * shown / (shown * shown * prior + variance);
            let mean = mean + gain * (residual - shown * mean);
            [mean, prior - gain * shown * prior]
        };
        let first = step([0.0, prior], residuals[0], 1.0, own);
        let told = Told::new(correlation, f64::sqrt(error), noise);
        let gain = told.gain * other.sqrt();
        let left = other * (1.0 - told.known) + noise;
        let both = step(first, residuals[1] - gain * residuals[0], 1.0 - gain, left);
        assert!((both[0] - mean).abs() < 1e-9, "{both:?} {mean}");
        assert!((both[1] - 1.0 / precision).abs() < 1e-9, "{both:?}");
    }

    #[test]
    fn a_place_that_was_felt_keeps_what_it_is() {
        let across = |normal: Vector3<f64>| {
            let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
            let along = { axes.iter() }.filter(|axis| axis.dot(&normal) == 0.0);
            Across::new(along)
        };
        let place = |error_m2: Option<f64>, normal: Vector3<f64>| IndexedPlace {
            position: Point3::origin(),
            normal: None,
            variance_m2: 4e-6,
            prediction: error_m2.map(|error_m2| Prediction {
                error_m: error_m2.sqrt(),
                across: across(normal),
                bend_m2: 1e-6,
            }),
            levels: Vec::new(),
            descriptors: Vec::new(),
        };
        let error = SharedError {
            position: Told::new(1.0, f64::sqrt(3e-6), 1e-6),
            offset: Vector3::z() * 2e-3,
            across: across(Vector3::z()),
            levels: Vec::new(),
        };
        let felt = error.condition(&place(None, Vector3::z()));
        assert_eq!(felt.offset, Vector3::zeros());
        assert_eq!((felt.variance_m2, felt.shown), (4e-6, 1.0));
        let predicted = error.condition(&place(Some(3e-6), Vector3::z()));
        assert!((predicted.offset.z - 1.5e-3).abs() < 1e-12, "{predicted:?}");
        assert!(predicted.variance_m2 < 2e-6 && predicted.shown < 0.3);
        // Round a corner the error is another one.
        let aside = error.condition(&place(Some(3e-6), Vector3::x()));
        assert_eq!(aside.offset, Vector3::zeros());
        assert_eq!((aside.variance_m2, aside.shown), (4e-6, 1.0));
    }
}
