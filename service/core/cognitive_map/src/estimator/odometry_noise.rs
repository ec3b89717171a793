//! What an agent's odometry turns out to be worth, against what it states or the settings assume.
//!
//! Two sightings of one landmark say how the robot moved in between, whatever the map is thought to
//! be: the second one is expected where the first one and odometry put the landmark. What is
//! missing there is noise of odometry's lengths and angles and of seen distances and directions,
//! each in a proportion that the motion in between and the geometry fix:
//!
//! ```text
//! ν = z₂ − h(Δ⁻¹ h⁻¹(z₁))      E ν² = V = Σ_i s_i q_i + r      i = 1 … 4
//! ```
//!
//! The four factors follow the likelihood of the residuals by steps of Fisher scoring in ln s, from
//! a wide prior. The rest r is what is not known of odometry's lasting errors, and noise that
//! odometry states:
//!
//! ```text
//! g_i = s_i q_i / V      J ← J + w κ g gᵀ      ln s ← ln s + J⁻¹ w g (min(ν²/V, c²) − κ₀)
//! ```
//!
//! Errors of sensors that last cancel out in a pair. The bound c keeps single large errors from
//! counting for more than others; κ₀ and κ make that right for Gaussian noise. A pair that is
//! farther off than [`NOISE_FALSE_SD`] says nothing: one of the two was of something else. It would
//! count as c², and where a tenth of all sightings are false, the factors would grow for ever.
//!
//! A beacon that was found by its distances says how well the robot turned meanwhile
//! ([`NoiseEvidence`]), which counts beside the pairs.
//!
//! - **Assumed noise** is multiplied by its factor; below one, by a part of it only
//!   ([`NOISE_CAUTION`]). Until the factor is known it is not taken for less than one, and what it
//!   was too large by is taken back then ([`NoiseTrial`]).
//! - **Stated noise** counts at least. Beside it counts as much of the assumed noise as is certain
//!   to be there, so that a robot that states too little does not bend the map.

use nalgebra::{Cholesky, Isometry3, Matrix4, Matrix6, U4, Vector4, Vector6};

use super::calibration::LastingErrors;
use super::noise_part::{NoiseEvidence, NoisePart};
use super::sighting_pair::{Anchor, NoisyMotion, Residual};
use super::tuning::{
    NOISE_ANGLE_SD_MAX_RAD, NOISE_CAUTION, NOISE_FALSE_SD, NOISE_LOG_SCALE_MAX, NOISE_LOG_STEP_MAX,
    NOISE_MEMORY, NOISE_PAIR_NS_MAX, NOISE_PAIR_WEIGHT, NOISE_PAIRS_MAX, NOISE_PRIOR_SD,
    NOISE_ROBUST, NOISE_SATURATED, NOISE_SHARE_MIN, NOISE_SUM_LENGTH_MAX_M, NOISE_SURELY_SD,
    NOISE_TARGETS_MAX, NOISE_TRIAL_NS_MAX, NOISE_TRIAL_SD,
};
use super::understated_noise::UnderstatedNoise;
use crate::input::{Label, Relation};
use geometry::MotionSum;

/// What is learned of the noise of an agent's odometry.
#[derive(Clone, Debug)]
pub(super) struct OdometryNoise {
    /// Logarithms of the factors of variances: of lengths and angles that odometry reads, of
    /// distances and directions that are seen.
    pub(super) log_scales: Vector4<f64>,
    /// What pairs of sightings, and beacons that were found, said about them, as information.
    pub(super) information: Matrix4<f64>,
    /// What the assumed variances of lengths and of angles count for.
    pub(super) factors: [f64; 2],
    /// What the sensor states too little.
    pub(super) understated: UnderstatedNoise,
    /// Whether odometry states its noise.
    pub(super) is_stated: bool,
    /// Motion since before the oldest anchor.
    pub(super) motion: NoisyMotion,
    /// First sightings of pairs.
    pub(super) anchors: Vec<Anchor>,
    /// What is to be taken back when it is known how large the assumed noise is.
    pub(super) trial: Option<NoiseTrial>,
}

/// The time before it is known how large the assumed noise is: it counts in full, and what it adds
/// to the covariance is followed (`noise_share`).
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct NoiseTrial {
    /// When the first landmark was seen \[ns\].
    pub(super) seen_ns: Option<i64>,
    /// When the noise was followed first, by odometry's clock \[ns\].
    pub(super) followed_ns: Option<i64>,
    /// Motion since the share was brought up to date, with noise of lengths and of angles.
    pub(super) by_lengths: MotionSum,
    pub(super) by_angles: MotionSum,
}

/// What has told of the noise of odometry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Told {
    /// Pairs of sightings of one landmark.
    ByPairs,
    /// A landmark that was found by its distances alone.
    ByBeacon,
}

impl Default for OdometryNoise {
    fn default() -> Self {
        Self::new(false)
    }
}

impl OdometryNoise {
    /// Of odometry that states its noise, or does not, and of which nothing is known yet.
    fn new(is_stated: bool) -> Self {
        let factor = if is_stated { 0.0 } else { 1.0 };
        Self {
            log_scales: Vector4::zeros(),
            information: Matrix4::zeros(),
            factors: [factor; 2],
            understated: UnderstatedNoise::default(),
            is_stated,
            motion: NoisyMotion::default(),
            anchors: Vec::new(),
            trial: (!is_stated).then(NoiseTrial::default),
        }
    }

    /// The variances of a motion with these assumed ones, and with these that it states.
    #[inline]
    pub(super) fn variance(
        &self,
        assumed: &Vector6<f64>,
        stated: Option<&Vector6<f64>>,
    ) -> Vector6<f64> {
        let least = if self.trial.is_some() { 1.0 } else { 0.0 };
        let learned = Vector6::from_fn(|k, _| assumed[k] * self.factors[k / 3].max(least));
        stated.map_or(learned, |stated| stated + learned)
    }

    /// Goes on by a motion, as corrected, with the variances that are assumed and stated.
    #[inline]
    pub(super) fn append(
        &mut self,
        increment: &Isometry3<f64>,
        assumed: &Vector6<f64>,
        stated: Option<&Vector6<f64>>,
    ) {
        if self.is_stated != stated.is_some() {
            *self = Self {
                understated: self.understated,
                ..Self::new(stated.is_some())
            };
        }
        if self.anchors.is_empty() && self.trial.is_none() {
            return;
        }
        let [mut lengths, mut angles] = [*assumed; 2];
        lengths.fixed_rows_mut::<3>(3).fill(0.0);
        angles.fixed_rows_mut::<3>(0).fill(0.0);
        if let Some(trial) = &mut self.trial {
            trial.by_lengths.append(increment, &lengths);
            trial.by_angles.append(increment, &angles);
            let lever = &trial.by_lengths.motion().translation.vector;
            if lever.norm_squared() > NOISE_SUM_LENGTH_MAX_M * NOISE_SUM_LENGTH_MAX_M {
                self.trial = None;
            }
        }
        if self.anchors.is_empty() {
            return;
        }
        self.motion.by_lengths.append(increment, &lengths);
        self.motion.by_angles.append(increment, &angles);
        if let Some(stated) = stated {
            self.motion.as_stated.append(increment, stated);
        }
        let lever = &self.motion.motion().translation.vector;
        if lever.norm_squared() > NOISE_SUM_LENGTH_MAX_M * NOISE_SUM_LENGTH_MAX_M {
            self.forget_anchors();
        }
    }

    /// The noise since it was asked for last: covariances of the pose's error, on its right, of
    /// lengths and of angles; none where it is not followed. Who sees no landmark that tells about
    /// it is not followed for ever.
    pub(super) fn take_trial_noise(&mut self, stamp_ns: Option<i64>) -> Option<[Matrix6<f64>; 2]> {
        let trial = self.trial.as_mut()?;
        if let Some(now_ns) = stamp_ns {
            let begun_ns = *trial.followed_ns.get_or_insert(now_ns);
            if now_ns.saturating_sub(begun_ns) > 2 * NOISE_TRIAL_NS_MAX {
                self.trial = None;
                return None;
            }
        }
        let sums = [&mut trial.by_lengths, &mut trial.by_angles];
        Some(sums.map(|sum| *std::mem::take(sum).covariance().matrix()))
    }

    /// The body is somewhere else, by what it is told: what it did before does not count any more.
    pub(super) fn forget_trial_noise(&mut self) {
        if let Some(trial) = &mut self.trial {
            (trial.by_lengths, trial.by_angles) = Default::default();
        }
    }

    /// Ends the trial when the noise is known: answers the parts of the assumed noise, of lengths
    /// and of angles, that are not there; negative where there is more.
    pub(super) fn end_trial(&mut self, stamp_ns: i64, told: Told) -> Option<[f64; 2]> {
        let trial = self.trial.as_mut()?;
        // Who sees landmarks with their directions soon knows more than a beacon says.
        if told == Told::ByBeacon && trial.seen_ns.is_some() {
            return None;
        }
        let root = Self::with_prior(&self.information).cholesky()?;
        let variances = root.inverse().diagonal();
        let sd = [0, 1].map(|k| variances[k].sqrt());
        // The mean of a factor of which the logarithm is known to a deviation; more than one only
        // as far as that is certain.
        let not_there = [0, 1].map(|k| {
            let log = self.log_scales[k];
            let less = (log + sd[k] * sd[k] / 2.0).min(0.0);
            let more = (log - NOISE_SURELY_SD * sd[k]).max(0.0);
            1.0 - (less + more).exp()
        });
        let is_over = match told {
            Told::ByBeacon => not_there[1] > 0.0,
            Told::ByPairs => {
                let begun_ns = *trial.seen_ns.get_or_insert(stamp_ns);
                let is_late = stamp_ns.saturating_sub(begun_ns) >= NOISE_TRIAL_NS_MAX;
                sd[1] <= NOISE_TRIAL_SD || is_late
            }
        };
        if !is_over {
            return None;
        }
        self.trial = None;
        Some(not_there)
    }

    /// A landmark was found by its distances alone, which says this of the assumed noise of turns.
    pub(super) fn learn_turns(&mut self, seen: NoiseEvidence) {
        if self.is_stated {
            return;
        }
        let mut information = self.information;
        information[(1, 1)] += seen.information;
        let Some(root) = Self::with_prior(&information).cholesky() else {
            return;
        };
        let mut score = Vector4::zeros();
        score[1] = seen.score - seen.information * self.log_scales[1];
        let most = NOISE_LOG_SCALE_MAX;
        let mut learned = self.log_scales + root.solve(&score);
        // Beacons lead no further than the parts of the noise that were tried.
        let (least, before) = (NoisePart::Least.log_factor(), self.log_scales[1]);
        learned[1] = learned[1].clamp(least.min(before), before.max(0.0));
        self.log_scales = learned.map(|log| log.clamp(-most, most));
        self.information = information;
        self.weigh_factors(&root);
    }

    /// Information about the logarithms of the factors, with what was known before.
    fn with_prior(information: &Matrix4<f64>) -> Matrix4<f64> {
        let prior = Vector4::from(NOISE_PRIOR_SD).map(|sd| sd.powi(-2));
        information + Matrix4::from_diagonal(&prior)
    }

    /// Forgets what later sightings would be compared with.
    pub(super) fn forget_anchors(&mut self) {
        self.anchors.clear();
        self.motion = NoisyMotion::default();
    }

    /// A landmark was seen. Of odometry's lasting errors, these are the variances. An agent that is
    /// doubted tells of its sensor alone.
    pub(super) fn note(
        &mut self,
        label: &Label,
        stamp_ns: i64,
        relation: &Relation,
        lasting: &LastingErrors,
        is_doubted: bool,
    ) {
        let is_recent =
            |anchor: &Anchor| stamp_ns.saturating_sub(anchor.stamp_ns) <= NOISE_PAIR_NS_MAX;
        self.anchors.retain(is_recent);
        if self.anchors.is_empty() {
            self.forget_anchors();
        }
        let index = self
            .anchors
            .iter()
            .position(|anchor| anchor.label == *label);
        let Some(index) = index else {
            if self.anchors.len() < NOISE_TARGETS_MAX {
                let anchor = Anchor::new(label, stamp_ns, relation, &self.motion);
                self.anchors.extend(anchor);
            }
            return;
        };
        let anchor = &mut self.anchors[index];
        if anchor.stamp_ns >= stamp_ns {
            return;
        }
        anchor.seen += 1;
        // Pairs with one anchor share its error: only ones farther and farther apart count.
        let seen = anchor.seen;
        if !seen.is_power_of_two() {
            return;
        }
        let mut residuals = anchor.residuals(stamp_ns, relation, &self.motion, lasting);
        if seen == 1 {
            self.understated.learn(&residuals);
        }
        for residual in &mut residuals {
            self.understated.scale(residual);
        }
        let is_saturated = residuals.iter().all(|residual| self.is_saturated(residual));
        // The comparison is linear in angles.
        let is_linear = |residual: &Residual| {
            !residual.is_angle || self.expected(residual) <= NOISE_ANGLE_SD_MAX_RAD.powi(2)
        };
        let is_false = residuals.iter().any(|residual| self.is_false(residual));
        if !is_doubted && !is_false && residuals.iter().all(is_linear) {
            for residual in &residuals {
                self.learn(residual);
            }
        }
        if is_false || is_saturated || seen >= NOISE_PAIRS_MAX {
            self.anchors.remove(index);
            let anchor = Anchor::new(label, stamp_ns, relation, &self.motion);
            self.anchors.extend(anchor);
        }
    }

    /// Parts of a residual's variance, as learned.
    fn weighed(&self, residual: &Residual) -> Vector4<f64> {
        self.log_scales.map(f64::exp).component_mul(&residual.parts)
    }

    /// Variance of a residual, as learned.
    fn expected(&self, residual: &Residual) -> f64 {
        self.weighed(residual).sum() + residual.rest
    }

    /// Whether one of a pair must have been of something else.
    fn is_false(&self, residual: &Residual) -> bool {
        residual.square > NOISE_FALSE_SD * NOISE_FALSE_SD * self.expected(residual)
    }

    /// Whether the motion makes most of a residual, so that a longer one would not say more.
    fn is_saturated(&self, residual: &Residual) -> bool {
        let weighed = self.weighed(residual);
        let sensor = weighed[2] + weighed[3];
        weighed[0] + weighed[1] + residual.rest > NOISE_SATURATED * sensor
    }

    fn learn(&mut self, residual: &Residual) {
        let variance = self.expected(residual);
        let mut share = self.weighed(residual) / variance;
        let at_least = |k: usize| self.log_scales[k].exp().max(1.0) * residual.parts[k];
        // What a sensor states covers errors of its own that change with the motion: noise of
        // odometry that is small beside it cannot be told from them.
        let sensor = at_least(2) + at_least(3);
        for k in 0..2 {
            if at_least(k) < NOISE_SHARE_MIN * sensor {
                share[k] = 0.0;
            }
        }
        let (most, mean, slope) = NOISE_ROBUST;
        let surprise = (residual.square / variance).min(most * most) - mean;
        let information =
            self.information + share * share.transpose() * (NOISE_PAIR_WEIGHT * slope);
        let Some(root) = Self::with_prior(&information).cholesky() else {
            return;
        };
        let step = root.solve(&(share * (NOISE_PAIR_WEIGHT * surprise)));
        if !step.iter().all(|step| step.is_finite()) {
            return;
        }
        let most = NOISE_LOG_SCALE_MAX;
        self.log_scales = self.log_scales.zip_map(&step, |log, step| {
            let step = step.clamp(-NOISE_LOG_STEP_MAX, NOISE_LOG_STEP_MAX);
            (log + step).clamp(-most, most)
        });
        self.information = information * (1.0 - 1.0 / NOISE_MEMORY);
        self.weigh_factors(&root);
    }

    /// What is learned counts, with this information.
    fn weigh_factors(&mut self, information: &Cholesky<f64, U4>) {
        let variances = information.inverse().diagonal();
        self.factors = [0, 1].map(|k| self.factor(k, variances[k].sqrt()));
    }

    /// What assumed noise counts for, where the logarithm of its factor is known to a deviation.
    fn factor(&self, component: usize, sd: f64) -> f64 {
        let log = self.log_scales[component];
        if self.is_stated {
            let surely = |log: f64, sd: f64| (log - NOISE_SURELY_SD * sd).exp();
            // Before anything was seen, nothing is certain.
            (surely(log, sd) - surely(0.0, NOISE_PRIOR_SD[component])).max(0.0)
        } else if log < 0.0 {
            (log * NOISE_CAUTION).exp()
        } else {
            log.exp()
        }
    }
}

#[cfg(test)]
mod tests;
