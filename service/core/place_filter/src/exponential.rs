//! Exponentials in loops over many numbers.

/// Numbers below it count as it: no covariance of points so far apart matters, and products of two
/// such exponentials, each times a field's variance, are still normal numbers.
const LEAST: f64 = -300.0;

/// eˣ of a number that is not positive, but for two units in the last place: 2ⁿ by its exponent's
/// bits, times the Taylor series of eʳ, |r| ≤ ½ ln 2. Without branches, so that loops over it are
/// vectorised, and of the same bits on any machine. What is not a number stays so.
#[inline(always)]
pub(crate) fn exp(x: f64) -> f64 {
    /// 1.5 · 2⁵²: adding it leaves the nearest whole number in the low bits.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    /// ln 2, the first part short enough that its products with n are exact.
    const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
    /// 1/k!.
    const SERIES: [f64; 14] = [
        1.0,
        1.0,
        1.0 / 2.0,
        1.0 / 6.0,
        1.0 / 24.0,
        1.0 / 120.0,
        1.0 / 720.0,
        1.0 / 5_040.0,
        1.0 / 40_320.0,
        1.0 / 362_880.0,
        1.0 / 3_628_800.0,
        1.0 / 39_916_800.0,
        1.0 / 479_001_600.0,
        1.0 / 6_227_020_800.0,
    ];
    debug_assert!(x.is_nan() || x <= 0.0, "{x} is positive");
    // Not `max`, which would make a number of what is none.
    let x = if x < LEAST { LEAST } else { x };
    let shifted = x * std::f64::consts::LOG2_E + WHOLE;
    let n = shifted - WHOLE;
    let r = (x - n * LN_2[0]) - n * LN_2[1];
    let r2 = r * r;
    let r4 = r2 * r2;
    // By Estrin's scheme: shorter chains than Horner's.
    let two = |k: usize| SERIES[k] + SERIES[k + 1] * r;
    let four = |k: usize| two(k) + two(k + 2) * r2;
    let series = (four(0) + four(4) * r4) + (four(8) + two(12) * r4) * (r4 * r4);
    series * f64::from_bits((shifted.to_bits() << 52).wrapping_add(1.0_f64.to_bits()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_right_to_two_units_in_the_last_place() {
        for k in 0..300_000_i32 {
            let x = -1e-3 * f64::from(k);
            let apart = exp(x) / x.exp() - 1.0;
            assert!(apart.abs() <= 2.0 * f64::EPSILON, "{x}: {apart}");
        }
        assert_eq!(exp(0.0).to_bits(), 1.0_f64.to_bits());
        assert!(exp(-1e300) < 1e-130 && exp(f64::NEG_INFINITY) > 0.0);
        assert!(exp(f64::NAN).is_nan());
        // Products of two covariances of a field of small numbers.
        let least = 1e-12 * exp(f64::NEG_INFINITY);
        assert!((least * least).is_normal());
    }
}
