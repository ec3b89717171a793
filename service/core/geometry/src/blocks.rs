//! Matrices of blocks of 3×3.

use nalgebra::{Matrix3, Matrix3x6, Matrix6, Vector3};

/// The 6×6 matrix of these blocks.
///
/// ```text
/// | a  b |
/// | c  d |
/// ```
#[inline]
pub fn from_blocks(
    a: &Matrix3<f64>,
    b: &Matrix3<f64>,
    c: &Matrix3<f64>,
    d: &Matrix3<f64>,
) -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(a);
    matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(b);
    matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(c);
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(d);
    matrix
}

/// The 3×6 matrix | a  b |.
#[inline]
pub fn beside(a: &Matrix3<f64>, b: &Matrix3<f64>) -> Matrix3x6<f64> {
    let mut matrix = Matrix3x6::zeros();
    matrix.fixed_columns_mut::<3>(0).copy_from(a);
    matrix.fixed_columns_mut::<3>(3).copy_from(b);
    matrix
}

/// Jacobian of a point q = T⁻¹ p of the map, as seen from a pose, with respect to the error on the
/// right of that pose T = T̂ exp(ξ): | −I  q× |. `seen` is q \[m\].
#[inline]
pub fn seen_by_pose(seen: &Vector3<f64>) -> Matrix3x6<f64> {
    beside(&-Matrix3::identity(), &seen.cross_matrix())
}

/// Jacobian of a point T y with respect to the error on the right of the pose T = T̂ exp(ξ), with
/// its `rotation` R: R | I  −y× |. `point` is y \[m\].
#[inline]
pub fn carried_by_pose(rotation: &Matrix3<f64>, point: &Vector3<f64>) -> Matrix3x6<f64> {
    beside(rotation, &-(rotation * point.cross_matrix()))
}
