//! The group SE(3) of rigid motions: exponential, logarithm, adjoint.
//!
//! A twist is ξ = (ρ, φ): translation part ρ \[m\], then rotation part φ \[rad\] (axis times
//! angle). With θ = |φ| and × the cross product (Solà, Deray & Atchuthan 2018, Eqs. 172–174):
//!
//! ```text
//! exp(ρ, φ) = (V ρ, exp φ)      V   = I + b φ× + c φ×φ×    b = (1 − cos θ)/θ²   c = (θ − sin θ)/θ³
//! log(t, R) = (V⁻¹ t, log R)    V⁻¹ = I − ½ φ× + d φ×φ×    d = (1 − (θ/2) cot(θ/2))/θ²
//! ```
//!
//! Below half a radian the coefficients come from power series, because the closed forms
//! lose digits to cancellation there; at the seam both agree to about 1e-14 of their value.

use nalgebra::{
    Isometry3, Matrix3, Matrix6, Quaternion, Translation3, UnitQuaternion, Vector3, Vector6,
};

use super::blocks::from_blocks;

/// Angle below which the coefficients come from power series \[rad\].
pub(super) const SERIES_BELOW_RAD: f64 = 0.5;

/// The screw motion that the twist (`linear` = ρ \[m\], `angular` = φ \[rad\]) traces in unit time.
///
/// Exact for every finite twist, including turns of more than π.
pub fn exp(linear: &Vector3<f64>, angular: &Vector3<f64>) -> Isometry3<f64> {
    let angle_squared = angular.norm_squared();
    let half = 0.5 * angle_squared.sqrt();
    let (sin_half, cos_half) = half.sin_cos();
    // sin(θ/2)/θ is smooth and free of cancellation; only its limit needs the series.
    let sin_over_angle = if half < 1e-4 {
        0.5 - angle_squared / 48.0
    } else {
        sin_half / (2.0 * half)
    };
    let quaternion = Quaternion::from_parts(cos_half, angular * sin_over_angle);
    let b = 2.0 * sin_over_angle * sin_over_angle;
    let c = if angle_squared < SERIES_BELOW_RAD * SERIES_BELOW_RAD {
        polynomial(angle_squared, &THETA_MINUS_SIN)
    } else {
        (1.0 - 2.0 * sin_over_angle * cos_half) / angle_squared
    };
    let turned = angular.cross(linear);
    let translation = linear + turned * b + angular.cross(&turned) * c;
    Isometry3::from_parts(
        Translation3::from(translation),
        UnitQuaternion::new_normalize(quaternion),
    )
}

/// The twist (ρ \[m\], φ \[rad\]) with |φ| ≤ π whose [`exp`] is `motion`.
///
/// At exactly half a turn both signs of φ are right; the one of the stored quaternion is given.
pub fn log(motion: &Isometry3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let quaternion = motion.rotation.quaternion();
    // A quaternion and its negative are one rotation; that with w ≥ 0 is the short way round.
    let sign = if quaternion.w < 0.0 { -1.0 } else { 1.0 };
    let cos_half = quaternion.w * sign;
    let imaginary = quaternion.imag() * sign;
    let sin_half_squared = imaginary.norm_squared();
    let sin_half = sin_half_squared.sqrt();
    let half = sin_half.atan2(cos_half);
    let angle_over_sin = if sin_half_squared < 1e-30 {
        2.0 / cos_half
    } else {
        2.0 * half / sin_half
    };
    let angular = imaginary * angle_over_sin;
    let angle_squared = 4.0 * half * half;
    let d = if angle_squared < SERIES_BELOW_RAD * SERIES_BELOW_RAD {
        polynomial(angle_squared, &HALF_ANGLE_COTANGENT)
    } else {
        (1.0 - half * cos_half / sin_half) / angle_squared
    };
    let translation = &motion.translation.vector;
    let turned = angular.cross(translation);
    (
        translation - turned * 0.5 + angular.cross(&turned) * d,
        angular,
    )
}

/// The twist of [`log`] as one vector ξ = (ρ, φ) \[m, rad\].
#[inline]
pub fn twist(motion: &Isometry3<f64>) -> Vector6<f64> {
    let (linear, angular) = log(motion);
    join(&linear, &angular)
}

/// The twist with this translation part ρ \[m\] and rotation part φ \[rad\].
#[inline]
pub fn join(linear: &Vector3<f64>, angular: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(
        linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
    )
}

/// Translation part ρ \[m\] and rotation part φ \[rad\] of a twist.
#[inline]
pub fn split(twist: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (
        twist.fixed_rows::<3>(0).into_owned(),
        twist.fixed_rows::<3>(3).into_owned(),
    )
}

/// T ⊕ ξ = T exp(ξ): a pose after a perturbation on its right. The rotation is normalised again,
/// because products of unit quaternions drift away from length one.
#[must_use]
#[inline]
pub fn plus(pose: &Isometry3<f64>, twist: &Vector6<f64>) -> Isometry3<f64> {
    let (linear, angular) = split(twist);
    let mut moved = pose * exp(&linear, &angular);
    moved.rotation.renormalize_fast();
    moved
}

/// Ad(T), 6×6, order translation, rotation: `T exp(ξ) T⁻¹ = exp(Ad(T) ξ)`.
///
/// ```text
/// Ad(t, R) = | R  t×R |
///            | 0  R   |
/// ```
pub fn adjoint(motion: &Isometry3<f64>) -> Matrix6<f64> {
    let rotation: Matrix3<f64> = motion.rotation.to_rotation_matrix().into_inner();
    let lever = motion.translation.vector.cross_matrix() * rotation;
    from_blocks(&rotation, &lever, &Matrix3::zeros(), &rotation)
}

/// Coefficients of (θ − sin θ)/θ³ in powers of θ²: (−1)ᵏ / (2k + 3)!.
pub(super) const THETA_MINUS_SIN: [f64; 7] = [
    1.0 / 6.0,
    -1.0 / 120.0,
    1.0 / 5_040.0,
    -1.0 / 362_880.0,
    1.0 / 39_916_800.0,
    -1.0 / 6_227_020_800.0,
    1.0 / 1_307_674_368_000.0,
];

/// Coefficients of (1 − (θ/2) cot(θ/2))/θ² in powers of θ²: |B₂ₖ| / (2k)!, B the Bernoulli numbers.
pub(super) const HALF_ANGLE_COTANGENT: [f64; 7] = [
    1.0 / 12.0,
    1.0 / 720.0,
    1.0 / 30_240.0,
    1.0 / 1_209_600.0,
    1.0 / 47_900_160.0,
    691.0 / 1_307_674_368_000.0,
    1.0 / 74_724_249_600.0,
];

/// Σ coefficients\[k\] xᵏ.
pub(super) fn polynomial(x: f64, coefficients: &[f64; 7]) -> f64 {
    coefficients
        .iter()
        .rev()
        .fold(0.0, |sum, coefficient| sum * x + coefficient)
}
