//! Distribution of the levels of a channel over places.

use std::borrow::Cow;
use std::collections::BTreeMap;

use crate::contact::{Contact, LevelReading};
use crate::model::{LevelMemory, ModelPlace};
use crate::numeric::{exp, floor_u32, to_f32};
use crate::tuning::{
    LEVEL_DENSITY_FLOOR, LEVEL_MAX, LEVEL_REACH, LEVEL_ROUNDING, LEVEL_VARIANCE_FLOOR,
    UNUSUAL_SHARE_MAX, WRONG_PERCEPT_SHARE,
};

/// Distribution of the levels of a channel over the places of an object or of a library: a mixture
/// of normal distributions.
///
/// Levels far from most others of their object, and those of objects at another order of
/// magnitude, have a normal distribution of their own. Thus one that stands for "nothing felt", or
/// is in another unit, changes little of what the others tell.
#[derive(Clone, Debug)]
pub(crate) struct LevelPrior {
    pub(crate) channel: u16,
    components: Vec<Component>,
}

/// Normal distribution of some levels.
#[derive(Clone, Copy, Debug)]
struct Component {
    /// Part of the whole.
    share: f64,
    /// Number of places.
    count: f64,
    mean: f64,
    /// Sum of squared differences from the mean.
    squares: f64,
}

/// What levels of an object belong together: those in reach of their median.
#[derive(Clone, Copy, Debug)]
struct UsualLevels {
    median: f64,
    reach: f64,
}

impl UsualLevels {
    fn new(levels: &[f64]) -> Self {
        let median = |mut levels: Vec<f64>| {
            levels.sort_unstable_by(f64::total_cmp);
            levels.get(levels.len() / 2).copied().unwrap_or_default()
        };
        let middle = median(levels.to_vec());
        let apart = median(levels.iter().map(|level| (level - middle).abs()).collect());
        let rounding = LEVEL_ROUNDING.sqrt() * (1.0 + middle.abs());
        let usual = Self {
            median: middle,
            reach: LEVEL_REACH * apart.max(rounding),
        };
        // Where most are equal, others may be as good: a dot on a plain surface.
        let far = levels.iter().filter(|level| !usual.contain(**level));
        if far.count() as f64 > UNUSUAL_SHARE_MAX * levels.len() as f64 {
            return Self {
                reach: f64::INFINITY,
                ..usual
            };
        }
        usual
    }

    fn contain(&self, level: f64) -> bool {
        (level - self.median).abs() <= self.reach
    }
}

/// The places of an object without the levels that are far from most others of it: what lies
/// between them is not predicted from these.
pub(crate) fn without_unusual_levels(places: &[ModelPlace]) -> Cow<'_, [ModelPlace]> {
    let channels = by_channel(places.iter().flat_map(|place| &place.levels));
    let usual: BTreeMap<u16, UsualLevels> = { channels.iter() }
        .map(|(channel, levels)| (*channel, UsualLevels::new(levels)))
        .collect();
    let is_usual = |level: &LevelMemory| usual[&level.channel].contain(level.mean);
    if places.iter().flat_map(|place| &place.levels).all(is_usual) {
        return Cow::Borrowed(places);
    }
    let mut places = places.to_vec();
    for place in &mut places {
        place.levels.retain(is_usual);
    }
    Cow::Owned(places)
}

impl Component {
    /// One of these levels of an object with so many.
    fn new(levels: &[f64], of: usize) -> Self {
        let count = levels.len() as f64;
        let mean = levels.iter().sum::<f64>() / count;
        Self {
            share: count / of as f64,
            count,
            mean,
            squares: levels.iter().map(|level| (level - mean).powi(2)).sum(),
        }
    }

    fn add(&mut self, other: &Self) {
        let count = self.count + other.count;
        let apart = other.mean - self.mean;
        self.squares += other.squares + apart * apart * self.count * other.count / count;
        self.mean += apart * other.count / count;
        self.count = count;
        self.share += other.share;
    }

    fn variance(&self) -> f64 {
        self.squares / self.count + LEVEL_ROUNDING * (1.0 + self.mean * self.mean)
    }

    /// Order of magnitude: powers of ten by which the root mean square is above a millionth.
    fn magnitude(&self) -> u32 {
        let square = self.mean * self.mean + self.squares / self.count;
        floor_u32(0.5 * (square / LEVEL_ROUNDING).log10())
    }

    /// Its part in the density of a reading at its mean, and how much less it is at the reading,
    /// as a log.
    fn density(&self, reading: &LevelReading) -> (f64, f64) {
        let apart = reading.value - self.mean;
        let variance = self.variance() + reading.sd * reading.sd;
        (
            self.share / variance.sqrt(),
            -0.5 * apart * apart / variance,
        )
    }
}

/// A level that was read, with how likely it is anywhere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RatedLevel {
    pub(crate) value: f64,
    /// Variance of its noise.
    pub(crate) noise: f64,
    /// Its density anywhere, times √(2π).
    density: f64,
}

impl RatedLevel {
    /// Likelihood ratio: at a place with levels of this mean and variance, against anywhere.
    pub(crate) fn ratio(&self, mean: f64, variance: f64) -> f64 {
        let variance = variance + self.noise;
        let apart = self.value - mean;
        let fall = exp(to_f32(-0.5 * apart * apart / variance));
        let here = f64::from(fall) / variance.sqrt();
        (1.0 - WRONG_PERCEPT_SHARE) * here / self.density + WRONG_PERCEPT_SHARE
    }
}

impl LevelPrior {
    /// Of the levels of an object, one for each place.
    fn of_object(channel: u16, levels: Vec<f64>) -> Self {
        let count = levels.len();
        let usual = UsualLevels::new(&levels);
        let (usual, others): (Vec<f64>, Vec<f64>) =
            levels.into_iter().partition(|level| usual.contain(*level));
        let parts = [usual, others];
        let parts = parts.iter().filter(|levels| !levels.is_empty());
        Self {
            channel,
            components: parts.map(|levels| Component::new(levels, count)).collect(),
        }
    }

    /// Of a channel, if the library has it.
    pub(crate) fn of(priors: &[Self], channel: u16) -> Option<&Self> {
        priors.iter().find(|own| own.channel == channel)
    }

    /// Mean and variance of the levels of most places.
    pub(crate) fn usual(&self) -> (f64, f64) {
        let most = self
            .components
            .iter()
            .max_by(|a, b| a.share.total_cmp(&b.share));
        most.map_or((0.0, 0.0), |own| {
            (own.mean, own.squares / own.count.max(1.0))
        })
    }

    /// A reading of its channel, ready to be compared with places.
    pub(crate) fn rated(&self, reading: &LevelReading) -> RatedLevel {
        RatedLevel {
            value: reading.value,
            noise: self.noise(reading),
            density: self.density(reading),
        }
    }

    /// Variance of the noise of a reading: its own, and a part of that of the levels like it.
    pub(crate) fn noise(&self, reading: &LevelReading) -> f64 {
        let log = |component: &Component| {
            let (most, log) = component.density(reading);
            most.ln() + log
        };
        let like = match &self.components[..] {
            [only] => Some(only),
            several => { several.iter() }.max_by(|a, b| log(a).total_cmp(&log(b))),
        };
        let floor = like.map_or(0.0, |like| like.variance() * LEVEL_VARIANCE_FLOOR);
        reading.sd * reading.sd + floor
    }

    /// Density of a level anywhere, times √(2π).
    pub(crate) fn density(&self, reading: &LevelReading) -> f64 {
        let mut sum = 0.0;
        let mut likest = (f64::NEG_INFINITY, 0.0);
        for component in &self.components {
            let (most, log) = component.density(reading);
            sum += most * log.exp();
            if likest.1 == 0.0 || most.ln() + log > likest.0 {
                likest = (most.ln() + log, most);
            }
        }
        // Values far off all others are taken for misreadings.
        sum + LEVEL_DENSITY_FLOOR * likest.1
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

/// Distributions of the levels of an object, one of each channel for each place, by channel.
pub(crate) fn object_levels<'a>(levels: impl Iterator<Item = &'a LevelMemory>) -> Vec<LevelPrior> {
    { by_channel(levels).into_iter() }
        .map(|(channel, levels)| LevelPrior::of_object(channel, levels))
        .collect()
}

fn by_channel<'a>(levels: impl Iterator<Item = &'a LevelMemory>) -> BTreeMap<u16, Vec<f64>> {
    let mut channels: BTreeMap<u16, Vec<f64>> = BTreeMap::new();
    for level in levels {
        let mean = level.mean.clamp(-LEVEL_MAX, LEVEL_MAX);
        channels.entry(level.channel).or_default().push(mean);
    }
    channels
}

/// Distributions of the levels of all objects, by channel. Each object has an equal part.
pub(crate) fn level_prior<'a>(objects: impl Iterator<Item = &'a LevelPrior>) -> Vec<LevelPrior> {
    let mut channels: BTreeMap<u16, (f64, BTreeMap<u32, Component>)> = BTreeMap::new();
    for object in objects {
        let (count, groups) = channels.entry(object.channel).or_default();
        *count += 1.0;
        for component in &object.components {
            { groups.entry(component.magnitude()) }
                .and_modify(|group| group.add(component))
                .or_insert(*component);
        }
    }
    { channels.into_iter() }
        .map(|(channel, (count, groups))| {
            let component = |group: Component| Component {
                share: group.share / count,
                ..group
            };
            LevelPrior {
                channel,
                components: groups.into_values().map(component).collect(),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn object(levels: &[f64]) -> Vec<LevelPrior> {
        let level = |mean: &f64| LevelMemory {
            channel: 3,
            count: 1.0,
            mean: *mean,
            squares: 0.0,
            noise: 0.01,
        };
        let levels: Vec<_> = levels.iter().map(level).collect();
        object_levels(levels.iter())
    }

    fn library(objects: &[Vec<f64>]) -> LevelPrior {
        let objects: Vec<_> = objects.iter().flat_map(|levels| object(levels)).collect();
        let mut priors = level_prior(objects.iter());
        assert_eq!(priors.len(), 1);
        priors.pop().expect("one channel has levels")
    }

    fn reading(value: f64) -> LevelReading {
        LevelReading {
            channel: 3,
            value,
            sd: 0.1,
        }
    }

    #[test]
    fn levels_of_one_kind_have_the_normal_distribution_of_all() {
        let levels = [vec![-1.5, 2.0, 0.25], vec![1.0, -3.5, 4.0, 1.5, -2.0]];
        let prior = library(&levels);
        let all = levels.concat();
        let mean = all.iter().sum::<f64>() / 8.0;
        let variance = all.iter().map(|level| (level - mean).powi(2)).sum::<f64>() / 8.0;
        for value in [-4.0, 0.0, 0.3, 7.0, 1e9] {
            let variance = variance + 0.01;
            let exponent: f64 = -0.5 * (value - mean).powi(2) / variance;
            let expected = (exponent.exp() + LEVEL_DENSITY_FLOOR) / variance.sqrt();
            let density = prior.density(&reading(value));
            assert!((density / expected - 1.0).abs() < 1e-9, "{value}");
        }
        let noise = prior.noise(&reading(0.3));
        assert!((noise - 0.01 - LEVEL_VARIANCE_FLOOR * variance).abs() < 1e-15);
    }

    #[test]
    fn dots_on_a_plain_surface_are_levels_like_others() {
        let plain = [vec![0.0; 60], vec![1.0; 40]].concat();
        let prior = library(std::slice::from_ref(&plain));
        let alone = library(&[vec![0.0, 0.0, 0.0, 1.0, 1.0]]);
        for value in [0.0, 0.5, 1.0] {
            let ratio = prior.density(&reading(value)) / alone.density(&reading(value));
            assert!((ratio - 1.0).abs() < 1e-6, "{value}: {ratio}");
        }
    }

    #[test]
    fn levels_far_from_all_others_take_their_part_and_no_more() {
        let own = [-1.5, 2.0, 0.25, 1.0].repeat(3);
        let alone = library(std::slice::from_ref(&own));
        for far in [1e4, -1e9, 1e30] {
            // Another object, and one level in thirteen of the same.
            let other = library(&[own.clone(), vec![far, -far, far]]);
            let same = library(&[[own.clone(), vec![far]].concat()]);
            for (prior, part) in [(other, 0.5), (same, 12.0 / 13.0)] {
                for value in [-1.0, 0.0, 1.7] {
                    let ratio = prior.density(&reading(value)) / alone.density(&reading(value));
                    assert!((ratio - part).abs() < 1e-3, "{far} {value}: {ratio}");
                    let noise = prior.noise(&reading(value));
                    assert!((noise / alone.noise(&reading(value)) - 1.0).abs() < 1e-9);
                }
            }
        }
    }
}
