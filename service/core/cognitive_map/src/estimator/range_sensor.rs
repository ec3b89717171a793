//! What an agent's distances alone turn out to be worth, against what they state.

use std::collections::BTreeMap;

use super::sensor::SightingTarget;
use super::tuning::{
    CORRELATION_INTERVAL_S_MAX, LEARNED_ERROR_MAX, MEMORY_SIGHTINGS, PRIOR_SIGHTINGS,
    RANGE_CORRELATION_MAX, RANGE_PRIOR_CORRELATION, SENSOR_SCALE_MAX, SENSOR_TARGETS_MAX,
    SIGHTING_SD_MIN,
};

/// How far to trust an agent's distances.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RangeSensor {
    /// Variance as a multiple of the stated one; at least one.
    pub(super) scale: f64,
    /// Distances behind it.
    pub(super) count: f64,
    /// Sum of products of consecutive normalised errors of one target.
    pub(super) product: f64,
    /// Sum of their squares.
    pub(super) square: f64,
    /// Stamp \[ns\] and normalised error of each target's latest distance.
    pub(super) latest: BTreeMap<SightingTarget, (i64, f64)>,
}

impl Default for RangeSensor {
    fn default() -> Self {
        Self {
            scale: 1.0,
            count: PRIOR_SIGHTINGS,
            product: RANGE_PRIOR_CORRELATION * PRIOR_SIGHTINGS,
            square: PRIOR_SIGHTINGS,
            latest: BTreeMap::new(),
        }
    }
}

impl RangeSensor {
    /// Variance with which a distance counts that states a deviation of `sd_m`.
    ///
    /// Of errors with the correlation ρ from each to the next, n say as much as n (1 − ρ)/(1 + ρ)
    /// independent ones:
    ///
    /// ```text
    /// σ² = s σ_stated² (1 + ρ)/(1 − ρ)
    /// ```
    pub(super) fn variance(&self, sd_m: f64) -> f64 {
        let correlation = self.correlation();
        self.scale * stated(sd_m) * (1.0 + correlation) / (1.0 - correlation)
    }

    /// Correlation of successive errors of one target.
    fn correlation(&self) -> f64 {
        (self.product / self.square.max(f64::MIN_POSITIVE)).clamp(0.0, RANGE_CORRELATION_MAX)
    }

    /// A distance that states a deviation of `sd_m` was off by `innovation_m`, where the estimate
    /// alone explains the variance `spread`.
    pub(super) fn note(
        &mut self,
        seen: SightingTarget,
        stamp_ns: i64,
        sd_m: f64,
        innovation_m: f64,
        spread: f64,
    ) {
        let stated = stated(sd_m);
        let expected = self.scale * stated;
        // Where the estimate is vague, the innovation tells about the estimate.
        if spread > expected {
            return;
        }
        let squared = innovation_m
            .powi(2)
            .min(LEARNED_ERROR_MAX * LEARNED_ERROR_MAX * (expected + spread));
        let ratio = (squared - spread) / stated;
        self.count = (self.count + 1.0).min(MEMORY_SIGHTINGS);
        self.scale += (ratio - self.scale) / self.count;
        self.scale = self.scale.clamp(1.0, SENSOR_SCALE_MAX);
        let now = (innovation_m / expected.sqrt()).clamp(-LEARNED_ERROR_MAX, LEARNED_ERROR_MAX);
        if let Some(&(before_ns, before)) = self.latest.get(&seen) {
            let interval_s = stamp_ns.saturating_sub(before_ns) as f64 * 1e-9;
            if interval_s <= CORRELATION_INTERVAL_S_MAX {
                let fade = 1.0 - 1.0 / MEMORY_SIGHTINGS;
                self.product = self.product * fade + now * before;
                self.square = self.square * fade + 0.5 * (now * now + before * before);
            }
        } else if self.latest.len() >= SENSOR_TARGETS_MAX {
            self.latest.clear();
        }
        self.latest.insert(seen, (stamp_ns, now));
    }
}

/// The variance that a distance states, never quite zero \[m²\].
pub(super) fn stated(sd_m: f64) -> f64 {
    sd_m.max(SIGHTING_SD_MIN).powi(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The variance that is expected after errors of so many stated deviations.
    fn learned(errors: impl Fn(i64) -> f64) -> f64 {
        let mut sensor = RangeSensor::default();
        for k in 0..3000 {
            let stamp_ns = k * 100_000_000;
            sensor.note(
                SightingTarget::Landmark(0),
                stamp_ns,
                0.1,
                0.1 * errors(k),
                0.0,
            );
        }
        sensor.variance(0.1) / 0.01
    }

    #[test]
    fn independent_errors_count_as_stated() {
        // Period three without correlation of neighbours is not to be had: +, +, −, − has none.
        let variance = learned(|k| if k % 4 < 2 { 1.0 } else { -1.0 });
        assert!((variance - 1.0).abs() < 0.1, "{variance}");
    }

    #[test]
    fn understated_noise_is_found_out() {
        let variance = learned(|k| if k % 4 < 2 { 3.0 } else { -3.0 });
        assert!((variance - 9.0).abs() < 1.5, "{variance}");
    }

    #[test]
    fn errors_that_last_count_for_less() {
        let variance = learned(|k| if k % 20 < 10 { 1.0 } else { -1.0 });
        // ρ = 0.8
        assert!((variance - 9.0).abs() < 1.5, "{variance}");
    }
}
