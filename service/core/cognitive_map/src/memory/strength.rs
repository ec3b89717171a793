//! Strength of memories: a sum over uses that fades.

use std::cmp::Ordering;

use crate::settings::Settings;
use state::state_of_struct;

/// The strength of a memory: each use counts one when it happens and half as much after every
/// half-life.
///
/// ```text
/// strength(t) = Σ 2^(tᵢ − t)     tᵢ the uses, t now, in half-lives on the space's sample clock
/// key         = log₂ strength(t) + t
/// ```
///
/// The key does not depend on t, so the order of memories changes only when one is used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Strength {
    key: f64,
}

state_of_struct!(Strength { key });

/// The space's clock: the number of its records, in half-lives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clock(f64);

impl Clock {
    /// The clock at a revision of the map.
    pub(crate) fn at(revision: u64, settings: &Settings) -> Self {
        Self(revision as f64 / f64::from(settings.strength_half_life_samples))
    }
}

impl Strength {
    /// That of a memory used for the first time.
    pub(crate) fn new(now: Clock) -> Self {
        Self { key: now.0 }
    }

    /// That of a memory of which so much is left.
    pub(crate) fn left(now: Clock, strength: f64) -> Self {
        let strength = strength.max(f64::MIN_POSITIVE);
        Self {
            key: strength.log2() + now.0,
        }
    }

    /// One more use, which counts `weight`.
    pub(crate) fn used(&mut self, now: Clock, weight: f64) {
        self.key = (self.now(now) + weight).log2() + now.0;
    }

    /// What is left of all uses.
    pub(crate) fn now(self, now: Clock) -> f64 {
        (self.key - now.0).exp2()
    }

    /// The weaker one first; a total order, so that damage cannot confuse it.
    pub(crate) fn cmp(self, other: Self) -> Ordering {
        self.key.total_cmp(&other.key)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Against the sum itself; and the order of two stays when time passes.
        #[test]
        fn is_the_sum_of_faded_uses(
            waits in prop::collection::vec(0.0..30.0f64, 1..20),
            start in prop::sample::select(vec![0.0, 1.0, 1e6]),
        ) {
            let mut now = start;
            let mut times = vec![now];
            let mut strength = Strength::new(Clock(now));
            for wait in waits {
                now += wait;
                let sum: f64 = times.iter().map(|time| (time - now).exp2()).sum();
                let measured = strength.now(Clock(now));
                prop_assert!((measured / sum - 1.0).abs() < 1e-7, "{} {}", measured, sum);
                times.push(now);
                strength.used(Clock(now), 1.0);
            }
            let other = Strength::new(Clock(now + 1e-3));
            let order = strength.cmp(other);
            let later = Clock(now + 10.0);
            prop_assert_eq!(strength.now(later).total_cmp(&other.now(later)), order);
        }
    }

    #[test]
    fn what_is_long_unused_is_used_anew() {
        let mut strength = Strength::new(Clock(0.0));
        assert!(strength.now(Clock(5000.0)) < f64::MIN_POSITIVE);
        strength.used(Clock(5000.0), 1.0);
        assert!((strength.now(Clock(5000.0)) - 1.0).abs() < 1e-12);
        assert!((strength.now(Clock(5001.0)) - 0.5).abs() < 1e-12);
    }
}
