//! Whether ellipses hold as many true positions as they promise.

use geometry::PoseCovariance;
use nalgebra::{Isometry3, Vector3};

use crate::nees::squared_distance;

/// What ellipses promise: the probability that the true position lies within.
pub const PROMISED: [f64; 3] = [0.5, 0.9, 0.99];

/// How many true positions in the plane lie within the ellipses of estimated poses.
///
/// An error of covariance P is within the ellipse of probability p where eᵀ P⁻¹ e ≤ −2 ln(1 − p),
/// the quantile of χ² with two degrees of freedom. Where covariances are honest, a share of p is.
/// Truth and estimate are in one frame. Poses that follow one another are wrong together: the share
/// of a single recording is off by more than its count says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Coverage {
    count: u64,
    within: [u64; PROMISED.len()],
}

impl Coverage {
    /// Takes in a true position \[m\] and an estimated pose with the covariance of its error, along
    /// and about its own axes. One whose covariance has no inverse does not count.
    pub fn add(
        &mut self,
        truth_m: &Vector3<f64>,
        estimate: &Isometry3<f64>,
        covariance: &PoseCovariance,
    ) {
        let Some(squared) = squared_distance(truth_m, estimate, covariance) else {
            return;
        };
        self.count += 1;
        for (within, promised) in self.within.iter_mut().zip(PROMISED) {
            *within += u64::from(squared <= -2.0 * (1.0 - promised).ln());
        }
    }

    /// Takes in what another has.
    pub fn add_all(&mut self, other: &Self) {
        self.count += other.count;
        for (within, more) in self.within.iter_mut().zip(other.within) {
            *within += more;
        }
    }

    /// How many poses count.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The share within each of the ellipses [`PROMISED`]; `None` of nothing.
    pub fn shares(&self) -> Option<[f64; PROMISED.len()]> {
        let share = |within: u64| within as f64 / self.count as f64;
        (self.count > 0).then(|| self.within.map(share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector6;

    /// The ellipses of a robot that heads along y: 1 m ahead, 0.1 m aside.
    fn of(offs_m: &[(f64, f64)]) -> Coverage {
        let quarter = Vector3::z() * std::f64::consts::FRAC_PI_2;
        let sd = Vector6::new(1.0, 0.1, 0.0, 0.0, 0.0, 0.02);
        let estimate = Isometry3::new(Vector3::new(2.0, 3.0, 0.5), quarter);
        let mut coverage = Coverage::default();
        for &(x, y) in offs_m {
            let truth = Vector3::new(2.0 + x, 3.0 + y, 0.0);
            coverage.add(&truth, &estimate, &PoseCovariance::from_sd(&sd));
        }
        coverage
    }

    #[test]
    fn ellipses_lie_along_the_axes_of_the_robot() {
        // Half of a normal distribution in a plane is within 1.177 deviations, 90 % within 2.146
        // and 99 % within 3.035.
        let coverage = of(&[
            (0.0, 1.17),
            (0.0, 1.18),
            (0.214, 0.0),
            (0.303, 0.0),
            (0.304, 0.0),
        ]);
        assert_eq!(coverage.count(), 5);
        assert_eq!(coverage.shares(), Some([0.2, 0.6, 0.8]));
        let mut twice = coverage;
        twice.add_all(&of(&[(1.0, 0.0)]));
        assert_eq!(
            (twice.count(), twice.shares().map(|all| all[2])),
            (6, Some(4.0 / 6.0))
        );
    }

    #[test]
    fn what_is_known_without_error_does_not_count() {
        let mut coverage = Coverage::default();
        let here = Isometry3::identity();
        coverage.add(&Vector3::zeros(), &here, &PoseCovariance::zero());
        assert_eq!((coverage.count(), coverage.shares()), (0, None));
    }
}
