//! Innovations: measurements against their predictions by a graph.

use nalgebra::{Isometry3, Matrix3, SMatrix, SVector, Vector3};

use super::information::{PoseInformation, PositionInformation};
use geometry::{PoseCovariance, log_jacobian, se3, seen_by_pose};

/// Share of the largest information below which a direction counts as not measured.
const MEASURED: f64 = 1e-9;

/// One pose in the frame of another, as a graph expects it.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpectedPose {
    /// The second pose in the frame of the first.
    pub transform: Isometry3<f64>,
    /// Covariance of the ξ in T = T̂ exp(ξ).
    pub covariance: PoseCovariance,
}

/// A point in the frame of a pose, as a graph expects it.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpectedPosition {
    /// Where \[m\].
    pub position: Vector3<f64>,
    /// Covariance in the axes of the pose \[m²\].
    pub covariance: Matrix3<f64>,
}

/// The difference between a measurement and what was expected.
///
/// With the difference r, the expectation's covariance C and the measurement's information Ω its
/// square is rᵀ (C + Ω⁻¹)⁻¹ r, the normalised innovation squared (NIS). Where both tell the truth
/// it is distributed as χ² with as many degrees of freedom as directions were measured (Bar-Shalom,
/// Li & Kirubarajan 2001, Sec. 5.4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation {
    /// The square.
    pub squared: f64,
    /// Directions that were measured.
    pub degrees: usize,
}

impl Innovation {
    /// The square that a true measurement exceeds as seldom as a normal variable exceeds
    /// `deviations` standard deviations, to the accuracy of Wilson & Hilferty (1931): d (1 − 2/9d +
    /// z √(2/9d))³.
    pub fn limit(degrees: usize, deviations: f64) -> f64 {
        let d = degrees as f64;
        let ninth = 2.0 / (9.0 * d.max(1.0));
        d * (1.0 - ninth + deviations * ninth.sqrt()).max(0.0).powi(3)
    }
}

impl ExpectedPose {
    /// Of a pose that is reached from the second by a motion with this noise.
    #[must_use]
    pub fn after(&self, motion: &Isometry3<f64>, noise: &PoseCovariance) -> Self {
        let moved = se3::adjoint(&motion.inverse());
        let covariance = moved * self.covariance.matrix() * moved.transpose() + noise.matrix();
        Self {
            transform: self.transform * motion,
            covariance: PoseCovariance::from_upper_part(&covariance),
        }
    }

    /// The first pose in the frame of the second.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let moved = se3::adjoint(&self.transform);
        let covariance = moved * self.covariance.matrix() * moved.transpose();
        Self {
            transform: self.transform.inverse(),
            covariance: PoseCovariance::from_upper_part(&covariance),
        }
    }

    /// How far a measurement is from it. `None` if the numbers are too large to say.
    pub fn innovation(
        &self,
        measured: &Isometry3<f64>,
        information: &PoseInformation,
    ) -> Option<Innovation> {
        let difference = se3::twist(&measured.inv_mul(&self.transform));
        let (linear, angular) = se3::split(&difference);
        let jacobian = log_jacobian(&linear, &angular);
        let covariance = jacobian * self.covariance.matrix() * jacobian.transpose();
        innovation(&difference, &covariance, information.matrix())
    }
}

impl ExpectedPosition {
    /// As seen from a pose that is reached from the first by a motion with this noise.
    #[must_use]
    pub fn seen_after(&self, motion: &Isometry3<f64>, noise: &PoseCovariance) -> Self {
        let position = motion.inverse_transform_point(&self.position.into()).coords;
        let turn = motion.rotation.inverse().to_rotation_matrix().into_inner();
        let moved = seen_by_pose(&position);
        let noise = moved * noise.matrix() * moved.transpose();
        Self {
            position,
            covariance: turn * self.covariance * turn.transpose() + noise,
        }
    }

    /// How far a measurement is from it. `None` if the numbers are too large to say.
    pub fn innovation(
        &self,
        measured: &Vector3<f64>,
        information: &PositionInformation,
    ) -> Option<Innovation> {
        let difference = self.position - measured;
        innovation(&difference, &self.covariance, information.matrix())
    }
}

/// rᵀ (C + Ω⁻¹)⁻¹ r = rᵀ (1 + Ω C)⁻¹ Ω r, which needs no inverse of Ω.
fn innovation<const N: usize>(
    difference: &SVector<f64, N>,
    covariance: &SMatrix<f64, N, N>,
    information: &SMatrix<f64, N, N>,
) -> Option<Innovation>
where
    nalgebra::Const<N>: nalgebra::DimMin<nalgebra::Const<N>, Output = nalgebra::Const<N>>,
{
    // Scaled by the measurement's own deviations, so that metres and radians are numbers of one
    // size.
    let scale = information
        .diagonal()
        .map(|entry| if entry > 0.0 { 1.0 / entry.sqrt() } else { 1.0 });
    let scaled = SMatrix::from_diagonal(&scale);
    let information = scaled * information * scaled;
    let unscaled = SMatrix::from_diagonal(&scale.map(|entry| 1.0 / entry));
    let covariance = unscaled * covariance * unscaled;
    let difference = unscaled * difference;
    let sum = SMatrix::identity() + information * covariance;
    let weighed = sum.lu().solve(&(information * difference))?;
    let squared = difference.dot(&weighed).max(0.0);
    let directions = information.diagonal();
    let most = directions.max();
    let degrees = directions
        .iter()
        .filter(|entry| **entry > MEASURED * most)
        .count();
    squared
        .is_finite()
        .then_some(Innovation { squared, degrees })
}
