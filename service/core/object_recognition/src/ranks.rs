//! How many of many masses hold how much of their sum, without sorting them.

/// Bits of a number's fraction that are told apart: masses within a thirty-second of one another are one rank.
const FRACTION_BITS: u32 = 5;
const DROPPED_BITS: u32 = f32::MANTISSA_DIGITS - 1 - FRACTION_BITS;
/// Ranks of numbers up to two, the first bits of which are their exponent.
const RANKS: usize = 1 << (31 - DROPPED_BITS - 1);

/// Masses of long lists that are counted; every second one stands for two, or every third for three.
const COUNTED: usize = 16_384;

/// Counts of masses by rank. Masses are from nothing to two; larger ones are of the highest rank.
#[derive(Debug)]
pub(super) struct Ranks {
    counts: Vec<u32>,
    /// Of every so many masses of a list one is counted.
    step: usize,
    /// Place of the first that is counted in the next list.
    next: usize,
}

impl Ranks {
    /// For lists of so many masses in all.
    pub(super) fn new(masses: usize) -> Self {
        Self {
            counts: vec![0; RANKS],
            step: masses.div_ceil(COUNTED).max(1),
            next: 0,
        }
    }

    /// Counts a mass.
    pub(super) fn add(&mut self, mass: f32) {
        self.count(mass, 1);
    }

    /// Counts those of a list, each multiplied by `scale`.
    pub(super) fn add_all(&mut self, masses: &[f32], scale: f32) {
        let weight = u32::try_from(self.step).unwrap_or(u32::MAX);
        for mass in masses.iter().skip(self.next).step_by(self.step) {
            self.count(scale * mass, weight);
        }
        // All lists are counted as if they were one.
        let counted = masses.len().saturating_sub(self.next).div_ceil(self.step);
        self.next = self.next + counted * self.step - masses.len();
    }

    fn count(&mut self, mass: f32, weight: u32) {
        let rank = (mass.to_bits() >> DROPPED_BITS) as usize;
        self.counts[rank.min(RANKS - 1)] += u32::from(mass > 0.0) * weight;
    }

    /// Ranks that have masses, with their number and what each is, about; heaviest first.
    fn masses(&self) -> impl Iterator<Item = (u32, u32, f64)> {
        let ranks = self.counts.iter().enumerate().rev();
        ranks.filter(|(_, count)| **count > 0).map(|(rank, count)| {
            let rank = u32::try_from(rank).unwrap_or(u32::MAX);
            let middle = (rank << DROPPED_BITS) + (1 << (DROPPED_BITS - 1));
            (rank, *count, f64::from(f32::from_bits(middle)))
        })
    }

    /// How many of the heaviest hold so much.
    pub(super) fn holding(&self, mass: f64) -> usize {
        let (mut held, mut heaviest) = (0.0, 0);
        for (_, count, middle) in self.masses() {
            let missing = (mass - held) / middle;
            if missing <= f64::from(count) {
                #[expect(
                    clippy::cast_possible_truncation,
                    clippy::cast_sign_loss,
                    reason = "from nothing to the count"
                )]
                let some = missing.max(0.0).ceil() as usize;
                return heaviest + some;
            }
            held += f64::from(count) * middle;
            heaviest += count as usize;
        }
        heaviest
    }

    /// The least mass of the ranks that the so many heaviest are of, and how many those ranks have in all: the last one only counts if
    /// they are no more with it, or it is the first.
    pub(super) fn least(&self, most: usize) -> (f32, usize) {
        let (mut least, mut heaviest) = (f32::INFINITY, 0);
        for (rank, own, _) in self.masses() {
            if heaviest > 0 && heaviest + own as usize > most {
                break;
            }
            heaviest += own as usize;
            least = f32::from_bits(rank << DROPPED_BITS);
        }
        (least, heaviest)
    }

    /// Sum of all, to a hundredth or so.
    pub(super) fn sum(&self) -> f64 {
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
        let mut ranks = Ranks::new(masses.len());
        ranks.add_all(&masses[..100], 1.0);
        ranks.add_all(&masses[100..], 1.0);
        assert!((ranks.sum() - 9.0).abs() < 0.1, "{}", ranks.sum());
        // 1 − 0.9ⁿ of the mass of all is in the first n.
        for (share, count) in [(0.5, 7), (0.9, 22), (0.99, 44)] {
            let found = ranks.holding(share * ranks.sum());
            assert!(found.abs_diff(count) <= 1, "{found} {count}");
        }
        let (least, count) = ranks.least(10);
        assert_eq!(count, masses.iter().filter(|mass| **mass >= least).count());
        assert!((9..=10).contains(&count), "{count}");
        // One that is heavier than all others together is one.
        ranks.add(1.0);
        ranks.add(1e-9);
        assert_eq!(Ranks::new(0).holding(1.0), 0);
        assert_eq!(ranks.holding(0.1), 1);
    }

    #[test]
    fn of_long_lists_some_stand_for_all() {
        let mut ranks = Ranks::new(10 * COUNTED);
        for _ in 0..COUNTED {
            ranks.add_all(&[0.5; 3], 1.0);
            ranks.add_all(&[0.25; 8], 1.0);
        }
        let sum = ranks.sum() / (3.5 * COUNTED as f64);
        assert!((sum - 1.0).abs() < 0.03, "{sum}");
    }
}
