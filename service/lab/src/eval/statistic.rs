//! One measure over all runs.

use serde::Serialize;

/// Mean, median and largest of the values of several runs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Statistic {
    /// The mean.
    pub mean: f64,
    /// The middle value; of an even number of values, the mean of the two in the middle.
    pub median: f64,
    /// The largest value.
    pub max: f64,
}

impl Statistic {
    /// Of values in any order; `None` when there is none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = values.into_iter().collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let max = *sorted.last()?;
        Some(Self {
            mean: sorted.iter().sum::<f64>() / sorted.len() as f64,
            median: quantile(&sorted, 0.5),
            max,
        })
    }
}

/// The value below which the share `q` of sorted values lies, linear between neighbours (Hyndman &
/// Fan 1996, type 7). NaN when there is none.
pub(super) fn quantile(sorted: &[f64], q: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else {
        return f64::NAN;
    };
    let rank = q * last as f64;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of a length is an index"
    )]
    let below = rank.floor() as usize;
    let above = (below + 1).min(last);
    sorted[below] + (rank - below as f64) * (sorted[above] - sorted[below])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_of_known_values() {
        let odd = Statistic::of([5.0, -1.0, 2.0]).unwrap();
        assert_eq!((odd.mean, odd.median, odd.max), (2.0, 2.0, 5.0));
        let even = Statistic::of([4.0, 1.0, 2.0, 9.0]).unwrap();
        assert_eq!((even.mean, even.median, even.max), (4.0, 3.0, 9.0));
        assert_eq!(Statistic::of([]), None);
        let negative = Statistic::of([-2.0]).unwrap();
        assert_eq!(
            (negative.mean, negative.median, negative.max),
            (-2.0, -2.0, -2.0)
        );
    }

    #[test]
    fn quantiles_are_linear_between_ranks() {
        let values = [0.0, 10.0, 20.0, 30.0];
        for (q, expected) in [
            (0.0, 0.0),
            (0.1, 3.0),
            (0.5, 15.0),
            (0.9, 27.0),
            (1.0, 30.0),
        ] {
            assert!((quantile(&values, q) - expected).abs() < 1e-12);
        }
        assert!(quantile(&[], 0.5).is_nan());
    }
}
