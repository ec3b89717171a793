//! Test statistics as z-scores: standard normal under the hypothesis, lower where it fits worse.

use std::f64::consts::{FRAC_1_PI, TAU};

/// z-score of a chi-squared number: its cube root is about normal (Wilson and Hilferty 1931).
pub(crate) fn from_chi_squared(value: f64, degrees: f64) -> f64 {
    let variance = 2.0 / (9.0 * degrees);
    (1.0 - variance - (value.max(0.0) / degrees).cbrt()) / variance.sqrt()
}

/// Fisher's method: −2 Σ ln Φ(z) over independent z-scores is chi-squared with two degrees of
/// freedom for each. No other score makes up for one that is impossible, and small misfits add up.
pub(crate) fn fisher_combined(deviations: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for deviation in deviations {
        sum -= 2.0 * normal_cdf_log(deviation);
        count += 1.0;
    }
    if count > 0.0 {
        from_chi_squared(sum, 2.0 * count)
    } else {
        0.0
    }
}

/// ln Φ(z) of the standard normal distribution, good to 0.02 (Börjesson and Sundberg 1979, Eq. 13,
/// with the constants that are exact at 0 and in the limit).
fn normal_cdf_log(deviation: f64) -> f64 {
    let t = deviation.abs();
    let log = -0.5 * t * t
        - 0.5 * TAU.ln()
        - ((1.0 - FRAC_1_PI) * t + FRAC_1_PI * (t * t + TAU).sqrt()).ln();
    if deviation < 0.0 {
        log
    } else {
        (-log.exp()).ln_1p()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deviations_are_those_of_tables() {
        // Φ(z), and the 5 % and 0.1 % points of chi-squared (Abramowitz and Stegun, tables 26.1 and
        // 26.8).
        for (z, share) in [
            (0.0, 0.5_f64),
            (-1.0, 0.158_655),
            (1.0, 0.841_345),
            (-2.0, 0.022_750),
            (-5.0, 2.866_5e-7),
            (-20.0, 2.753_6e-89),
        ] {
            let log = normal_cdf_log(z);
            assert!((log - share.ln()).abs() < 0.02, "{z}: {log}");
        }
        for (value, degrees, z) in [
            (12.592, 6.0, -1.644_9),
            (22.458, 6.0, -3.090_2),
            (24.996, 15.0, -1.644_9),
            (37.697, 15.0, -3.090_2),
        ] {
            let found = from_chi_squared(value, degrees);
            assert!((found - z).abs() < 0.03, "{value}: {found}");
        }
        // Of two at the fifth of a hundred, Fisher's sum is 4 × 2.996 with four degrees: 1.7 %.
        let both = fisher_combined([-1.644_9, -1.644_9].into_iter());
        assert!((both + 2.11).abs() < 0.03, "{both}");
    }
}
