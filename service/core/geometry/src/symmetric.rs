//! Symmetry of matrices.

use nalgebra::SMatrix;

/// Symmetric part of a matrix, ½ (M + Mᵀ): removes the asymmetry that rounding leaves.
#[inline]
pub fn symmetric<const N: usize>(matrix: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    (matrix + matrix.transpose()) * 0.5
}
