//! A view: what an agent sees at a sample.

use geometry::PoseCovariance;
use nalgebra::{Isometry3, Point3};

use crate::keyframes::SampleKey;

/// What an agent sees at a sample, as a descriptor, and where it is believed to be.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// The sample.
    pub sample: SampleKey,
    /// Pose of the body by motion alone, since the session began.
    pub in_odom: Isometry3<f64>,
    /// Pose of the body in the map.
    pub pose: Isometry3<f64>,
    /// Covariance of the error on the right of that pose.
    pub covariance: PoseCovariance,
    /// Name of the descriptor's channel. Only descriptors of one channel and length are compared.
    pub channel: &'a str,
    /// The descriptor, a unit vector.
    pub vector: &'a [f32],
}

/// How the frame of an agent's odometry is turned in the map about the vertical, by other senses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensedTurn {
    /// The turn \[rad\].
    pub rad: f64,
    /// Its standard deviation, most of which lasts \[rad\].
    pub sd_rad: f64,
}

impl View<'_> {
    /// Position of the body in the map \[m\].
    pub(crate) fn position(&self) -> Point3<f64> {
        self.pose.translation.vector.into()
    }

    /// Roots of the traces of both halves of the covariance \[m, rad\].
    pub(crate) fn spread(&self) -> [f64; 2] {
        spread(&self.covariance)
    }
}

/// Roots of the traces of both halves of a pose's covariance \[m, rad\].
pub(crate) fn spread(covariance: &PoseCovariance) -> [f64; 2] {
    let diagonal = covariance.matrix().diagonal();
    [0, 3].map(|from| diagonal.rows(from, 3).sum().max(0.0).sqrt())
}
