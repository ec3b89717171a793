//! What a view says of the cell where it was taken: learned of each channel from views of agents
//! that know where they are, each before it is added to the cells.

use nalgebra::{SMatrix, SVector};
use state::state_of_struct;

use super::cells::Alike;
use super::logistic::{Logistic, newton};
use crate::tuning::waking as tuning;

/// What is learned of a channel.
#[derive(Clone, Debug)]
pub(super) struct CellModel {
    /// Weights of the features, in a softmax over all cells.
    weights: SVector<f64, 2>,
    information: SMatrix<f64, 2, 2>,
    /// Mean of log p(cell | view) + log(number of cells) lately \[nats\].
    pub(super) told: f64,
    /// Views that were learned from.
    pub(super) n_views: u32,
    /// Whether a view was taken in a cell at all.
    within: Logistic<4>,
    /// Share of views within, lately.
    share_within: f64,
}

state_of_struct!(CellModel {
    weights,
    information,
    told,
    n_views,
    within,
    share_within
});

/// A softmax over cells.
struct Softmax {
    logits: Vec<f64>,
    /// Logarithm of the sum of their exponentials.
    whole: f64,
    /// Probability of each.
    shares: Vec<f32>,
}

/// Log likelihoods of a view.
#[derive(Clone, Debug)]
pub(super) struct Scores {
    /// Of each cell of the channel, against the mean of all \[nats\].
    pub(super) cells: Vec<(u32, f32)>,
    /// Of the cells against a place of which nothing is known \[nats\].
    pub(super) within: f64,
}

impl Default for CellModel {
    fn default() -> Self {
        Self {
            weights: SVector::from(tuning::WEIGHTS),
            information: SMatrix::identity() * tuning::PRIOR,
            told: 0.0,
            n_views: 0,
            within: Logistic::new([0.0; 4]),
            share_within: 0.5,
        }
    }
}

impl CellModel {
    /// Whether views of the channel say where they were taken.
    pub(super) fn is_telling(&self) -> bool {
        self.n_views >= tuning::VIEWS_MIN && self.told >= tuning::TOLD_MIN
    }

    fn softmax(&self, alike: &[Alike]) -> Softmax {
        let logits: Vec<f64> = { alike.iter() }
            .map(|alike| {
                let [mean, density] = alike.features.map(f64::from);
                self.weights[0] * mean + self.weights[1] * density
            })
            .collect();
        let most = logits.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        #[expect(clippy::cast_possible_truncation, reason = "at most 0")]
        let less = logits.iter().map(|logit| (logit - most) as f32);
        let mut shares: Vec<f32> = less.collect();
        simd::exp(&mut shares);
        let sum: f64 = shares.iter().copied().map(f64::from).sum();
        #[expect(clippy::cast_possible_truncation, reason = "1 at least")]
        let factor = (1.0 / sum) as f32;
        for share in &mut shares {
            *share *= factor;
        }
        Softmax {
            logits,
            whole: most + sum.ln(),
            shares,
        }
    }

    /// What a view says.
    pub(super) fn scores(&self, alike: &[Alike]) -> Scores {
        let Softmax { logits, whole, .. } = self.softmax(alike);
        let mean = whole - (alike.len() as f64).ln();
        #[expect(clippy::cast_possible_truncation, reason = "a few nats")]
        let cells = { alike.iter().zip(&logits) }
            .map(|(alike, logit)| (alike.cell, (logit - mean) as f32))
            .collect();
        let features = Self::features(alike, mean);
        Scores {
            cells,
            within: self.within.log_odds(&features),
        }
    }

    /// Features of whether a view was taken in a cell: evidence, largest cosine, its square.
    fn features(alike: &[Alike], mean: f64) -> [f64; 4] {
        let best = alike.iter().map(|alike| alike.features[0]);
        let best = f64::from(best.fold(0.0, f32::max));
        [mean, best, best * best, 1.0]
    }

    /// Learns from a view that was taken in a cell, or in none.
    pub(super) fn learn(&mut self, alike: &[Alike], cell: Option<u32>) {
        if alike.len() < tuning::CELLS_MIN {
            return;
        }
        let own = self.softmax(alike);
        let mean = own.whole - (alike.len() as f64).ln();
        let is_within = cell.is_some();
        self.share_within +=
            (f64::from(u8::from(is_within)) - self.share_within) * (1.0 - tuning::KEPT);
        // Both count as much, however often each is met.
        let share = if is_within {
            self.share_within
        } else {
            1.0 - self.share_within
        };
        let weight = 0.5 / share.max(tuning::SHARE_MIN);
        self.within
            .learn(&Self::features(alike, mean), is_within, weight);
        let Some(at) = cell.and_then(|cell| alike.iter().position(|each| each.cell == cell)) else {
            return;
        };
        let (mut first, mut second) = (SVector::<f64, 2>::zeros(), SMatrix::<f64, 2, 2>::zeros());
        for (alike, share) in alike.iter().zip(&own.shares) {
            let probability = f64::from(*share);
            let features = SVector::from(alike.features.map(f64::from));
            first += features * probability;
            second += features * features.transpose() * probability;
        }
        let probability = (own.logits[at] - own.whole).exp();
        let noise = tuning::MISPLACED / alike.len() as f64;
        let known = (1.0 - tuning::MISPLACED) * probability;
        let share = known / (known + noise);
        let features = SVector::from(alike[at].features.map(f64::from));
        let gradient = (features - first) * share;
        let variance = (second - first * first.transpose()) * share;
        newton(
            &mut self.weights,
            &mut self.information,
            &gradient,
            &variance,
        );
        let told = (known + noise).ln() + (alike.len() as f64).ln();
        self.n_views = self.n_views.saturating_add(1);
        let rate = (1.0 / f64::from(self.n_views)).max(1.0 - tuning::KEPT);
        self.told += (told - self.told) * rate;
    }
}
