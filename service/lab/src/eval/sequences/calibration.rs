//! Whether what was said to be so likely came about so often.

use serde::{Serialize, Serializer};

/// Bounds of the bins.
const BOUNDS: [f64; 11] = [0.0, 0.01, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.95, 0.99];

/// Probabilities that were said, and what came about. It is serialised as its bins.
#[derive(Clone, Debug)]
pub struct Calibration {
    sums: [(u64, f64, u64); BOUNDS.len()],
}

/// Probabilities of about the same size.
#[derive(Clone, Debug, Serialize)]
pub struct Bin {
    /// The least of them.
    pub from: f64,
    /// None is as large.
    pub to: f64,
    /// How many.
    pub count: u64,
    /// Their mean.
    pub said: f64,
    /// The share of those that came about.
    pub came: f64,
    /// Standard deviation of that share, were what was said true.
    pub sd: f64,
}

impl Default for Calibration {
    fn default() -> Self {
        Self {
            sums: [(0, 0.0, 0); BOUNDS.len()],
        }
    }
}

impl Serialize for Calibration {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.bins().serialize(serializer)
    }
}

impl Calibration {
    /// Something was said to come about with a probability, and did or did not.
    pub fn add(&mut self, probability: f64, came: bool) {
        let bin = BOUNDS.partition_point(|bound| *bound <= probability).max(1) - 1;
        let sums = &mut self.sums[bin];
        *sums = (sums.0 + 1, sums.1 + probability, sums.2 + u64::from(came));
    }

    /// Takes in what another has.
    pub fn add_all(&mut self, other: &Self) {
        for (sums, more) in self.sums.iter_mut().zip(&other.sums) {
            *sums = (sums.0 + more.0, sums.1 + more.1, sums.2 + more.2);
        }
    }

    /// The bins that hold something.
    pub fn bins(&self) -> Vec<Bin> {
        let tops = BOUNDS[1..].iter().copied().chain([1.0]);
        let bins = BOUNDS.iter().zip(tops).zip(&self.sums);
        let bins = bins.filter(|(_, (count, ..))| *count > 0);
        bins.map(|((from, to), (count, said, came))| {
            let n = *count as f64;
            let said = said / n;
            Bin {
                from: *from,
                to,
                count: *count,
                said,
                came: *came as f64 / n,
                sd: (said * (1.0 - said) / n).max(0.0).sqrt(),
            }
        })
        .collect()
    }

    /// Mean distance of what was said from what came about, over all that was said (the expected
    /// calibration error of Naeini, Cooper & Hauskrecht 2015).
    pub fn error(&self) -> f64 {
        let bins = self.bins();
        let all: u64 = bins.iter().map(|bin| bin.count).sum();
        let sum: f64 = { bins.iter() }
            .map(|bin| bin.count as f64 * (bin.said - bin.came).abs())
            .sum();
        sum / all.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_comes_as_often_as_said_has_no_error() {
        let mut calibration = Calibration::default();
        for case in 0..100 {
            calibration.add(0.25, case % 4 == 0);
            calibration.add(1.0, true);
            calibration.add(0.0, false);
        }
        assert!(calibration.error() < 1e-12);
        let bins = calibration.bins();
        assert_eq!(bins.len(), 3);
        assert_eq!((bins[1].count, bins[1].came), (100, 0.25));
        calibration.add(0.9, false);
        assert!(calibration.error() > 0.0029);
    }
}
