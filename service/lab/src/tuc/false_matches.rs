//! Which matches are false, and more of those.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::data_set::{Match, Tuc};

/// Places further apart than this are different places \[m\].
const SAME_PLACE_M: f64 = 2.0;

/// Shorter gaps between the moments of a match say nothing that odometry does not \[ns\].
const GAP_NS: i64 = 10_000_000_000;

/// Draws for one false match after which the set is taken to have too few places for more.
const DRAWS_MAX: usize = 10_000;

impl Tuc {
    /// The set's matches whose moments are at least ten seconds apart: nearer ones say nothing that
    /// odometry does not.
    pub fn distant_matches(&self) -> Vec<Match> {
        let is_distant = |found: &&Match| found.later_ns.saturating_sub(found.earlier_ns) > GAP_NS;
        self.matches().iter().filter(is_distant).copied().collect()
    }

    /// Whether the robot was within two metres of the place at both moments of a match; no if the
    /// truth does not tell.
    pub fn is_true(&self, found: &Match) -> bool {
        let places = [found.later_ns, found.earlier_ns].map(|moment_ns| self.truth().at(moment_ns));
        let [Some(later), Some(earlier)] = places else {
            return false;
        };
        (later - earlier).norm() < SAME_PLACE_M
    }

    /// Adds false matches between moments of the given ones, drawn evenly, until they make up this
    /// share of all, from 0 to below 1. [`Tuc::stream`] puts them in order.
    pub fn add_false(&self, matches: &mut Vec<Match>, share: f64, seed: u64) {
        let n_true = matches.iter().filter(|found| self.is_true(found)).count();
        let moments: Vec<i64> = matches
            .iter()
            .flat_map(|found| [found.later_ns, found.earlier_ns])
            .collect();
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        while n_true > 0 && ((matches.len() - n_true) as f64) < share * matches.len() as f64 {
            let drawn = (0..DRAWS_MAX).find_map(|_| {
                let mut any = || moments[random.random_range(0..moments.len())];
                let (a, b) = (any(), any());
                let found = Match {
                    later_ns: a.max(b),
                    earlier_ns: a.min(b),
                    score: 0.5,
                };
                let is_distant = found.later_ns.saturating_sub(found.earlier_ns) > GAP_NS;
                (is_distant && !self.is_true(&found)).then_some(found)
            });
            let Some(found) = drawn else { break };
            matches.push(found);
        }
    }
}
