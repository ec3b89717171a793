//! Weighted mean and deviation, one value at a time.

use crate::{CorruptState, State, StateReader, StateWriter};

/// Weighted mean and sum of squared deviations of values that came one by one (Welford 1962, with
/// weights after West 1979). No large sums are subtracted, so nothing cancels out.
///
/// ```text
/// W ← W + w      δ = x − μ      μ ← μ + (w / W) δ      S ← S + w δ (x − μ)
/// ```
///
/// The order of the values does not matter but for rounding.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    count: u64,
    weight: f64,
    mean: f64,
    squares: f64,
}

impl State for Moments {
    fn write(&self, out: &mut StateWriter) {
        self.count.write(out);
        [self.weight, self.mean, self.squares].write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let count = State::read(input)?;
        let [weight, mean, squares] = State::read(input)?;
        let is_sound = f64::is_finite(mean) && f64::is_finite(squares);
        if !is_sound || !(0.0..f64::INFINITY).contains(&weight) {
            return Err(CorruptState::Invalid);
        }
        Ok(Self {
            count,
            weight,
            mean,
            squares,
        })
    }
}

impl Moments {
    /// Adds a value with a weight above zero.
    #[inline]
    pub fn add(&mut self, value: f64, weight: f64) {
        self.count += 1;
        self.weight += weight;
        let off = value - self.mean;
        self.mean += weight / self.weight * off;
        self.squares += weight * off * (value - self.mean);
    }

    /// Lets all values so far count so much less: `keep` in \(0, 1\].
    #[inline]
    pub fn fade(&mut self, keep: f64) {
        self.weight *= keep;
        self.squares *= keep;
    }

    /// Number of values.
    #[inline]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Sum of the weights.
    #[inline]
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// Mean; 0 before the first value.
    #[inline]
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// Standard deviation √(S/W); 0 before the second value.
    #[inline]
    pub fn sd(&self) -> f64 {
        if self.weight > 0.0 {
            (self.squares.max(0.0) / self.weight).sqrt()
        } else {
            0.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn moments(values: &[(f64, f64)]) -> Moments {
        let mut moments = Moments::default();
        for &(value, weight) in values {
            moments.add(value, weight);
        }
        moments
    }

    proptest! {
        /// Against two passes over all values, near zero and far away from it, in either order.
        #[test]
        fn equal_those_of_two_passes(
            values in prop::collection::vec((-3.0..3.0f64, 0.5..1.0f64), 1..200),
            far in prop::sample::select(vec![0.0, 1e6, -1e9]),
        ) {
            let values: Vec<_> = values.iter().map(|(x, w)| (x + far, *w)).collect();
            let weight: f64 = values.iter().map(|(_, w)| w).sum();
            // About the first value, so that the oracle itself does not lose digits far away.
            let origin = values[0].0;
            let mean = origin + values.iter().map(|(x, w)| w * (x - origin)).sum::<f64>() / weight;
            let squares: f64 = values.iter().map(|(x, w)| w * (x - mean).powi(2)).sum();
            let sd = (squares / weight).sqrt();

            let reversed: Vec<_> = values.iter().rev().copied().collect();
            // A value far away has been rounded to this before anybody saw it.
            let grain = 1e-12 + f64::EPSILON * far.abs() * 16.0;
            for moments in [moments(&values), moments(&reversed)] {
                prop_assert_eq!(moments.count(), values.len() as u64);
                prop_assert!((moments.weight() - weight).abs() < 1e-9);
                prop_assert!((moments.mean() - mean).abs() < grain);
                prop_assert!((moments.sd() - sd).abs() < grain.max(1e-9));
            }
        }
    }

    #[test]
    fn what_is_no_moment_is_not_read() {
        let written = |moments: Moments| {
            let mut out = StateWriter::default();
            moments.write(&mut out);
            out.into_bytes()
        };
        let sound = moments(&[(3.0, 0.5), (-1e9, 1.0)]);
        let read = |bytes: &[u8]| Moments::read(&mut StateReader::new(bytes));
        assert_eq!(read(&written(sound)).unwrap(), sound);
        for broken in [
            Moments {
                weight: -0.5,
                ..sound
            },
            Moments {
                weight: f64::INFINITY,
                ..sound
            },
            Moments {
                mean: f64::NEG_INFINITY,
                ..sound
            },
            Moments {
                squares: f64::NAN,
                ..sound
            },
        ] {
            assert!(read(&written(broken)).is_err(), "{broken:?}");
        }
    }

    #[test]
    fn one_value_has_no_deviation() {
        assert_eq!(
            (Moments::default().mean(), Moments::default().sd()),
            (0.0, 0.0)
        );
        for value in [0.0, -7.25, 1e100] {
            let one = moments(&[(value, 0.75)]);
            assert_eq!((one.mean(), one.sd()), (value, 0.0));
        }
    }
}
