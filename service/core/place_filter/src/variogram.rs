//! What a channel is like, learned from levels of one way.

use state::{Moments, Teachers, state_of_struct};

use crate::kernel::Kernel;
use crate::tuning::channel as tuning;

/// Half of the mean squared difference of two levels, by their distance (Matheron 1963), and what
/// follows from it. The distances are those of motion, so that no error of a map counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Variogram {
    weights: [f64; tuning::LAGS],
    lags_m: [f64; tuning::LAGS],
    halves: [f64; tuning::LAGS],
    levels: Moments,
    teachers: Teachers,
    kernel: Option<Kernel>,
}

state_of_struct!(Variogram {
    weights,
    lags_m,
    halves,
    levels,
    teachers,
    kernel
});

impl Variogram {
    /// The model of the channel; `None` while it is not known, or says nothing.
    pub fn kernel(&self) -> Option<&Kernel> {
        self.kernel.as_ref()
    }

    /// Whether a level is like those of the channel. One far off all others, as a sensor sends for
    /// "nothing", tells nothing of a place; if there are many, the channel has changed.
    pub fn is_usual(&self, value: f64) -> bool {
        let deviation = self.levels.sd();
        let is_known = self.levels.count() >= tuning::USUAL_MIN && deviation > 0.0;
        !is_known || (value - self.levels.mean()).abs() <= tuning::FAR * deviation
    }

    /// An agent sensed a usual level: it contests the unusual ones of another.
    pub fn hear_usual(&mut self, agent: u32) {
        self.teachers.hear(agent, true);
    }

    /// Takes in an unusual level of an agent, without its place, if it is not one agent's word
    /// against that of others.
    pub fn learn_unusual(&mut self, value: f64, agent: u32) {
        if !self.teachers.hear(agent, false) {
            return;
        }
        let most = tuning::COUNTED_MAX * self.levels.sd();
        let apart = (value - self.levels.mean()).max(-most).min(most);
        self.count(self.levels.mean() + apart);
    }

    fn count(&mut self, value: f64) {
        self.levels.fade(1.0 - 1.0 / tuning::LEVELS);
        self.levels.add(value, 1.0);
        if self.levels.count().is_multiple_of(tuning::REFIT) {
            self.kernel = self.fit().filter(Kernel::tells);
        }
    }

    /// Takes in a level, and how far from it each of some earlier ones was \[m\].
    pub fn learn(&mut self, value: f64, earlier: impl Iterator<Item = (f64, f64)>) {
        let far = tuning::FAR * self.levels.sd();
        let is_known = self.levels.count() >= tuning::LEVELS_MIN && far > 0.0;
        let bounded = |value: f64, about: f64| {
            if is_known {
                value.clamp(about - far, about + far)
            } else {
                value
            }
        };
        for (distance_m, before) in earlier {
            let steps = (distance_m / tuning::LAG_MIN_M).ln() / tuning::LAG_RATIO.ln();
            if steps.is_nan() || steps < 0.0 || steps >= tuning::LAGS as f64 {
                continue;
            }
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "it is in the range"
            )]
            let lag = steps as usize;
            let difference = bounded(value, before) - before;
            if self.weights[lag] < tuning::PAIRS_MAX {
                self.weights[lag] += 1.0;
            }
            let share = 1.0 / self.weights[lag];
            self.lags_m[lag] += share * (distance_m - self.lags_m[lag]);
            self.halves[lag] += share * (0.5 * difference * difference - self.halves[lag]);
        }
        self.count(bounded(value, self.levels.mean()));
    }

    /// The model that fits best (weighted least squares after Cressie 1985):
    ///
    /// ```text
    /// γ(d) = n + σ² (1 − exp(−d²/2ℓ²))
    /// ```
    fn fit(&self) -> Option<Kernel> {
        let variance = self.levels.sd().powi(2);
        if !variance.is_normal() {
            return None;
        }
        let known: Vec<_> = (0..tuning::LAGS)
            .filter(|&lag| self.weights[lag] >= tuning::PAIRS_MIN)
            .map(|lag| {
                let spread = self.halves[lag] + tuning::SPREAD_MIN * variance;
                let weight = self.weights[lag].min(500.0) / (spread * spread);
                (self.lags_m[lag], self.halves[lag], weight)
            })
            .collect();
        if known.len() < tuning::LAGS_MIN {
            return None;
        }
        // Far away, levels differ as much as any two.
        let total: f64 = known.iter().map(|(_, _, weight)| weight).sum();
        let far = (f64::INFINITY, variance, total / known.len() as f64);
        let mut best: Option<(f64, Kernel)> = None;
        let mut attempt = |length_m: f64| {
            let rows = known.iter().chain([&far]).map(|&(lag_m, half, weight)| {
                let ratio = lag_m / length_m;
                (1.0 - (-0.5 * ratio * ratio).exp(), half, weight)
            });
            let (nugget, sill, cost) = line(rows, tuning::NUGGET_MIN * variance);
            if best.is_none_or(|(least, _)| cost < least) {
                let mean = self.levels.mean();
                let kernel = Kernel {
                    mean,
                    sill,
                    nugget,
                    length_m,
                };
                best = Some((cost, kernel));
            }
            best.map_or(length_m, |(_, kernel)| kernel.length_m)
        };
        let (mut length_m, mut coarse_m) = (tuning::LENGTH_MIN_M, tuning::LENGTH_MIN_M);
        for _ in 0..tuning::LENGTHS {
            coarse_m = attempt(length_m);
            length_m *= tuning::LENGTH_RATIO;
        }
        // The same between the neighbours of the best one.
        for step in 1..tuning::LENGTHS {
            let part = 2.0 * f64::from(step) / f64::from(tuning::LENGTHS) - 1.0;
            attempt(coarse_m * tuning::LENGTH_RATIO.powf(part));
        }
        best.map(|(_, kernel)| kernel)
    }
}

/// The line y = a + b x of weighted least squares with a ≥ `least` and b ≥ 0, and its cost.
fn line(rows: impl Iterator<Item = (f64, f64, f64)> + Clone, least: f64) -> (f64, f64, f64) {
    let [mut w, mut wx, mut wy, mut wxx, mut wxy] = [0.0; 5];
    for (x, y, weight) in rows.clone() {
        w += weight;
        wx += weight * x;
        wy += weight * y;
        wxx += weight * x * x;
        wxy += weight * x * y;
    }
    let determinant = w * wxx - wx * wx;
    let (mut a, mut b) = if determinant > 1e-9 * w * wxx {
        let b = (w * wxy - wx * wy) / determinant;
        ((wy - b * wx) / w, b)
    } else {
        (wy / w, 0.0)
    };
    if a < least {
        a = least;
        b = (wxy - a * wx) / wxx.max(f64::MIN_POSITIVE);
    }
    if b < 0.0 {
        (a, b) = ((wy / w).max(least), 0.0);
    }
    let cost = rows.map(|(x, y, weight)| weight * (y - a - b * x).powi(2));
    (a, b, cost.sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Levels of a field along a lane, each with those up to 1.2 m before.
    fn explore(
        variogram: &mut Variogram,
        agent: u32,
        count: u32,
        sensed: impl Fn(u32, f64) -> f64,
    ) -> u32 {
        let mut way: Vec<(f64, f64)> = Vec::new();
        let mut unusual = 0;
        for number in 0..count {
            let at = 0.1 * f64::from(number);
            let noise = 0.05 * (f64::from(number) * 97.3).sin();
            let value = sensed(number, 5.0 + (1.3 * at).sin() + (0.9 * at).cos() + noise);
            if !variogram.is_usual(value) {
                variogram.learn_unusual(value, agent);
                unusual += 1;
                continue;
            }
            variogram.hear_usual(agent);
            let earlier = way.iter().rev().take(12);
            variogram.learn(value, earlier.map(|(from, level)| (at - from, *level)));
            way.push((at, value));
        }
        unusual
    }

    type Sensed = fn(u32, f64) -> f64;

    fn honest(_: u32, level: f64) -> f64 {
        level
    }

    fn is_like(one: &Variogram, other: &Variogram) -> bool {
        let (Some(one), Some(other)) = (one.kernel(), other.kernel()) else {
            return false;
        };
        let ratios = [one.sill / other.sill, one.length_m / other.length_m];
        (one.mean - other.mean).abs() < 0.3 && ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.3)
    }

    fn learned() -> Variogram {
        let mut variogram = Variogram::default();
        assert_eq!(explore(&mut variogram, 0, 2000, honest), 0);
        assert!(variogram.kernel().is_some());
        variogram
    }

    #[test]
    fn one_agents_errors_leave_what_a_channel_is_like() {
        let before = learned();
        let errors: [Sensed; 4] = [
            |_, level| 1000.0 * level,
            |_, _| -9999.0,
            |number, level| if number % 20 == 7 { -9999.0 } else { level },
            |number, _| if number % 2 == 0 { 1e29 } else { -1e29 },
        ];
        for sensed in errors {
            let mut variogram = before;
            let unusual = explore(&mut variogram, 1, 3000, sensed);
            assert!(unusual >= 150, "{unusual}");
            assert!(is_like(&variogram, &before), "{variogram:?}");
            assert_eq!(explore(&mut variogram, 0, 500, honest), 0);
        }
    }

    #[test]
    fn a_change_that_two_agents_sense_is_followed_and_so_is_that_of_the_only_one() {
        let change = |_: u32, level: f64| 50.0 + 3.0 * level;
        let mut variogram = learned();
        for _ in 0..40 {
            explore(&mut variogram, 1, 100, change);
            explore(&mut variogram, 2, 100, change);
        }
        assert_eq!(explore(&mut variogram, 1, 100, change), 0);
        let mut variogram = learned();
        explore(&mut variogram, 0, 8000, change);
        assert_eq!(explore(&mut variogram, 0, 100, change), 0);
    }

    #[test]
    fn what_nobody_contests_is_followed_in_the_end() {
        let change = |_: u32, level: f64| 50.0 + 3.0 * level;
        let mut variogram = learned();
        let contested = explore(&mut variogram, 1, 3000, change);
        assert_eq!(contested, 3000);
        explore(&mut variogram, 1, 30_000, change);
        assert_eq!(explore(&mut variogram, 1, 100, change), 0);
    }
}
