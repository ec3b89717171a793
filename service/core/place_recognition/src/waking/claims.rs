//! When an agent is told where it is: how often such a claim was right, by agents that knew.

use geometry::PoseCovariance;
use nalgebra::{Isometry3, Matrix6};
use state::state_of_struct;

use super::logistic::Logistic;
use super::mode::Mode;
use super::particles::Filter;
use crate::tuning::claims as tuning;

/// What was learned of claims on a channel.
#[derive(Clone, Debug)]
pub(super) struct Claims {
    /// Log odds that the agent is near the mode.
    near: Logistic<5>,
    /// First claims lately that were right, and wrong.
    right: f64,
    wrong: f64,
    /// Mean squared error of first claims that were right, in their variances.
    ratio: f64,
}

state_of_struct!(Claims {
    near,
    right,
    wrong,
    ratio
});

impl Default for Claims {
    fn default() -> Self {
        Self {
            near: Logistic::new([1.0, 0.0, 0.0, 0.0, 0.0]),
            right: 0.0,
            wrong: 0.0,
            ratio: tuning::RATIO,
        }
    }
}

impl Claims {
    /// The mode's probability, how alike views are there and less than elsewhere, how many.
    fn features(filter: &Filter, mode: &Mode) -> [f64; 5] {
        let probability = mode.probability.clamp(1e-3, 1.0 - 1e-3);
        let [here, less] = filter.alike;
        [
            (probability / (1.0 - probability)).ln(),
            here - 0.5,
            less,
            f64::from(filter.n_views).ln_1p() - 2.0,
            1.0,
        ]
    }

    /// Learns from a filter of an agent that knows its pose.
    pub(super) fn learn(&mut self, filter: &mut Filter, mode: &Mode, pose: &Isometry3<f64>) {
        if filter.n_views < tuning::VIEWS_MIN {
            return;
        }
        let off = mode.pose.translation.vector - pose.translation.vector;
        let is_near = off.xy().norm() < tuning::NEAR_M && off.z.abs() < tuning::NEAR_Z_M;
        let features = Self::features(filter, mode);
        let odds = self.near.log_odds(&features);
        let is_claim = !filter.has_claimed && filter.is_sure(odds);
        self.near.learn(&features, is_near, tuning::WEIGHT);
        if !is_claim {
            return;
        }
        filter.has_claimed = true;
        self.right = self.right * tuning::KEPT + f64::from(u8::from(is_near));
        self.wrong = self.wrong * tuning::KEPT + f64::from(u8::from(!is_near));
        if is_near {
            let variance = mode.covariance.matrix().diagonal();
            let squared = variance.fixed_rows::<3>(0).sum().max(f64::EPSILON);
            let ratio = (off.xy().norm_squared() / squared).min(tuning::RATIO_MAX);
            self.ratio += (ratio - self.ratio) * (1.0 - tuning::KEPT);
        }
    }

    /// Whether so many first claims were tried that one more says little.
    pub(super) fn are_many(&self) -> bool {
        self.right + self.wrong >= tuning::COUNT_MANY
    }

    /// Whether enough first claims were right: no more are wrong than the largest share and chance
    /// explain, by one standard deviation of a binomial count. An agent that taught and had drifted
    /// itself counts as a wrong claim, too.
    fn are_sound(&self) -> bool {
        let count = self.right + self.wrong;
        let most = tuning::WRONG_MAX;
        let by_chance = (count * most * (1.0 - most)).sqrt();
        count >= tuning::COUNT_MIN && self.wrong <= most * count + by_chance
    }

    /// The covariance of a claim; `None` while it is not sure enough.
    pub(super) fn claim(&self, filter: &mut Filter, mode: &Mode) -> Option<PoseCovariance> {
        if filter.n_views < tuning::VIEWS_MIN || !self.are_sound() {
            return None;
        }
        let odds = self.near.log_odds(&Self::features(filter, mode));
        let is_sure = filter.is_sure(odds);
        if !(is_sure || filter.has_claimed && odds >= tuning::FOLLOWED) {
            return None;
        }
        filter.has_claimed = true;
        // A floor: the middle of a cell is not known to better.
        let floor = Matrix6::identity() * tuning::FLOOR;
        let covariance = mode.covariance.matrix() * self.ratio.max(1.0) + floor;
        Some(PoseCovariance::from_matrix(&covariance))
    }
}
