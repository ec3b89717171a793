//! What a channel is like, learned from levels of one way.

use state::{Moments, state_of_struct};

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
    kernel: Option<Kernel>,
}

state_of_struct!(Variogram {
    weights,
    lags_m,
    halves,
    levels,
    kernel
});

impl Variogram {
    /// The model of the channel; `None` while it is not known, or says nothing.
    pub fn kernel(&self) -> Option<&Kernel> {
        self.kernel.as_ref()
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
        let value = bounded(value, self.levels.mean());
        self.levels.fade(1.0 - 1.0 / tuning::LEVELS);
        self.levels.add(value, 1.0);
        if self.levels.count().is_multiple_of(tuning::REFIT) {
            self.kernel = self.fit().filter(Kernel::tells);
        }
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
