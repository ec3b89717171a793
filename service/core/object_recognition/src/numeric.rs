//! Small numeric functions of the inner loops.

use nalgebra::Vector3;

/// Rounded to single precision.
#[inline]
pub(crate) fn to_f32(x: f64) -> f32 {
    #[expect(clippy::cast_possible_truncation, reason = "meant")]
    let rounded = x as f32;
    rounded
}

/// The whole number below; 0 for negative numbers and NaN.
#[inline]
pub(crate) fn floor_u32(x: f64) -> u32 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "rounds down, and saturates"
    )]
    let floor = x as u32;
    floor
}

/// eˣ to six digits without branches, so that loops over it are vectorised: 2ⁿ by its exponent's
/// bits, times the Taylor series of 2ᶠ, f from −½ to ½.
#[inline(always)]
pub(crate) fn exp(x: f32) -> f32 {
    /// 1.5 · 2²³: adding it leaves the nearest whole number in the low bits.
    const WHOLE: f32 = 12_582_912.0;
    let x = if x > -87.0 { x } else { -87.0 };
    let x = if x < 87.0 { x } else { 87.0 };
    let turns = x * std::f32::consts::LOG2_E;
    let shifted = turns + WHOLE;
    let f = turns - (shifted - WHOLE);
    let series = 1.0
        + f * (std::f32::consts::LN_2
            + f * (0.240_226_5
                + f * (0.055_504_11
                    + f * (0.009_618_129 + f * (0.001_333_356 + f * 0.000_154_035)))));
    series * f32::from_bits((shifted.to_bits() << 23).wrapping_add(0x3F80_0000))
}

/// The least and the largest coordinates of some points; zeros without any.
pub(crate) fn bounds(points: impl Iterator<Item = Vector3<f64>>) -> (Vector3<f64>, Vector3<f64>) {
    points
        .map(|point| (point, point))
        .reduce(|(low, high), (point, _)| (low.inf(&point), high.sup(&point)))
        .unwrap_or_default()
}

/// The mean of some points; zero without any.
pub(crate) fn centroid(points: impl ExactSizeIterator<Item = Vector3<f64>>) -> Vector3<f64> {
    let count = points.len().max(1) as f64;
    points.sum::<Vector3<f64>>() / count
}

/// log Σ exp, without overflow.
pub(crate) fn log_sum(logs: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = logs.clone().fold(f64::NEG_INFINITY, f64::max);
    if most == f64::NEG_INFINITY {
        return most;
    }
    most + logs.map(|log| (log - most).exp()).sum::<f64>().ln()
}

/// The upper median; zero of no values.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_right_to_six_digits() {
        for k in -8600_i16..=8600 {
            let x = f32::from(k) * 0.01;
            let apart = f64::from(exp(x)) / f64::from(x).exp() - 1.0;
            // The argument itself is rounded.
            assert!(
                apart.abs() < 4e-6 + 1e-7 * f64::from(x.abs()),
                "{x}: {apart}"
            );
        }
        assert!(exp(-1e30) < 1e-37 && exp(1e30).is_finite() && exp(f32::NAN) < 1e-37);
    }
}
