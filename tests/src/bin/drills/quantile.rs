//! Quantiles of measured times.

use std::time::Duration;

/// The time below which this share of the times is, by rank.
pub(crate) fn quantile(times: &mut [Duration], share: f64) -> Duration {
    times.sort();
    assert!(!times.is_empty(), "nothing was measured");
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of a length"
    )]
    let rank = (times.len() as f64 * share).ceil() as usize;
    times[rank.clamp(1, times.len()) - 1]
}
