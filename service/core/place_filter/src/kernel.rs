//! What is known of a channel's field: how levels at two points go together.

use state::state_of_struct;

use crate::tuning::channel as tuning;

/// A field with noise: values at a distance d have the covariance σ² exp(−d²/2ℓ²), and each level
/// has noise of variance n on top.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kernel {
    /// Mean of all levels, in the channel's unit.
    pub mean: f64,
    /// σ²: variance of the field.
    pub sill: f64,
    /// n: variance of two levels at one point.
    pub nugget: f64,
    /// ℓ \[m\].
    pub length_m: f64,
}

state_of_struct!(Kernel {
    mean,
    sill,
    nugget,
    length_m
});

impl Kernel {
    /// Covariance of the field at two points, by their squared distance \[m²\].
    #[inline]
    pub(crate) fn covariance(&self, squared_m2: f64) -> f64 {
        self.sill * (-0.5 * squared_m2 / (self.length_m * self.length_m)).exp()
    }

    /// Mean square of the field's slope along an axis, per square metre.
    pub(crate) fn squared_slope(&self) -> f64 {
        self.sill / (self.length_m * self.length_m)
    }

    /// Whether the field is more than noise.
    pub(crate) fn tells(&self) -> bool {
        self.sill > tuning::TELLS * self.nugget
    }

    /// Log density of a level of which nothing else is known.
    pub(crate) fn anywhere(&self, value: f64) -> f64 {
        log_density(value - self.mean, self.sill + self.nugget)
    }
}

/// Log density of a residual with a variance, but for ½ ln 2π.
pub(crate) fn log_density(residual: f64, variance: f64) -> f64 {
    -0.5 * (residual * residual / variance + variance.ln())
}
