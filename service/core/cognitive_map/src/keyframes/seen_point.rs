//! A position as it was seen from a keyframe.

use nalgebra::{Isometry3, Matrix3, Vector3};

use super::tuning;
use crate::input::Relation;
use geometry::{PoseCovariance, beside, symmetric};
use state::state_of_struct;

/// A position in the frame of a keyframe \[m\], with the covariance of its error \[m²\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SeenPoint {
    pub(super) position: Vector3<f64>,
    /// Covariance of the noise, which is independent each time.
    pub(super) fresh: Matrix3<f64>,
    /// Covariance of the bias, which is the same each time that the point is seen from the same
    /// place.
    pub(super) lasting: Matrix3<f64>,
}

state_of_struct!(SeenPoint {
    position,
    fresh,
    lasting
});

impl SeenPoint {
    /// Of a relation, with the variances of its components: along the axes \[m²\], or of the
    /// distance \[m²\] and of the two angles about the seen direction, along growing azimuth and
    /// elevation \[rad²\]. The part beyond what the relation states is bias.
    pub(super) fn new(relation: &Relation, variance: &Vector3<f64>) -> Self {
        let floor = tuning::SIGHTING_SD_MIN_M * tuning::SIGHTING_SD_MIN_M;
        let (position, axes, scale) = match relation {
            Relation::Position(seen) => (
                *seen.translation_m(),
                Matrix3::identity(),
                Vector3::repeat(1.0),
            ),
            Relation::Pose(seen) => (
                seen.pose().translation.vector,
                seen.pose().rotation.to_rotation_matrix().into_inner(),
                Vector3::repeat(1.0),
            ),
            Relation::RangeBearing(seen) => {
                let (forward, left, ..) = seen.directions();
                let range_m = seen.range_m().max(tuning::DIRECTION_DISTANCE_MIN_M);
                (
                    forward * range_m,
                    Matrix3::from_columns(&[forward, left, forward.cross(&left)]),
                    Vector3::new(1.0, range_m * range_m, range_m * range_m),
                )
            }
            // In any direction.
            Relation::Range(seen) => (*seen.antenna_m(), Matrix3::identity(), Vector3::repeat(1.0)),
        };
        let fresh = stated_variance(relation).inf(variance);
        let lasting = variance - fresh;
        let in_body = |variance: &Vector3<f64>| {
            let along = Matrix3::from_diagonal(&variance.component_mul(&scale));
            symmetric(&(axes * along * axes.transpose()))
        };
        Self {
            position,
            fresh: in_body(&fresh) + Matrix3::from_diagonal_element(floor),
            lasting: in_body(&lasting),
        }
    }

    /// Covariance of the whole error \[m²\].
    pub(super) fn covariance(&self) -> Matrix3<f64> {
        self.fresh + self.lasting
    }

    /// The point in the frame of the keyframe from which a motion with this covariance led to where
    /// it was seen: Δ exp(ξ) p.
    pub(super) fn before(&self, motion: &Isometry3<f64>, covariance: &PoseCovariance) -> Self {
        let turn = motion.rotation.to_rotation_matrix().into_inner();
        let fresh = self.fresh + lever_covariance(&self.position, covariance);
        Self {
            position: turn * self.position + motion.translation.vector,
            fresh: symmetric(&(turn * fresh * turn.transpose())),
            lasting: symmetric(&(turn * self.lasting * turn.transpose())),
        }
    }

    /// The point in the frame of the keyframe to which a motion led from where it was seen: exp(−ξ)
    /// Δ⁻¹ p.
    pub(super) fn after(&self, motion: &Isometry3<f64>, covariance: &PoseCovariance) -> Self {
        let back = motion
            .rotation
            .to_rotation_matrix()
            .into_inner()
            .transpose();
        let position = back * (self.position - motion.translation.vector);
        let fresh = back * self.fresh * back.transpose() + lever_covariance(&position, covariance);
        Self {
            position,
            fresh: symmetric(&fresh),
            lasting: symmetric(&(back * self.lasting * back.transpose())),
        }
    }

    /// The mean of two points that were seen from one place, weighted by their noise. It keeps the
    /// smaller bias.
    pub(super) fn mean(&self, other: &Self) -> Option<Self> {
        let own = self.fresh.try_inverse()?;
        let others = other.fresh.try_inverse()?;
        let fresh = symmetric(&(own + others).try_inverse()?);
        let shift = fresh * (others * (other.position - self.position));
        let is_surer = other.lasting.trace() < self.lasting.trace();
        Some(Self {
            position: self.position + shift,
            fresh,
            lasting: if is_surer {
                other.lasting
            } else {
                self.lasting
            },
        })
    }
}

/// Variances of a relation's components as it states them \[m², or m², rad², rad²\]; of a distance
/// alone, those of a point that lies so far off in any direction.
pub(super) fn stated_variance(relation: &Relation) -> Vector3<f64> {
    let sd = match relation {
        Relation::Position(seen) => *seen.sd_m(),
        Relation::Pose(seen) => seen.noise().sd().fixed_rows::<3>(0).into_owned(),
        Relation::RangeBearing(seen) => {
            let bearing = seen.bearing_sd_rad();
            Vector3::new(seen.range_sd_m(), bearing, bearing)
        }
        Relation::Range(seen) => Vector3::repeat(seen.range_m().hypot(seen.range_sd_m())),
    };
    sd.component_mul(&sd)
}

/// Covariance of ρ + φ×p: the effect of a pose error ξ = (ρ, φ) on a point p in its frame.
pub(super) fn lever_covariance(point: &Vector3<f64>, covariance: &PoseCovariance) -> Matrix3<f64> {
    let jacobian = beside(&Matrix3::identity(), &-point.cross_matrix());
    jacobian * covariance.matrix() * jacobian.transpose()
}
