//! Histogram of masses on a logarithmic scale: quantiles without sorting.

use crate::numeric::floor_u32;
use crate::tuning::COUNTED_MAX;

/// Bits of the fraction that are kept: masses within 1/32 of one another share a bin.
const FRACTION_BITS: u32 = 5;
const DROPPED_BITS: u32 = f32::MANTISSA_DIGITS - 1 - FRACTION_BITS;
/// Bins of numbers up to two, by the first bits of their `f32`.
const BINS: usize = 1 << (31 - DROPPED_BITS - 1);

/// Counts of masses by bin. Masses are from 0 to 2; larger ones are in the last bin.
#[derive(Debug)]
pub(crate) struct MassHistogram {
    counts: Vec<u32>,
    /// Stride at which the masses of a list are counted.
    step: usize,
    /// Index of the first mass that is counted in the next list.
    next: usize,
}

impl MassHistogram {
    /// For lists of `masses` masses in all.
    pub(crate) fn new(masses: usize) -> Self {
        Self {
            counts: vec![0; BINS],
            step: masses.div_ceil(COUNTED_MAX).max(1),
            next: 0,
        }
    }

    /// Counts a mass.
    pub(crate) fn add(&mut self, mass: f32) {
        self.count(mass, 1);
    }

    /// Counts the masses of a list, each multiplied by `scale`.
    pub(crate) fn add_all(&mut self, masses: &[f32], scale: f32) {
        let weight = u32::try_from(self.step).unwrap_or(u32::MAX);
        for mass in masses.iter().skip(self.next).step_by(self.step) {
            self.count(scale * mass, weight);
        }
        // The stride goes on over the lists as if they were one.
        let counted = masses.len().saturating_sub(self.next).div_ceil(self.step);
        self.next = self.next + counted * self.step - masses.len();
    }

    fn count(&mut self, mass: f32, weight: u32) {
        let bin = (mass.to_bits() >> DROPPED_BITS) as usize;
        self.counts[bin.min(BINS - 1)] += u32::from(mass > 0.0) * weight;
    }

    /// Bins that are not empty, heaviest first: number, count and the mass in the bin's middle.
    fn masses(&self) -> impl Iterator<Item = (u32, u32, f64)> {
        let histogram = self.counts.iter().enumerate().rev();
        histogram
            .filter(|(_, count)| **count > 0)
            .map(|(bin, count)| {
                let bin = u32::try_from(bin).unwrap_or(u32::MAX);
                let middle = (bin << DROPPED_BITS) + (1 << (DROPPED_BITS - 1));
                (bin, *count, f64::from(f32::from_bits(middle)))
            })
    }

    /// Number of the heaviest that hold `mass` together.
    pub(crate) fn holding(&self, mass: f64) -> usize {
        let (mut held, mut heaviest) = (0.0, 0);
        for (_, count, middle) in self.masses() {
            let missing = (mass - held) / middle;
            if missing <= f64::from(count) {
                return heaviest + floor_u32(missing.ceil()) as usize;
            }
            held += f64::from(count) * middle;
            heaviest += count as usize;
        }
        heaviest
    }

    /// Lower bound of the bins that hold at most `most` of the heaviest masses, at least one bin,
    /// and the number of masses in them.
    pub(crate) fn least(&self, most: usize) -> (f32, usize) {
        let (mut least, mut heaviest) = (f32::INFINITY, 0);
        for (bin, own, _) in self.masses() {
            if heaviest > 0 && heaviest + own as usize > most {
                break;
            }
            heaviest += own as usize;
            least = f32::from_bits(bin << DROPPED_BITS);
        }
        (least, heaviest)
    }

    /// Sum of all masses, to about a hundredth.
    pub(crate) fn sum(&self) -> f64 {
        { self.masses() }
            .map(|(_, count, middle)| f64::from(count) * middle)
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_heaviest_are_as_many_as_if_they_were_sorted() {
        let mut masses: Vec<f32> = (1..=200).map(|k| 0.9_f32.powi(k)).collect();
        masses.extend([0.0; 50]);
        let mut histogram = MassHistogram::new(masses.len());
        histogram.add_all(&masses[..100], 1.0);
        histogram.add_all(&masses[100..], 1.0);
        assert!((histogram.sum() - 9.0).abs() < 0.1, "{}", histogram.sum());
        // 1 − 0.9ⁿ of the mass of all is in the first n.
        for (share, count) in [(0.5, 7), (0.9, 22), (0.99, 44)] {
            let found = histogram.holding(share * histogram.sum());
            assert!(found.abs_diff(count) <= 1, "{found} {count}");
        }
        let (least, count) = histogram.least(10);
        assert_eq!(count, masses.iter().filter(|mass| **mass >= least).count());
        assert!((9..=10).contains(&count), "{count}");
        // One that is heavier than all others together is one.
        histogram.add(1.0);
        histogram.add(1e-9);
        assert_eq!(MassHistogram::new(0).holding(1.0), 0);
        assert_eq!(histogram.holding(0.1), 1);
    }

    #[test]
    fn of_long_lists_some_stand_for_all() {
        let mut histogram = MassHistogram::new(10 * COUNTED_MAX);
        for _ in 0..COUNTED_MAX {
            histogram.add_all(&[0.5; 3], 1.0);
            histogram.add_all(&[0.25; 8], 1.0);
        }
        let sum = histogram.sum() / (3.5 * COUNTED_MAX as f64);
        assert!((sum - 1.0).abs() < 0.03, "{sum}");
    }
}
