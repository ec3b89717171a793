//! Distribution of the levels of a channel over all places of a library.

use crate::contact::{Contact, LevelReading};
use crate::model::LevelMemory;
use crate::tuning::{LEVEL_DENSITY_FLOOR, WRONG_PERCEPT_SHARE};

/// Normal distribution of the levels of a channel over all places.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LevelPrior {
    pub(crate) channel: u16,
    pub(crate) mean: f64,
    pub(crate) variance: f64,
}

impl LevelPrior {
    /// Density of a level anywhere, times √(2π).
    pub(crate) fn density(&self, reading: &LevelReading) -> f64 {
        let apart = reading.value - self.mean;
        let variance = self.variance + reading.sd * reading.sd;
        // The floor takes values far off all others for misreadings.
        ((-0.5 * apart * apart / variance).exp() + LEVEL_DENSITY_FLOOR) / variance.sqrt()
    }
}

/// How much less likely the levels of a contact are of some distributions than of others, at most
/// 1, and no less than if they were misread.
pub(crate) fn likelihood_below_one(
    contact: &Contact,
    own: &[LevelPrior],
    others: &[LevelPrior],
) -> f64 {
    let ratios = contact.levels.iter().map(|reading| {
        let density = |all: &[LevelPrior]| {
            let found = all.iter().find(|prior| prior.channel == reading.channel);
            found.map(|prior| prior.density(reading))
        };
        let ratio = density(own).zip(density(others));
        ratio.map_or(1.0, |(own, other)| {
            (own / other).clamp(WRONG_PERCEPT_SHARE, 1.0)
        })
    });
    ratios.product()
}

/// Distributions of these levels, one of each channel for each place, by channel.
pub(crate) fn level_prior<'a>(levels: impl Iterator<Item = &'a LevelMemory>) -> Vec<LevelPrior> {
    let mut all: Vec<LevelMemory> = Vec::new();
    for level in levels {
        match all.iter_mut().find(|sum| sum.channel == level.channel) {
            Some(sum) => {
                sum.count += 1.0;
                let apart = level.mean - sum.mean;
                sum.mean += apart / sum.count;
                sum.squares += apart * (level.mean - sum.mean);
            }
            None => all.push(LevelMemory {
                count: 1.0,
                squares: 0.0,
                ..*level
            }),
        }
    }
    let level_prior = |sum: LevelMemory| LevelPrior {
        channel: sum.channel,
        mean: sum.mean,
        variance: sum.squares / sum.count + 1e-12,
    };
    all.into_iter().map(level_prior).collect()
}
