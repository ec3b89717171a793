//! One hypothesis where the rotation is free: a pose with its evidence.

use geometry::se3;
use nalgebra::{Isometry3, Matrix6};

use crate::object_id::ObjectId;
use crate::tuning::{NEAR_EXTENT, NEAR_RAD, SAME_POSE};

/// One hypothesis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PoseHypothesis {
    pub(crate) object: ObjectId,
    /// From the frame of the episode's first contact into that of the surfel map.
    pub(crate) pose: Isometry3<f64>,
    /// As [`PoseFit::score`](crate::surfels::pose_fit::PoseFit::score), over all contacts.
    pub(crate) score: f64,
    /// Of an error on the left of the pose: translation \[1/m²\], then rotation \[1/rad²\].
    pub(crate) information: Matrix6<f64>,
}

impl PoseHypothesis {
    /// Log of the mass of the mode, m³, by Laplace's approximation: its peak times √det(2π H⁻¹).
    pub(crate) fn evidence(&self) -> f64 {
        let log_det = self.information.cholesky().map_or(0.0, |cholesky| {
            2.0 * cholesky.l_dirty().diagonal().map(f64::ln).sum()
        });
        self.score - 0.5 * log_det + 3.0 * std::f64::consts::TAU.ln()
    }

    /// Whether a pose is so near that refinement would lead to this one.
    pub(crate) fn is_near(&self, other: &Isometry3<f64>, extent_m: f64) -> bool {
        let apart = other.translation.vector - self.pose.translation.vector;
        self.pose.rotation.angle_to(&other.rotation) < NEAR_RAD
            && apart.norm() < NEAR_EXTENT * extent_m
    }

    /// Whether two hypotheses lie within each other's information.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        self.object == other.object && self.holds(&other.pose) && other.holds(&self.pose)
    }

    /// Whether a pose lies within the information of this one.
    fn holds(&self, other: &Isometry3<f64>) -> bool {
        let twist = se3::twist(&(other * self.pose.inverse()));
        twist.dot(&(self.information * twist)) < SAME_POSE
    }
}
