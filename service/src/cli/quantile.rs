//! Quantiles of measured times.

/// The value below which the share `q` of the values lies (nearest rank). Sorts the values; NaN
/// when there is none.
pub fn quantile(values: &mut [f64], q: f64) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of a length is an index"
    )]
    let rank = (q * values.len() as f64).ceil() as usize;
    values
        .get(rank.saturating_sub(1))
        .copied()
        .unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::quantile;

    #[test]
    fn nearest_rank() {
        let mut values = [3.0, 1.0, 2.0, 4.0];
        assert_eq!(quantile(&mut values, 0.5).to_bits(), 2.0_f64.to_bits());
        assert_eq!(quantile(&mut values, 0.99).to_bits(), 4.0_f64.to_bits());
        assert_eq!(quantile(&mut values, 0.0).to_bits(), 1.0_f64.to_bits());
        assert!(quantile(&mut [], 0.5).is_nan());
    }
}
