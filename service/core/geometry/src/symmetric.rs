//! Symmetry of matrices.

use nalgebra::SMatrix;

/// Symmetric part of a matrix, ½ (M + Mᵀ): removes the asymmetry that rounding leaves.
#[inline]
pub fn symmetric<const N: usize>(matrix: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    (matrix + matrix.transpose()) * 0.5
}

/// The symmetric matrix with these entries on and above the diagonal, row by row, in the rows and
/// columns `axes`, and zeros elsewhere.
pub fn from_upper_triangle<const N: usize>(axes: &[usize], entries: &[f64]) -> SMatrix<f64, N, N> {
    let mut matrix = SMatrix::zeros();
    let mut entries = entries.iter();
    for (k, &row) in axes.iter().enumerate() {
        for (&column, entry) in axes[k..].iter().zip(&mut entries) {
            matrix[(row, column)] = *entry;
            matrix[(column, row)] = *entry;
        }
    }
    matrix
}
