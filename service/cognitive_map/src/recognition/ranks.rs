//! How many of many masses hold how much of their sum, without sorting them.

/// Bits of a number's fraction that are told apart: masses within a thirty-second of one another are one rank.
const FRACTION_BITS: u32 = 5;
const DROPPED_BITS: u32 = f32::MANTISSA_DIGITS - 1 - FRACTION_BITS;
/// Ranks of numbers up to two, the first bits of which are their exponent.
const RANKS: usize = 1 << (31 - DROPPED_BITS - 1);

/// Counts of masses by rank. Masses are from nothing to two; larger ones are of the highest rank.
#[derive(Debug)]
pub(super) struct Ranks {
    counts: Vec<u32>,
}

impl Ranks {
    pub(super) fn new() -> Self {
        Self {
            counts: vec![0; RANKS],
        }
    }

    /// The rank of a mass.
    pub(super) fn of(mass: f32) -> usize {
        (mass.to_bits() >> DROPPED_BITS).min(RANKS as u32 - 1) as usize
    }

    /// Counts a mass.
    pub(super) fn add(&mut self, mass: f32) {
        self.counts[Self::of(mass)] += 1;
    }

    /// Ranks that have masses, with their number and what each is, about; heaviest first.
    fn masses(&self) -> impl Iterator<Item = (usize, u32, f64)> {
        let ranks = (0..RANKS as u32).zip(&self.counts).rev();
        ranks.filter(|(_, count)| **count > 0).map(|(rank, count)| {
            let middle = (rank << DROPPED_BITS) + (1 << (DROPPED_BITS - 1));
            (rank as usize, *count, f64::from(f32::from_bits(middle)))
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

    /// The rank above which all of so many heaviest lie, and how many are to be taken of that rank itself.
    pub(super) fn least(&self, count: usize) -> (usize, usize) {
        let mut heaviest = 0;
        for (rank, own, _) in self.masses() {
            if heaviest + own as usize >= count {
                return (rank, count - heaviest);
            }
            heaviest += own as usize;
        }
        (0, count)
    }

    /// Sum of all, within a hundredth or so.
    pub(super) fn sum(&self) -> f64 {
        { self.masses() }
            .map(|(_, count, middle)| f64::from(count) * middle)
            .sum()
    }
}
