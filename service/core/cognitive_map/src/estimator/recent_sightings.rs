//! Where an agent saw known landmarks lately.
//!
//! What was seen before is where odometry has it by now. The latest sightings judge the agent's
//! pose together ([`consensus`](super::consensus)), when single ones contradict it.

use nalgebra::{Isometry3, Point3};

use super::outcome::Step;
use super::tuning::RECENT_SIGHTINGS_MAX;
use crate::input::Label;

/// The latest sightings of known landmarks, of each landmark one, the oldest first.
#[derive(Clone, Debug)]
pub(super) struct RecentSightings {
    pub(super) seen: Vec<RecentSighting>,
    /// Motion since the first of all, as corrected.
    pub(super) way: Isometry3<f64>,
    /// Variance of its noise along an axis, and about one \[m², rad²\].
    pub(super) noise: [f64; 2],
    /// Sightings taken in, those that are not kept any more among them.
    pub(super) count: u64,
}

/// Where a landmark was seen.
#[derive(Clone, Debug)]
pub(super) struct RecentSighting {
    pub(super) label: Label,
    /// Where it was seen, in the frame in which the way begins \[m\].
    pub(super) point: Point3<f64>,
    /// How far from the body \[m\].
    pub(super) distance_m: f64,
    /// Of the sighting along an axis \[m²\].
    pub(super) variance: f64,
    /// The noise of the way until then.
    pub(super) noise: [f64; 2],
    /// Sightings taken in before.
    pub(super) number: u64,
    /// Whether it was refused.
    pub(super) is_refused: bool,
}

/// A sighting as it is by now.
#[derive(Clone, Debug)]
pub(super) struct SeenPoint {
    pub(super) label: Label,
    /// In the body frame \[m\].
    pub(super) in_body: Point3<f64>,
    /// How far from the body it was seen \[m\].
    pub(super) distance_m: f64,
    /// Of the sighting along an axis \[m²\].
    pub(super) variance: f64,
    /// What the noise of the motion since then adds \[m²\].
    pub(super) motion_variance: f64,
    /// Sightings since then.
    pub(super) age: u64,
    /// Whether it was refused.
    pub(super) is_refused: bool,
}

impl Default for RecentSightings {
    fn default() -> Self {
        Self {
            seen: Vec::new(),
            way: Isometry3::identity(),
            noise: [0.0; 2],
            count: 0,
        }
    }
}

impl RecentSightings {
    /// The agent moved.
    #[inline]
    pub(super) fn go(&mut self, step: &Step) {
        if self.seen.is_empty() {
            return;
        }
        self.way *= step.increment;
        self.way.rotation.renormalize_fast();
        let variance = &step.variance;
        self.noise[0] += variance[0].max(variance[1]).max(variance[2]);
        self.noise[1] += variance[3].max(variance[4]).max(variance[5]);
    }

    /// Takes in a sighting of a point of the body frame, which moved by `back` since.
    pub(super) fn push(
        &mut self,
        label: &Label,
        point: &Point3<f64>,
        back: &Isometry3<f64>,
        variance: f64,
        is_refused: bool,
    ) {
        if self.seen.is_empty() {
            *self = Self::default();
        }
        // What is taken for a landmark again says nothing new.
        self.seen.retain(|seen| seen.label != *label);
        if self.seen.len() >= RECENT_SIGHTINGS_MAX {
            self.seen.remove(0);
        }
        self.seen.push(RecentSighting {
            label: label.clone(),
            point: self.way * back.inverse_transform_point(point),
            distance_m: point.coords.norm(),
            variance,
            noise: self.noise,
            number: self.count,
            is_refused,
        });
        self.count += 1;
    }

    /// These fit, after all.
    pub(super) fn fit(&mut self, fit: &[SeenPoint]) {
        for seen in &mut self.seen {
            if fit.iter().any(|fit| fit.label == seen.label) {
                seen.is_refused = false;
            }
        }
    }

    /// Whether a landmark's latest sighting fits where the agent is.
    pub(super) fn fits(&self, label: &Label) -> bool {
        let latest = self.seen.iter().find(|seen| seen.label == *label);
        latest.is_some_and(|seen| !seen.is_refused)
    }

    /// They as they are by now, the oldest first.
    pub(super) fn by_now(&self) -> Vec<SeenPoint> {
        let by_now = |seen: &RecentSighting| {
            let in_body = self.way.inverse_transform_point(&seen.point);
            let [along, about] = [0, 1].map(|k| self.noise[k] - seen.noise[k]);
            SeenPoint {
                label: seen.label.clone(),
                in_body,
                distance_m: seen.distance_m,
                variance: seen.variance,
                motion_variance: along + about * in_body.coords.norm_squared(),
                age: self.count.saturating_sub(seen.number + 1),
                is_refused: seen.is_refused,
            }
        };
        self.seen.iter().map(by_now).collect()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Vector3, Vector6};

    use super::*;

    fn label(number: usize) -> Label {
        Label::new(&format!("post {number}")).unwrap()
    }

    fn step(increment: Isometry3<f64>) -> Step {
        Step {
            increment,
            variance: Vector6::repeat(0.01),
            ..Step::none()
        }
    }

    #[test]
    fn what_was_seen_moves_with_the_body() {
        let mut recent = RecentSightings::default();
        let point = Point3::new(2.0, 1.0, 0.5);
        let back = Isometry3::translation(0.25, 0.0, 0.0);
        recent.push(&label(0), &point, &back, 0.04, true);
        let now = &recent.by_now()[0];
        // It was seen before the last quarter of a metre.
        assert!((now.in_body - Point3::new(1.75, 1.0, 0.5)).norm() < 1e-12);
        assert!(now.motion_variance == 0.0 && now.is_refused);
        let turned = Isometry3::new(Vector3::x(), Vector3::z() * std::f64::consts::FRAC_PI_2);
        recent.go(&step(turned));
        let now = &recent.by_now()[0];
        assert!((now.in_body - Point3::new(1.0, -0.75, 0.5)).norm() < 1e-12);
        let moved = 0.01 * (1.0 + now.in_body.coords.norm_squared());
        assert!((now.motion_variance - moved).abs() < 1e-12);
        assert!((now.distance_m - point.coords.norm()).abs() < 1e-12);
    }

    #[test]
    fn of_each_landmark_the_latest_sighting_is_kept() {
        let mut recent = RecentSightings::default();
        let here = Isometry3::identity();
        for number in 0..2 * RECENT_SIGHTINGS_MAX {
            let point = Point3::new(number as f64, 1.0, 0.0);
            recent.push(&label(number % 3), &point, &here, 0.04, false);
            assert!(recent.seen.len() <= 3);
        }
        for number in 0..2 * RECENT_SIGHTINGS_MAX {
            recent.push(
                &label(number),
                &Point3::new(0.0, 1.0, 0.0),
                &here,
                0.04,
                false,
            );
        }
        let labels: Vec<Label> = recent.seen.iter().map(|seen| seen.label.clone()).collect();
        let latest = RECENT_SIGHTINGS_MAX..2 * RECENT_SIGHTINGS_MAX;
        assert_eq!(labels, latest.map(label).collect::<Vec<_>>());
    }
}
