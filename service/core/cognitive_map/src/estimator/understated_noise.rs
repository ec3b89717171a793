//! What a sensor states too little of its noise, by how its sightings repeat.
//!
//! A sensor that states far too little contradicts the map, and so is not taken in and judged there
//! ([`Sensor`](super::sensor::Sensor)); but its sightings contradict one another, too. Two of one
//! landmark in succession differ by the sensor's noise and by odometry's, whatever the map is. The
//! factors f, of distances and of directions, follow a low quantile of that, so that false
//! sightings count little, by steps of ln f, with odometry as noisy as it is assumed to be:
//!
//! ```text
//! u = ν² / (q₁ + q₂ + r + f₁ q₃ + f₂ q₄)      of the component where it is largest
//! ln f ← ln f + η (p if u > χ²_p, else p − 1)      ln f ≥ 0      η ↓ with the number of pairs
//! ```
//!
//! with the parts of the residual's variance that [`OdometryNoise`](super::odometry_noise) learns
//! from. Before some have repeated, no sensor is believed to be better than a centimetre or a
//! hundredth of a radian. A stated variance counts for f/4 at least: half of a deviation is left to
//! the map.

use super::innovation::PointInnovation;
use super::sighting_pair::{Residual, sensor_part};
use super::tuning::{
    UNDERSTATED_LOG_MAX, UNDERSTATED_PAIRS, UNDERSTATED_PAIRS_FIRST, UNDERSTATED_QUANTILE,
    UNDERSTATED_SD_FIRST, UNDERSTATED_SD_MAX, UNDERSTATED_SHARE, UNDERSTATED_STEP,
};

/// Factors of what an agent's sensor states of its noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct UnderstatedNoise {
    /// Logarithms of the factors of the variances of seen distances and directions.
    pub(super) log_factors: [f64; 2],
    /// Pairs of sightings so far.
    pub(super) pairs: u32,
}

impl UnderstatedNoise {
    /// What stated variances of distances and directions count for at least.
    fn least(&self) -> [f64; 2] {
        self.log_factors
            .map(|log| (UNDERSTATED_SHARE * log.exp()).max(1.0))
    }

    /// A sighting with the variances that its sensor turns out to have at least.
    ///
    /// Who contradicts itself by more than a bad sensor does is no sensor: beyond that, what is
    /// stated stands.
    pub(super) fn as_sensed(&self, mut innovation: PointInnovation) -> PointInnovation {
        let least = self.least();
        for k in 0..3 {
            let part = sensor_part(innovation.is_polar, k) - 2;
            let lever_m = if part == 0 {
                innovation.distance_m.max(1.0)
            } else {
                1.0
            };
            let most = (UNDERSTATED_SD_MAX * lever_m).powi(2);
            let is_new = self.pairs < UNDERSTATED_PAIRS_FIRST;
            let first = if is_new { UNDERSTATED_SD_FIRST } else { 0.0 };
            let stated = innovation.variance[k].max(first * first);
            let turned_out = stated * least[part];
            innovation.variance[k] = if turned_out <= most {
                turned_out
            } else {
                stated
            };
        }
        innovation
    }

    /// Gives the sensor's parts of a residual what they are at least.
    pub(super) fn scale(&self, residual: &mut Residual) {
        let [distances, directions] = self.least();
        residual.parts[2] *= distances;
        residual.parts[3] *= directions;
    }

    /// Learns from two sightings of a landmark in succession.
    pub(super) fn learn(&mut self, residuals: &[Residual]) {
        let [of_distances, of_directions] = self.log_factors.map(f64::exp);
        let normalised = |residual: &Residual| {
            let [by_lengths, by_angles, distances, directions] = residual.parts.into();
            let sensor = of_distances * distances + of_directions * directions;
            residual.square / (by_lengths + by_angles + residual.rest + sensor)
        };
        let (quantiles, share) = UNDERSTATED_QUANTILE;
        let (first, least) = UNDERSTATED_STEP;
        let size = (first / (1.0 + f64::from(self.pairs) / UNDERSTATED_PAIRS)).max(least);
        self.pairs = self.pairs.saturating_add(1);
        for (is_angle, log) in [false, true].into_iter().zip(&mut self.log_factors) {
            let own = residuals.iter().filter(|own| own.is_angle == is_angle);
            let (most, count) = own.fold((0.0_f64, 0_usize), |(most, count), own| {
                (most.max(normalised(own)), count + 1)
            });
            let Some(quantile) = count.checked_sub(1).and_then(|count| quantiles.get(count)) else {
                continue;
            };
            let is_more = most > *quantile;
            let step = if is_more { share } else { share - 1.0 };
            *log = (*log + size * step).clamp(0.0, UNDERSTATED_LOG_MAX);
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector4;
    use random::Seeded;

    use super::*;

    /// What distances count for after pairs of sightings with errors of so many stated deviations,
    /// of which some are false, beside odometry with this variance.
    fn least(errors: f64, false_share: f64, odometry: f64) -> [f64; 2] {
        let mut random = Seeded(3);
        let mut noise = UnderstatedNoise::default();
        for _ in 0..1000 {
            let mut seen = || {
                let is_false = random.uniform() < false_share;
                let sd = if is_false { 1000.0 } else { errors };
                sd * random.normal()
            };
            let mut residual = |is_angle: bool| Residual {
                square: (seen() - seen()).powi(2),
                parts: if is_angle {
                    Vector4::new(0.0, odometry, 0.0, 2.0)
                } else {
                    Vector4::new(odometry, 0.0, 2.0, 0.0)
                },
                rest: 0.0,
                is_angle,
            };
            noise.learn(&[residual(false), residual(true)]);
        }
        noise.least()
    }

    #[test]
    fn what_is_stated_about_right_counts_as_it_is_stated() {
        for errors in [0.0, 0.5, 1.0] {
            for false_share in [0.0, 0.1, 0.2] {
                let least = least(errors, false_share, 0.0);
                assert!(
                    least.iter().all(|least| *least <= 1.0),
                    "{errors}: {least:?}"
                );
            }
        }
    }

    #[test]
    fn what_is_understated_is_found_out_to_a_factor() {
        for errors in [10.0, 100.0] {
            for false_share in [0.0, 0.2] {
                for least in least(errors, false_share, 0.0) {
                    let part = least / (errors * errors);
                    assert!(
                        (0.04..1.0).contains(&part),
                        "{errors} {false_share}: {part}"
                    );
                }
            }
        }
    }

    #[test]
    fn what_odometry_explains_is_not_the_sensors() {
        // Its errors, and the sensor's, which are a tenth of them.
        let least = least(10.0, 0.0, 200.0);
        assert!(least.iter().all(|least| *least < 2.0), "{least:?}");
    }
}
