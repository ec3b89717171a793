//! A quantity over the steps of one run, in bins, so that long walks take no more memory than
//! short.

/// Most points of a curve.
const POINTS_MAX: u64 = 500;

/// Means over bins of equally many steps; the last bin may have fewer.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Curve {
    steps_per_bin: u64,
    /// Sum and number of the values in each bin.
    bins: Vec<(f64, u64)>,
}

impl Curve {
    /// An empty curve of a run of so many steps.
    pub(super) fn new(steps: u64) -> Self {
        Self {
            steps_per_bin: steps.div_ceil(POINTS_MAX).max(1),
            bins: Vec::new(),
        }
    }

    /// Takes in the value of a step, counted from 0.
    pub(super) fn add(&mut self, step: u64, value: f64) {
        let bin = usize::try_from(step / self.steps_per_bin).expect("a bin is one of few");
        if self.bins.len() <= bin {
            self.bins.resize(bin + 1, (0.0, 0));
        }
        self.bins[bin].0 += value;
        self.bins[bin].1 += 1;
    }

    /// Number of bins so far.
    pub(super) fn len(&self) -> usize {
        self.bins.len()
    }

    /// Mean of a bin; `None` where no step had a value.
    pub(super) fn mean(&self, bin: usize) -> Option<f64> {
        let (sum, count) = self.bins.get(bin)?;
        (*count > 0).then(|| sum / *count as f64)
    }

    /// The step, counted from 1, in the middle of a bin.
    pub(super) fn middle(&self, bin: usize) -> f64 {
        bin as f64 * self.steps_per_bin as f64 + 0.5 * (self.steps_per_bin as f64 + 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_hold_means_and_gaps() {
        let mut curve = Curve::new(1000); // two steps a bin
        curve.add(0, 1.0);
        curve.add(1, 4.0);
        curve.add(5, 7.0);
        assert_eq!(curve.len(), 3);
        assert_eq!(
            [0, 1, 2, 3].map(|bin| curve.mean(bin)),
            [Some(2.5), None, Some(7.0), None]
        );
        assert_eq!(
            [0, 2].map(|bin| curve.middle(bin).to_bits()),
            [1.5_f64, 5.5].map(f64::to_bits)
        );
    }

    #[test]
    fn long_walks_have_no_more_points() {
        for steps in [1, 499, 500, 501, 999, 50_000] {
            let mut curve = Curve::new(steps);
            for step in 0..steps {
                curve.add(step, 1.0);
            }
            assert!(curve.len() <= 500 && curve.len() as u64 >= steps.min(250));
            assert!(curve.middle(0) >= 1.0);
        }
    }
}
