//! How often so many sightings agree on a pose by chance.

use super::super::registration::log10_at_least;
use super::super::tuning::CONSENSUS_MIN;
use super::{Pair, n_free};

/// What is expected by chance among sightings, none of which is of its landmark.
#[derive(Clone, Debug)]
pub(super) struct Chance {
    /// Log₁₀ of the expected number of agreements of so many.
    log10_false_alarms: Vec<f64>,
}

impl Chance {
    /// By some pairs, which are one of so many choices.
    pub(super) fn of(pairs: &[Pair<'_>], n_choices: usize, is_planar: bool) -> Self {
        let (n, free) = (pairs.len(), n_free(is_planar));
        let near: f64 = pairs.iter().map(|pair| pair.by_chance(is_planar)).sum();
        let near = near / n as f64;
        let log10_tried = (n_choices as f64 * n_hypotheses(pairs, is_planar)).log10();
        let false_alarms = |k: usize| {
            if k < CONSENSUS_MIN || n <= free {
                return f64::INFINITY;
            }
            log10_tried + log10_at_least(k - free, n - free, near)
        };
        Self {
            log10_false_alarms: (0..=n).map(false_alarms).collect(),
        }
    }

    /// Log₁₀ of the expected number of poses on which as many agree.
    pub(super) fn log10_false_alarms(&self, n_agree: usize) -> f64 {
        self.log10_false_alarms[n_agree]
    }
}

/// Expected number of twos, in space of threes, that lie as far apart as their landmarks.
fn n_hypotheses(pairs: &[Pair<'_>], is_planar: bool) -> f64 {
    let mut sum = 0.0;
    for (j, b) in pairs.iter().enumerate() {
        for (i, a) in pairs[..j].iter().enumerate() {
            let two = a.apart_by_chance(b);
            if is_planar {
                sum += two;
                continue;
            }
            let threes = pairs[..i].iter();
            sum += threes
                .map(|c| two * a.apart_by_chance(c) * b.apart_by_chance(c))
                .sum::<f64>();
        }
    }
    sum
}
