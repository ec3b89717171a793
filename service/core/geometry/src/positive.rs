//! Covariances without the negative eigenvalues that rounding leaves.

use nalgebra::SMatrix;

/// Least variance along or about an axis, as a part of those of its three axes: what lies below is
/// rounding.
const AXIS_MIN: f64 = 1e-15;
/// Least pivot of a matrix of correlations.
const PIVOT_MIN: f64 = 1e-14;
/// By how much variances grow at first where rounding has left a covariance without a root, as a
/// part of each.
const GROWTH_MIN: f64 = 1e-12;

/// A covariance of one or two vectors of three components, symmetric, as a positive semidefinite
/// one: unchanged where it is one already; elsewhere all its variances are enlarged, each by the
/// same part of itself, by as little as is needed.
///
/// What is known without error, a row of zeros, stays so. Of a matrix with an entry that is not
/// finite nothing is changed.
pub fn positive<const N: usize>(matrix: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return *matrix;
    }
    let mut positive = *matrix;
    for block in (0..N).step_by(3) {
        let axes = block..(block + 3).min(N);
        let trace: f64 = axes.clone().map(|k| matrix[(k, k)].max(0.0)).sum();
        for k in axes {
            if matrix.row(k).iter().any(|&entry| entry != 0.0) {
                positive[(k, k)] = matrix[(k, k)].max(AXIS_MIN * trace);
            }
            if positive[(k, k)] <= 0.0 {
                positive.row_mut(k).fill(0.0);
                positive.column_mut(k).fill(0.0);
            }
        }
    }
    let sd = positive.diagonal().map(f64::sqrt);
    for row in 0..N {
        for column in (0..N).filter(|&column| column != row) {
            let most = sd[row] * sd[column];
            positive[(row, column)] = positive[(row, column)].clamp(-most, most);
        }
    }
    let mut growth = 0.0;
    while !has_root(&positive, growth) {
        growth = if growth == 0.0 {
            GROWTH_MIN
        } else {
            10.0 * growth
        };
    }
    for k in 0..N {
        positive[(k, k)] *= 1.0 + growth;
    }
    positive
}

/// Whether the matrix of correlations, with a diagonal of 1 + `growth`, has a Cholesky factor.
fn has_root<const N: usize>(covariance: &SMatrix<f64, N, N>, growth: f64) -> bool {
    let scale = covariance.diagonal().map(|variance| {
        if variance > 0.0 {
            variance.sqrt().recip()
        } else {
            0.0
        }
    });
    let mut lower = SMatrix::<f64, N, N>::zeros();
    for row in 0..N {
        for column in 0..=row {
            let own = if row == column {
                1.0 + growth
            } else {
                covariance[(row, column)] * scale[row] * scale[column]
            };
            let rest = (0..column).fold(own, |rest, k| rest - lower[(row, k)] * lower[(column, k)]);
            if row == column {
                if rest < PIVOT_MIN {
                    return false;
                }
                lower[(row, row)] = rest.sqrt();
            } else {
                lower[(row, column)] = rest / lower[(column, column)];
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Matrix6, Vector3};

    #[test]
    fn a_covariance_stays_as_it_is() {
        let matrix = Matrix3::new(2.0, 0.3, 0.0, 0.3, 1e-9, 0.0, 0.0, 0.0, 0.0);
        let own = Matrix3::new(2.0, 1e-6, 0.0, 1e-6, 1e-9, 0.0, 0.0, 0.0, 0.0);
        assert_eq!(positive(&own), own);
        assert_ne!(positive(&matrix), matrix);
    }

    #[test]
    fn what_rounding_has_left_gets_a_root() {
        let axis = Vector3::new(1.0, 0.1, 1e-7);
        let mut matrix = axis * axis.transpose();
        matrix[(2, 2)] = -1e-18;
        let mended = positive(&matrix);
        assert!(mended.symmetric_eigenvalues().min() > -1e-17);
        // The third variance is lost, and with it what its covariances of 1e-7 were.
        assert!((mended - matrix).amax() < 1e-7 * matrix.amax());
        assert!((mended - matrix).fixed_view::<2, 2>(0, 0).amax() < 1e-9);
        let absurd = Matrix6::from_fn(|row, column| if row == column { 1.0 } else { -3.0 });
        assert!(positive(&absurd).symmetric_eigenvalues().min() >= 0.0);
    }
}
