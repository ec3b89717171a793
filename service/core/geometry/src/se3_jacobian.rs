//! How the logarithm of a rigid motion changes with the motion.

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::blocks::from_blocks;
use super::se3::{HALF_ANGLE_COTANGENT, SERIES_BELOW_RAD, THETA_MINUS_SIN, polynomial};

/// The 6×6 matrix A, order translation, rotation, with `log(exp(ξ) exp(δ)) = ξ + A δ` to first
/// order in δ, at ξ = (`linear` = ρ \[m\], `angular` = φ \[rad\]), |φ| ≤ π: the inverse of the
/// right Jacobian.
///
/// With ψ = −φ, ϱ = −ρ and θ = |φ| (Barfoot & Furgale 2014, Eqs. 99–102):
///
/// ```text
/// A = | J⁻¹  −J⁻¹ Q J⁻¹ |      J⁻¹ = I − ½ ψ× + d ψ×ψ×
///     | 0     J⁻¹       |
///
/// Q = ½ ϱ× + c (ψ×ϱ× + ϱ×ψ× + ψ×ϱ×ψ×)           c = (θ − sin θ)/θ³
///   + e (ψ×ψ×ϱ× + ϱ×ψ×ψ× − 3 ψ×ϱ×ψ×)           e = (θ² + 2 cos θ − 2)/(2 θ⁴)
///   + f (ψ×ϱ×ψ×ψ× + ψ×ψ×ϱ×ψ×)                  f = (2 θ − 3 sin θ + θ cos θ)/(2 θ⁵)
/// ```
///
/// with d of [`log`](super::se3::log).
pub fn log_jacobian(linear: &Vector3<f64>, angular: &Vector3<f64>) -> Matrix6<f64> {
    let squared = angular.norm_squared();
    let d = if is_small(squared) {
        polynomial(squared, &HALF_ANGLE_COTANGENT)
    } else {
        let angle = squared.sqrt();
        let (sin_half, cos_half) = (0.5 * angle).sin_cos();
        (1.0 - 0.5 * angle * cos_half / sin_half) / squared
    };
    let Coupling { turn, turn_turn, q } = Coupling::new(linear, angular);
    let inverse = Matrix3::identity() - turn * 0.5 + turn_turn * d;
    let corner = -(inverse * q * inverse);
    from_blocks(&inverse, &corner, &Matrix3::zeros(), &inverse)
}

/// The inverse of [`log_jacobian`]: the 6×6 matrix J with `exp(ξ + δ) = exp(ξ) exp(J δ)` to first
/// order in δ, the right Jacobian at ξ. In its words
///
/// ```text
/// | J  Q |      J = I + b ψ× + a ψ×ψ×      a = (θ − sin θ)/θ³      b = (1 − cos θ)/θ²
/// | 0  J |
/// ```
pub fn exp_jacobian(linear: &Vector3<f64>, angular: &Vector3<f64>) -> Matrix6<f64> {
    let squared = angular.norm_squared();
    let (a, b) = if is_small(squared) {
        let b = polynomial(squared, &ONE_MINUS_COS);
        (polynomial(squared, &THETA_MINUS_SIN), b)
    } else {
        let angle = squared.sqrt();
        let (sin, cos) = angle.sin_cos();
        ((angle - sin) / (squared * angle), (1.0 - cos) / squared)
    };
    let Coupling { turn, turn_turn, q } = Coupling::new(linear, angular);
    let right = Matrix3::identity() + turn * b + turn_turn * a;
    from_blocks(&right, &q, &Matrix3::zeros(), &right)
}

/// ψ×, ψ×ψ× and Q, of which both Jacobians are made.
struct Coupling {
    turn: Matrix3<f64>,
    turn_turn: Matrix3<f64>,
    q: Matrix3<f64>,
}

impl Coupling {
    fn new(linear: &Vector3<f64>, angular: &Vector3<f64>) -> Self {
        let squared = angular.norm_squared();
        let (c, e, f);
        if is_small(squared) {
            c = polynomial(squared, &THETA_MINUS_SIN);
            e = polynomial(squared, &COS_REMAINDER);
            f = polynomial(squared, &MIXED_REMAINDER);
        } else {
            let angle = squared.sqrt();
            let (sin, cos) = angle.sin_cos();
            c = (angle - sin) / (squared * angle);
            e = (squared + 2.0 * cos - 2.0) / (2.0 * squared * squared);
            f = (2.0 * angle - 3.0 * sin + angle * cos) / (2.0 * squared * squared * angle);
        }
        let turn = -angular.cross_matrix();
        let shift = -linear.cross_matrix();
        let turn_turn = turn * turn;
        let turn_shift = turn * shift;
        let shift_turn = shift * turn;
        let turn_shift_turn = turn_shift * turn;
        let q = shift * 0.5
            + (turn_shift + shift_turn + turn_shift_turn) * c
            + (turn * turn_shift + shift_turn * turn - turn_shift_turn * 3.0) * e
            + (turn_shift_turn * turn + turn * turn_shift_turn) * f;
        Self { turn, turn_turn, q }
    }
}

/// Whether coefficients of an angle with this square come from series.
fn is_small(squared: f64) -> bool {
    squared < SERIES_BELOW_RAD * SERIES_BELOW_RAD
}

/// Coefficients of (1 − cos θ)/θ² in powers of θ²: (−1)ᵏ / (2k + 2)!.
const ONE_MINUS_COS: [f64; 7] = [
    1.0 / 2.0,
    -1.0 / 24.0,
    1.0 / 720.0,
    -1.0 / 40_320.0,
    1.0 / 3_628_800.0,
    -1.0 / 479_001_600.0,
    1.0 / 87_178_291_200.0,
];

/// Coefficients of (θ² + 2 cos θ − 2)/(2 θ⁴) in powers of θ²: (−1)ᵏ / (2k + 4)!.
const COS_REMAINDER: [f64; 7] = [
    1.0 / 24.0,
    -1.0 / 720.0,
    1.0 / 40_320.0,
    -1.0 / 3_628_800.0,
    1.0 / 479_001_600.0,
    -1.0 / 87_178_291_200.0,
    1.0 / 20_922_789_888_000.0,
];

/// Coefficients of (2 θ − 3 sin θ + θ cos θ)/(2 θ⁵) in powers of θ²: (−1)ᵏ (k + 1) / (2k + 5)!.
const MIXED_REMAINDER: [f64; 7] = [
    1.0 / 120.0,
    -2.0 / 5_040.0,
    3.0 / 362_880.0,
    -4.0 / 39_916_800.0,
    5.0 / 6_227_020_800.0,
    -6.0 / 1_307_674_368_000.0,
    7.0 / 355_687_428_096_000.0,
];
