//! What was measured of a target at a keyframe.

use nalgebra::{Isometry3, Matrix3};

use super::seen_point::{SeenPoint, lever_covariance};
use super::seen_range::SeenRange;
use geometry::PoseCovariance;
use state::state_of_enum;

/// What was measured of a target at a keyframe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Observation {
    /// Its position.
    Point(SeenPoint),
    /// Its distance.
    Range(SeenRange),
}

state_of_enum!(Observation {
    Point(point) = 0,
    Range(range) = 1
});

impl Observation {
    /// Sum of the variances of its components \[m²\].
    pub(super) fn spread(&self) -> f64 {
        match self {
            Self::Point(point) => point.covariance().trace(),
            Self::Range(range) => range.variance(),
        }
    }

    /// By how much its variance would grow with the error of a motion, as a part of it.
    pub(super) fn loss(&self, covariance: &PoseCovariance) -> f64 {
        let blur = match self {
            Self::Point(point) => lever_covariance(&point.position, covariance).trace(),
            Self::Range(range) => range.blur(&range.antenna, covariance),
        };
        blur / self.spread()
    }

    /// As from the keyframe from which a motion with this covariance led to where it was made.
    pub(super) fn before(&self, motion: &Isometry3<f64>, covariance: &PoseCovariance) -> Self {
        match self {
            Self::Point(point) => Self::Point(point.before(motion, covariance)),
            Self::Range(range) => Self::Range(range.before(motion, covariance)),
        }
    }

    /// As from the keyframe to which a motion led from where it was made.
    pub(super) fn after(&self, motion: &Isometry3<f64>, covariance: &PoseCovariance) -> Self {
        match self {
            Self::Point(point) => Self::Point(point.after(motion, covariance)),
            Self::Range(range) => Self::Range(range.after(motion, covariance)),
        }
    }

    /// The mean of two observations of one target that were made from one place, if they are of one
    /// kind and may be taken together.
    pub(super) fn mean(&self, other: &Self) -> Option<Self> {
        match (self, other) {
            (Self::Point(one), Self::Point(other)) => one.mean(other).map(Self::Point),
            (Self::Range(one), Self::Range(other)) => one.mean(other).map(Self::Range),
            _ => None,
        }
    }

    /// Adds noise of the target's position along the axes of the keyframe \[m²\].
    pub(super) fn add_noise(&mut self, noise: &Matrix3<f64>) {
        match self {
            Self::Point(point) => point.fresh += noise,
            Self::Range(range) => {
                let apart = range.at.map(|at| at - range.antenna);
                let direction = apart.and_then(|apart| apart.try_normalize(f64::EPSILON));
                range.fresh += match direction {
                    Some(direction) => direction.dot(&(noise * direction)).max(0.0),
                    None => noise.trace() / 3.0,
                };
            }
        }
    }
}
