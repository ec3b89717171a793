//! Rotations from a decomposition, and from the numbers of a text.

use nalgebra::{Matrix3, Quaternion, Rotation3, SVD, U3, UnitQuaternion, Vector3};

/// The rotation R that maximises tr(Rᵀ M) (orthogonal Procrustes problem with the determinant held
/// at +1: Umeyama 1991, Eqs. 40-43).
#[expect(
    clippy::missing_panics_doc,
    reason = "the decomposition has the factors that it is asked for"
)]
pub fn procrustes(matrix: &Matrix3<f64>) -> UnitQuaternion<f64> {
    let svd = matrix.svd(true, true);
    rotation_of(&svd).expect("both factors are asked for")
}

/// The rotation about z that maximises tr(Rᵀ M).
pub fn planar_procrustes(matrix: &Matrix3<f64>) -> UnitQuaternion<f64> {
    let sine = matrix[(1, 0)] - matrix[(0, 1)];
    let cosine = matrix[(0, 0)] + matrix[(1, 1)];
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), sine.atan2(cosine))
}

/// The rotation of [`procrustes`] from the decomposition; `None` if that lacks a factor.
pub(super) fn rotation_of(svd: &SVD<f64, U3, U3>) -> Option<UnitQuaternion<f64>> {
    let (u, v_t) = (svd.u?, svd.v_t?);
    // Singular values come sorted, so the last axis is the one which a reflection costs least.
    let sign = (u * v_t).determinant().signum();
    let matrix = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    let rotation = Rotation3::from_matrix_unchecked(matrix);
    Some(UnitQuaternion::from_rotation_matrix(&rotation))
}

/// The rotation of a quaternion x, y, z, w of any length; `None` if it has no direction.
pub fn rotation_from_xyzw([x, y, z, w]: [f64; 4]) -> Option<UnitQuaternion<f64>> {
    let rotation = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), f64::MIN_POSITIVE)?;
    // The norm of very large numbers overflows.
    ((rotation.coords.norm() - 1.0).abs() < 1e-6).then_some(rotation)
}
