//! How well contacts fit a model from one pose, and which way the pose should move.

use geometry::se3;
use nalgebra::{Isometry3, Matrix6, Vector6};

use crate::surfels::local_surface::MotionTerms;
use crate::tuning::STEP_RAD_MAX;

/// Contacts from one pose: their score, and the normal equations of a motion on the pose's left.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PoseFit {
    /// Σ log density per metre of depth and steradian, times the model's area: a contact drawn
    /// evenly from the surface has 0 on average.
    pub(crate) score: f64,
    /// Information about the motion, from depths and normals, and the prior.
    pub(crate) information: Matrix6<f64>,
    /// The same, damped by the curvature of the model's edges.
    normal_matrix: Matrix6<f64>,
    gradient: Vector6<f64>,
}

impl PoseFit {
    /// Without contacts.
    pub(crate) fn new() -> Self {
        Self {
            score: 0.0,
            information: Matrix6::zeros(),
            normal_matrix: Matrix6::zeros(),
            gradient: Vector6::zeros(),
        }
    }

    /// Adds what one contact says of a motion.
    pub(crate) fn add(&mut self, terms: &MotionTerms) {
        self.information += terms.information;
        self.normal_matrix += terms.damping;
        self.gradient += terms.gradient;
    }

    /// Adds the prior: the model lies within its extent of the contacts, turned by any angle.
    pub(crate) fn add_prior(&mut self, extent_m: f64) {
        let prior = Vector6::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0) / (extent_m * extent_m)
            + Vector6::new(0.0, 0.0, 0.0, 0.25, 0.25, 0.25);
        self.information += Matrix6::from_diagonal(&prior);
        self.normal_matrix += self.information;
    }

    /// The pose one Gauss-Newton step on.
    pub(crate) fn step(&self, pose: &Isometry3<f64>) -> Isometry3<f64> {
        let Some(cholesky) = self.normal_matrix.cholesky() else {
            return *pose;
        };
        let (linear, angular) = se3::split(&cholesky.solve(&self.gradient));
        let scale = (STEP_RAD_MAX / angular.norm().max(1e-12)).min(1.0);
        se3::exp(&(linear * scale), &(angular * scale)) * pose
    }
}
