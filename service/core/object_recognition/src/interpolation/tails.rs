//! Errors of which a few are far larger than the rest.

use super::tuning::TAILS;

/// Weight of an error in a fit, by its square per variance: that of Student's distribution.
pub(super) fn weight(square: f64) -> f64 {
    (TAILS + 1.0) / (TAILS + square)
}

/// Profile log-likelihood of errors, on average, and the variance at which it is the largest, which
/// is at least `least`.
///
/// Of each error are given its square, its variance per that of all, of which the square is freed,
/// and from how many sides it was chosen. Errors follow Student's distribution: those at edges say
/// little of all others.
pub(super) fn profile(errors: &[(f64, f64, f64)], least: f64) -> (f64, f64) {
    let count = errors.len().max(1) as f64;
    let mean = |of: &dyn Fn(f64) -> f64| errors.iter().map(|own| of(own.0)).sum::<f64>() / count;
    let mut variance = f64::max(mean(&|square| square), least);
    for _ in 0..8 {
        let weighted = |square: f64| square * weight(square / variance);
        variance = f64::max(mean(&weighted), least);
    }
    let log = |(square, own, sides): &(f64, f64, f64)| {
        let tail = 0.5 * (TAILS + 1.0) * (square / (TAILS * variance)).ln_1p();
        -0.5 * (variance * own).ln() - tail - sides.ln()
    };
    (errors.iter().map(log).sum::<f64>() / count, variance)
}
