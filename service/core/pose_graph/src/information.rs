//! Information matrices: inverses of the covariances of measurements.

use nalgebra::{Cholesky, Matrix1, Matrix3, SMatrix};

use geometry::{PoseCovariance, symmetric};

/// A negative eigenvalue down to here, as a share of the trace, is a zero that was rounded.
const ROUNDING: f64 = 1e-9;

/// Why a matrix is no covariance of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidInformation {
    /// An entry is infinite or not a number.
    #[error("an entry is not finite")]
    NotFinite,
    /// Some direction has less than no information.
    #[error("the matrix is not positive semidefinite")]
    Negative,
    /// Some direction of a covariance has no spread, so its inverse does not exist.
    #[error("the covariance has no inverse")]
    Singular,
}

/// Information about N components of a measurement, N×N. Symmetric and positive semidefinite:
/// directions of which nothing was measured have zeros.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Information<const N: usize>(SMatrix<f64, N, N>);

/// Information about a whole relative pose, 6×6, order translation \[1/m²\], rotation \[1/rad²\],
/// of the ξ in T = T̂ exp(ξ).
pub type PoseInformation = Information<6>;

/// Information about a position, 3×3 \[1/m²\].
pub type PositionInformation = Information<3>;

/// Information about a distance \[1/m²\].
pub type RangeInformation = Information<1>;

impl<const N: usize> Information<N> {
    /// From a matrix, of which the lower triangle counts.
    ///
    /// # Errors
    /// It is not finite, or not positive semidefinite.
    pub fn new(matrix: &SMatrix<f64, N, N>) -> Result<Self, InvalidInformation> {
        checked(matrix).map(Self)
    }

    /// The matrix.
    pub fn matrix(&self) -> &SMatrix<f64, N, N> {
        &self.0
    }
}

impl PoseInformation {
    /// The inverse of a covariance.
    ///
    /// # Errors
    /// It is not finite or has no inverse.
    pub fn of_covariance(covariance: &PoseCovariance) -> Result<Self, InvalidInformation> {
        inverse(covariance.matrix()).map(Self)
    }
}

impl PositionInformation {
    /// The inverse of a covariance.
    ///
    /// # Errors
    /// It is not finite or has no inverse.
    pub fn of_covariance(covariance: &Matrix3<f64>) -> Result<Self, InvalidInformation> {
        inverse(covariance).map(Self)
    }
}

impl RangeInformation {
    /// The inverse of a variance \[m²\].
    ///
    /// # Errors
    /// It is not finite or has no inverse.
    pub fn of_variance(variance_m2: f64) -> Result<Self, InvalidInformation> {
        inverse(&Matrix1::new(variance_m2)).map(Self)
    }
}

/// The symmetric matrix with this lower triangle, if it is positive semidefinite up to rounding.
fn checked<const N: usize>(
    matrix: &SMatrix<f64, N, N>,
) -> Result<SMatrix<f64, N, N>, InvalidInformation> {
    let mut symmetric = *matrix;
    symmetric.fill_upper_triangle_with_lower_triangle();
    if !symmetric.iter().all(|entry| entry.is_finite()) {
        return Err(InvalidInformation::NotFinite);
    }
    let margin = ROUNDING * symmetric.trace() + f64::MIN_POSITIVE;
    if Cholesky::new(symmetric + SMatrix::from_diagonal_element(margin)).is_none() {
        return Err(InvalidInformation::Negative);
    }
    Ok(symmetric)
}

/// The inverse of a positive definite matrix.
fn inverse<const N: usize>(
    covariance: &SMatrix<f64, N, N>,
) -> Result<SMatrix<f64, N, N>, InvalidInformation> {
    if !covariance.iter().all(|entry| entry.is_finite()) {
        return Err(InvalidInformation::NotFinite);
    }
    let inverse = Cholesky::new(*covariance)
        .ok_or(InvalidInformation::Singular)?
        .inverse();
    if !inverse.iter().all(|entry| entry.is_finite()) {
        return Err(InvalidInformation::Singular);
    }
    Ok(symmetric(&inverse))
}
