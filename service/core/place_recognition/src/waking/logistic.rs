//! Logistic regression, one sample after the other.

use nalgebra::{SMatrix, SVector};
use state::state_of_struct;

use crate::tuning::waking as tuning;

/// Weights of a logistic regression, learned by Newton steps of fading memory.
#[derive(Clone, Debug)]
pub(super) struct Logistic<const N: usize> {
    weights: SVector<f64, N>,
    information: SMatrix<f64, N, N>,
}

impl<const N: usize> Logistic<N> {
    pub(super) fn new(weights: [f64; N]) -> Self {
        Self {
            weights: weights.into(),
            information: SMatrix::identity() * tuning::PRIOR,
        }
    }

    /// Log odds \[nats\].
    pub(super) fn log_odds(&self, features: &[f64; N]) -> f64 {
        self.weights.dot(&SVector::from(*features))
    }

    /// Learns that features went with an outcome; `weight` says how much it counts.
    pub(super) fn learn(&mut self, features: &[f64; N], is_so: bool, weight: f64) {
        let features = SVector::from(*features);
        let odds = self.weights.dot(&features);
        let probability = 1.0 / (1.0 + (-odds).exp());
        let off = f64::from(u8::from(is_so)) - probability;
        let variance = (probability * (1.0 - probability)).max(tuning::VARIANCE_MIN);
        self.step(
            &(features * (weight * off)),
            &(features * features.transpose() * (weight * variance)),
        );
    }

    /// A Newton step by a gradient and its information.
    fn step(&mut self, gradient: &SVector<f64, N>, information: &SMatrix<f64, N, N>) {
        newton(
            &mut self.weights,
            &mut self.information,
            gradient,
            information,
        );
    }
}

/// A Newton step of weights with fading information.
pub(super) fn newton<const N: usize>(
    weights: &mut SVector<f64, N>,
    known: &mut SMatrix<f64, N, N>,
    gradient: &SVector<f64, N>,
    information: &SMatrix<f64, N, N>,
) {
    *known = *known * tuning::KEPT
        + information
        + SMatrix::identity() * (tuning::PRIOR * (1.0 - tuning::KEPT));
    if let Some(step) = solve(known, gradient) {
        *weights += step;
    }
}

/// Solves A x = b of a positive definite matrix (Cholesky); `None` where it is none.
fn solve<const N: usize>(
    matrix: &SMatrix<f64, N, N>,
    right: &SVector<f64, N>,
) -> Option<SVector<f64, N>> {
    let mut lower = SMatrix::<f64, N, N>::zeros();
    let mut found = *right;
    for row in 0..N {
        for column in 0..=row {
            let known: f64 = (0..column)
                .map(|k| lower[(row, k)] * lower[(column, k)])
                .sum();
            let rest = matrix[(row, column)] - known;
            lower[(row, column)] = if row == column {
                if rest <= 0.0 {
                    return None;
                }
                rest.sqrt()
            } else {
                rest / lower[(column, column)]
            };
        }
        let known: f64 = (0..row).map(|k| lower[(row, k)] * found[k]).sum();
        found[row] = (found[row] - known) / lower[(row, row)];
    }
    for row in (0..N).rev() {
        let known: f64 = (row + 1..N).map(|k| lower[(k, row)] * found[k]).sum();
        found[row] = (found[row] - known) / lower[(row, row)];
    }
    Some(found)
}

state_of_struct!(Logistic<3> { weights, information });
state_of_struct!(Logistic<4> { weights, information });
state_of_struct!(Logistic<5> { weights, information });
