//! What is known of a channel's field: how levels at two points go together.

use state::state_of_struct;

use crate::exponential::exp;
use crate::linear::{LANES, Row};
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

    /// The same of a point and of as many others as a row has, by their coordinates along each axis
    /// \[m\].
    #[expect(
        clippy::inline_always,
        reason = "compiled for the vectors of a dispatch"
    )]
    #[inline(always)]
    pub(crate) fn covariances(&self, at: &[f64; 3], others: &[Row; 3]) -> Row {
        let factor = -0.5 / (self.length_m * self.length_m);
        let mut row = [0.0; LANES];
        for lane in 0..LANES {
            let by = [0, 1, 2].map(|axis| at[axis] - others[axis][lane]);
            let squared = by[0] * by[0] + by[1] * by[1] + by[2] * by[2];
            row[lane] = self.sill * exp(factor * squared);
        }
        row
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
