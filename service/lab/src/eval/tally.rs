//! Sums over the steps of a run.

/// What has been seen of one quantity; steps without a value do not count.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Tally {
    count: u64,
    sum: f64,
    sum_of_squares: f64,
    max: f64,
    last: f64,
}

impl Tally {
    /// Takes in the value of a step.
    pub(super) fn add(&mut self, value: f64) {
        self.max = if self.count == 0 {
            value
        } else {
            self.max.max(value)
        };
        self.count += 1;
        self.sum += value;
        self.sum_of_squares += value * value;
        self.last = value;
    }

    /// The mean.
    pub(super) fn mean(&self) -> Option<f64> {
        (self.count > 0).then(|| self.sum / self.count as f64)
    }

    /// The root of the mean square (seed Eq. 12).
    pub(super) fn rmse(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.sum_of_squares / self.count as f64).sqrt())
    }

    /// The largest value.
    pub(super) fn max(&self) -> Option<f64> {
        (self.count > 0).then_some(self.max)
    }

    /// The value of the last step that had one.
    pub(super) fn last(&self) -> Option<f64> {
        (self.count > 0).then_some(self.last)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_of_known_values() {
        let mut tally = Tally::default();
        assert_eq!(
            (tally.mean(), tally.rmse(), tally.max()),
            (None, None, None)
        );
        for value in [-3.0, 4.0, -1.0] {
            tally.add(value);
        }
        assert_eq!(tally.mean(), Some(0.0));
        assert_eq!(tally.rmse(), Some((26.0_f64 / 3.0).sqrt()));
        assert_eq!((tally.max(), tally.last()), (Some(4.0), Some(-1.0)));
        let mut negative = Tally::default();
        negative.add(-2.0);
        assert_eq!(negative.max(), Some(-2.0));
    }
}
