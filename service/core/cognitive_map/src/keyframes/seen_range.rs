//! Distances measured at a keyframe.

use nalgebra::{Isometry3, Vector3};

use super::seen_point::lever_covariance;
use super::tuning;
use crate::input::Range;
use geometry::PoseCovariance;
use state::state_of_struct;

/// A distance measured from a point in the frame of a keyframe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SeenRange {
    /// Where the antenna was in the frame of the keyframe \[m\].
    pub(super) antenna: Vector3<f64>,
    pub(super) range_m: f64,
    /// Variance of the noise, which is independent each time \[m²\].
    pub(super) fresh: f64,
    /// Variance of the bias, which is the same each time from the same place \[m²\].
    pub(super) lasting: f64,
    /// Where the target was in that frame, as the estimate had it then, if it was known \[m\]:
    /// where a relaxation begins.
    pub(super) at: Option<Vector3<f64>>,
}

state_of_struct!(SeenRange {
    antenna,
    range_m,
    fresh,
    lasting,
    at
});

impl SeenRange {
    /// Of a distance, with its variance \[m²\], and where its target is in the body frame. The part
    /// beyond what it states is bias.
    pub(super) fn new(range: &Range, variance: f64, at: Option<Vector3<f64>>) -> Self {
        let stated = range.range_sd_m() * range.range_sd_m();
        let fresh = stated.min(variance);
        let floor = tuning::SIGHTING_SD_MIN_M * tuning::SIGHTING_SD_MIN_M;
        Self {
            antenna: *range.antenna_m(),
            range_m: range.range_m(),
            fresh: fresh + floor,
            lasting: (variance - fresh).max(0.0),
            at,
        }
    }

    /// Variance of the whole error \[m²\].
    pub(super) fn variance(&self) -> f64 {
        self.fresh + self.lasting
    }

    /// Variance of the distance by the error of a motion, on its right, to where the antenna is at
    /// `antenna`: along the direction of the target, or the mean of all directions.
    pub(super) fn blur(&self, antenna: &Vector3<f64>, covariance: &PoseCovariance) -> f64 {
        let spread = lever_covariance(antenna, covariance);
        let apart = self
            .at
            .map(|at| (at - self.antenna).try_normalize(f64::EPSILON));
        match apart.flatten() {
            Some(direction) => direction.dot(&(spread * direction)).max(0.0),
            None => spread.trace() / 3.0,
        }
    }

    /// The distance as from the keyframe from which a motion with this covariance led to where it
    /// was measured: the antenna was at Δ exp(ξ) a.
    pub(super) fn before(&self, motion: &Isometry3<f64>, covariance: &PoseCovariance) -> Self {
        let carried =
            |point: &Vector3<f64>| motion.transform_vector(point) + motion.translation.vector;
        Self {
            antenna: carried(&self.antenna),
            at: self.at.as_ref().map(carried),
            fresh: self.fresh + self.blur(&self.antenna, covariance),
            ..*self
        }
    }

    /// The distance as from the keyframe to which a motion led from where it was measured: the
    /// antenna was at exp(−ξ) Δ⁻¹ a.
    pub(super) fn after(&self, motion: &Isometry3<f64>, covariance: &PoseCovariance) -> Self {
        let back = motion.inverse();
        let carried = |point: &Vector3<f64>| back.transform_vector(point) + back.translation.vector;
        let moved = Self {
            antenna: carried(&self.antenna),
            at: self.at.as_ref().map(carried),
            ..*self
        };
        let fresh = moved.fresh + moved.blur(&moved.antenna, covariance);
        Self { fresh, ..moved }
    }

    /// The mean of two distances from almost one place, weighted by their noise, if they agree: one
    /// that was reflected stays apart. It keeps the smaller bias.
    ///
    /// Places s apart at the distance d make an error of s²/8d at most, which must be less than the
    /// noise.
    pub(super) fn mean(&self, other: &Self) -> Option<Self> {
        let apart_m = (self.antenna - other.antenna).norm();
        let fresh = (self.fresh + other.fresh).sqrt();
        let most = apart_m + tuning::RANGES_AGREE_SD * fresh;
        let nearest = self.range_m.min(other.range_m);
        let is_near = apart_m * apart_m <= 8.0 * nearest * self.fresh.min(other.fresh).sqrt();
        if !is_near || (self.range_m - other.range_m).abs() > most {
            return None;
        }
        let share = self.fresh / (self.fresh + other.fresh);
        Some(Self {
            antenna: self.antenna.lerp(&other.antenna, share),
            range_m: self.range_m + share * (other.range_m - self.range_m),
            fresh: self.fresh * (1.0 - share),
            lasting: self.lasting.min(other.lasting),
            at: other.at.or(self.at),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector6;

    fn range(range_m: f64, at: Vector3<f64>) -> SeenRange {
        let range = Range::new(range_m, 0.1, [0.3, -0.2, 0.5]).unwrap();
        SeenRange::new(&range, 0.03, Some(at))
    }

    /// A distance moved to another keyframe is still that from the antenna to the target.
    #[test]
    fn a_distance_is_the_same_from_any_keyframe() {
        let at = Vector3::new(4.0, 3.0, -1.0);
        let seen = range((at - Vector3::new(0.3, -0.2, 0.5)).norm(), at);
        let motion = Isometry3::new(Vector3::new(1.0, -2.0, 0.5), Vector3::new(0.3, -0.2, 2.0));
        let covariance = PoseCovariance::from_sd(&Vector6::repeat(0.1));
        for moved in [
            seen.before(&motion, &covariance),
            seen.after(&motion, &covariance),
        ] {
            let distance = (moved.at.unwrap() - moved.antenna).norm();
            assert!((distance - seen.range_m).abs() < 1e-12);
            // Along one direction, a motion of 0.1 m, and turns of 0.1 about levers of 0.6 m and 4
            // m.
            let gained = moved.fresh - seen.fresh;
            assert!((0.01..0.5).contains(&gained), "{gained}");
            assert!((moved.lasting - seen.lasting).abs() < 1e-15);
        }
        let back = seen.before(&motion, &PoseCovariance::zero());
        let back = back.after(&motion, &PoseCovariance::zero());
        assert!((back.antenna - seen.antenna).norm() < 1e-12);
    }

    #[test]
    fn distances_that_agree_become_one_and_a_reflection_stays_apart() {
        let at = Vector3::new(5.0, 0.0, 0.0);
        let (one, other) = (range(4.7, at), range(4.9, at));
        let mean = one.mean(&other).unwrap();
        assert!((mean.range_m - 4.8).abs() < 1e-12);
        assert!((mean.fresh - 0.5 * one.fresh).abs() < 1e-12);
        assert!((mean.lasting - one.lasting).abs() < 1e-12);
        assert!(one.mean(&range(19.7, at)).is_none());
        let far = SeenRange {
            antenna: one.antenna + Vector3::y() * 3.0,
            ..one
        };
        assert!(one.mean(&far).is_none());
    }
}
