//! What an agent's sightings turn out to be worth, against what they state.

use std::collections::BTreeMap;

use super::innovation::PointInnovation;
use super::parameters::Parameters;
use super::tuning::{
    CORRELATION_INTERVAL_S_MAX, CORRELATION_SQUARE_MIN, LASTING_OVER_STATED_MAX, LASTING_S,
    LEARNED_ERROR_MAX, MEMORY_SIGHTINGS, PRIOR_LASTING_SIGHTINGS, PRIOR_SIGHTINGS,
    SENSOR_SCALE_MAX, SENSOR_TARGETS_MAX, SIGHTING_INTERVAL_S_MIN,
};
use nalgebra::Vector3;

/// What is seen.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum SightingTarget {
    /// A landmark, by its number within the frame.
    Landmark(u64),
    /// An agent, by its number.
    Agent(u64),
}

/// How far to trust an agent's sensor.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sensor {
    /// Variances of distances and of directions, as multiples of the stated ones; at least one.
    pub(super) scales: [f64; 2],
    /// Sightings behind the scales.
    pub(super) counts: [f64; 2],
    /// Sum of products of consecutive normalised errors of distance of one target.
    pub(super) product: f64,
    /// Sum of their squares.
    pub(super) square: f64,
    /// Stamp \[ns\] and normalised error of distance of each target's latest sighting.
    pub(super) latest: BTreeMap<SightingTarget, (i64, f64)>,
}

impl Default for Sensor {
    fn default() -> Self {
        Self {
            scales: [1.0; 2],
            counts: [PRIOR_SIGHTINGS; 2],
            product: PRIOR_LASTING_SIGHTINGS,
            square: PRIOR_LASTING_SIGHTINGS,
            latest: BTreeMap::new(),
        }
    }
}

impl Sensor {
    /// Variances of the components of a sighting of a target; `None` of one that is seen for the
    /// first time.
    ///
    /// Errors of distance that last (a marker seen at a slant, a lens) cannot be averaged away;
    /// they grow with the distance d. How much of such an error is assumed goes by the correlation
    /// ρ of successive errors of one target, which is learned, from 1 on. An error that fades over
    /// a time τ and is seen every Δ seconds counts as an independent one whose variance is larger
    /// by its power at low frequencies, coth(Δ/2τ), so that looking more often tells no more:
    ///
    /// ```text
    /// σ_r² = s_r (σ² + ρ min(e d, 3 σ)² coth(Δ/2τ))      σ_b² = s_b σ²
    /// ```
    pub(super) fn variance(
        &self,
        innovation: &PointInnovation,
        seen: Option<(&SightingTarget, i64)>,
        parameters: &Parameters,
    ) -> Vector3<f64> {
        let stated = innovation.variance;
        if !innovation.is_polar {
            return stated * self.scales[0];
        }
        let lasting = (parameters.lasting_range_error * innovation.distance_m).powi(2);
        let most = LASTING_OVER_STATED_MAX.powi(2) * stated[0];
        let repeated = seen.map_or(1.0, |(target, stamp_ns)| self.repeated(target, stamp_ns));
        let range = stated[0] + self.correlation() * lasting.min(most) * repeated;
        let [by_range, by_bearing] = self.scales;
        Vector3::new(
            range * by_range,
            stated[1] * by_bearing,
            stated[2] * by_bearing,
        )
    }

    /// By how much a lasting error counts for more, as it was in the latest sighting, too.
    fn repeated(&self, target: &SightingTarget, stamp_ns: i64) -> f64 {
        self.latest.get(target).map_or(1.0, |&(before_ns, _)| {
            let interval_s = stamp_ns.saturating_sub(before_ns) as f64 * 1e-9;
            let interval_s = interval_s.max(SIGHTING_INTERVAL_S_MIN);
            (0.5 * interval_s / LASTING_S).tanh().recip()
        })
    }

    /// Correlation of successive errors of distance of one target, from 0 to 1.
    fn correlation(&self) -> f64 {
        // Where errors have been exactly zero for ever, nothing is left of what was assumed at
        // first.
        (self.product / self.square.max(CORRELATION_SQUARE_MIN)).clamp(0.0, 1.0)
    }

    /// A sighting of a target was expected with these variances from the estimate alone (`spread`)
    /// and from the sensor (`variance`).
    pub(super) fn note(
        &mut self,
        seen: SightingTarget,
        stamp_ns: i64,
        innovation: &PointInnovation,
        spread: &Vector3<f64>,
        variance: &Vector3<f64>,
    ) {
        let components = if innovation.is_polar { 2 } else { 1 };
        for k in 0..components {
            // Where the estimate is vague, the innovation tells about the estimate.
            if spread[k] > variance[k] {
                continue;
            }
            let expected = variance[k] / self.scales[k];
            let squared = innovation.residual[k]
                .powi(2)
                .min(LEARNED_ERROR_MAX * LEARNED_ERROR_MAX * (variance[k] + spread[k]));
            let ratio = (squared - spread[k]) / expected;
            let (scale, count) = (&mut self.scales[k], &mut self.counts[k]);
            *count = (*count + 1.0).min(MEMORY_SIGHTINGS);
            *scale = (*scale + (ratio - *scale) / *count).clamp(1.0, SENSOR_SCALE_MAX);
        }
        if !innovation.is_polar || spread[0] > variance[0] {
            return;
        }
        let now = (innovation.residual[0] / innovation.variance[0].sqrt())
            .clamp(-LEARNED_ERROR_MAX, LEARNED_ERROR_MAX);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::{RangeBearing, Relation};

    fn innovation(range_m: f64) -> PointInnovation {
        let seen = RangeBearing::new(range_m, 0.0, 0.0, 0.1, 0.02).unwrap();
        PointInnovation::new(&Relation::RangeBearing(seen), &Vector3::new(4.0, 0.0, 0.0)).unwrap()
    }

    /// Feeds a sensor with errors of distance and answers the variance that it then expects.
    fn learned(error: impl Fn(u32) -> f64) -> f64 {
        let mut sensor = Sensor::default();
        let parameters = Parameters::default();
        for k in 0..3000 {
            let seen = innovation(4.0 + error(k));
            let variance = sensor.variance(&seen, None, &parameters);
            sensor.note(
                SightingTarget::Landmark(0),
                i64::from(k) * 1_000_000_000,
                &seen,
                &Vector3::zeros(),
                &variance,
            );
        }
        sensor.variance(&innovation(4.0), None, &parameters)[0]
    }

    #[test]
    fn errors_that_change_sign_count_as_stated() {
        let variance = learned(|k| if k % 2 == 0 { 0.1 } else { -0.1 });
        assert!((variance / 0.01 - 1.0).abs() < 0.05, "{variance}");
    }

    #[test]
    fn errors_that_last_count_up_to_three_times_what_is_stated() {
        let variance = learned(|_| 0.1);
        assert!((variance / (0.01 + 0.09) - 1.0).abs() < 0.1, "{variance}");
    }

    #[test]
    fn understated_noise_is_found_out() {
        let variance = learned(|k| if k % 2 == 0 { 0.4 } else { -0.4 });
        assert!((variance / 0.16 - 1.0).abs() < 0.2, "{variance}");
    }
}
