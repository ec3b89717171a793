//! Parts of the noise of turns that is assumed of odometry, of which any may be there.

use super::tuning::{NOISE_PRIOR_SD, RANGE_NOISE_PARTS};

/// Deviation of the logarithm of the factor of the variance of turns, before anything was seen.
const SD: f64 = NOISE_PRIOR_SD[1];

/// How much of the assumed variance of turns is supposed to be there: all, or what is one or two
/// deviations of the factor's logarithm below that.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NoisePart {
    All,
    Less,
    Least,
}

/// What is seen of the logarithm of the factor of the variance of turns, apart from all that was
/// known before: a Gaussian likelihood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct NoiseEvidence {
    pub(super) information: f64,
    /// The product of the information and the mean.
    pub(super) score: f64,
}

impl NoisePart {
    pub(super) const EACH: [Self; RANGE_NOISE_PARTS] = [Self::All, Self::Less, Self::Least];

    /// Deviations below what is assumed.
    fn deviations(self) -> f64 {
        match self {
            Self::All => 0.0,
            Self::Less => 1.0,
            Self::Least => 2.0,
        }
    }

    /// Logarithm of the factor.
    pub(super) fn log_factor(self) -> f64 {
        -SD * self.deviations()
    }

    /// Factor of the assumed variance.
    pub(super) fn factor(self) -> f64 {
        self.log_factor().exp()
    }

    /// Logarithm of the probability before anything was seen: that of a Gaussian, among the parts.
    pub(super) fn log_prior(self) -> f64 {
        let density = |part: Self| (-0.5 * part.deviations().powi(2)).exp();
        (density(self) / Self::EACH.map(density).iter().sum::<f64>()).ln()
    }
}

impl NoiseEvidence {
    /// Of what the parts turned out to weigh. `None` where they tell no more than before.
    ///
    /// Of Gaussians, the likelihood is the posterior over the prior; so are these taken, by their
    /// moments. Between two parts all factors are as probable.
    pub(super) fn of_weights(weights: [f64; RANGE_NOISE_PARTS]) -> Option<Self> {
        let prior = NoisePart::EACH.map(|part| part.log_prior().exp());
        let [(mean, variance), (mean_before, variance_before)] = [weights, prior].map(moments);
        let information = variance.recip() - variance_before.recip();
        let score = mean / variance - mean_before / variance_before;
        (information > 0.0 && score.is_finite()).then_some(Self { information, score })
    }
}

/// Mean and variance of the logarithm of the factor.
fn moments(weights: [f64; RANGE_NOISE_PARTS]) -> (f64, f64) {
    let total: f64 = weights.iter().sum();
    let over = |of: &dyn Fn(f64) -> f64| {
        let parts = NoisePart::EACH.iter().zip(weights);
        let sum: f64 = parts.map(|(part, w)| w * of(part.log_factor())).sum();
        sum / total
    };
    let mean = over(&|log| log);
    let variance = over(&|log| (log - mean).powi(2));
    (mean, variance + SD * SD / 12.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of the logarithm after the evidence, from its prior.
    fn learned(weights: [f64; 3]) -> f64 {
        let evidence = NoiseEvidence::of_weights(weights).unwrap();
        evidence.score / (evidence.information + SD.powi(-2))
    }

    #[test]
    fn weights_as_before_tell_nothing() {
        let weights = NoisePart::EACH.map(|part| part.log_prior().exp());
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let evidence = NoiseEvidence::of_weights(weights);
        assert!(evidence.is_none_or(|evidence| evidence.information < 1e-9));
    }

    #[test]
    fn the_part_that_is_left_is_learned() {
        assert!(learned([1.0, 0.0, 0.0]).abs() < 0.5);
        assert!((learned([0.0, 1.0, 0.0]) + SD).abs() < 0.5);
        assert!((learned([0.0, 0.0, 1.0]) + 2.0 * SD).abs() < 0.5);
    }

    #[test]
    fn parts_that_contradict_one_another_tell_nothing() {
        assert_eq!(NoiseEvidence::of_weights([0.5, 0.0, 0.5]), None);
        assert_eq!(NoiseEvidence::of_weights([0.0, 0.0, 0.0]), None);
    }
}
