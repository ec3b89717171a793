//! What was seen from an anchor.

use nalgebra::{Isometry3, Matrix3, SMatrix, Vector3};

use crate::geometry::PoseCovariance;
use crate::sample::Relation;
use crate::state::{CorruptState, State, StateReader, StateWriter, state_of_struct};

/// Least deviation of a sighting, so that one that states none has an inverse \[m\].
const DEVIATION_MIN_M: f64 = 1e-3;
/// Shortest distance at which a direction means something \[m\].
const DISTANCE_MIN_M: f64 = 0.02;

/// What was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shown {
    /// A landmark, by number.
    Landmark(u32),
    /// An agent, at this place in the frame of one of its anchors.
    Agent(u32, Vector3<f64>),
}

/// A position seen from an anchor.
#[derive(Clone, Debug)]
pub(super) struct Sighting {
    /// The anchor from which, and the next sighting made there.
    pub(super) anchor: u32,
    pub(super) next: u32,
    pub(super) shown: Shown,
    /// The next sighting that shows the same anchor.
    pub(super) next_shown: u32,
    pub(super) point: SeenPoint,
    /// Of how many sightings this is the mean.
    pub(super) count: u32,
}

/// A position in the frame of an anchor \[m\], with its covariance \[m²\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SeenPoint {
    pub(super) position: Vector3<f64>,
    pub(super) covariance: Matrix3<f64>,
}

state_of_struct!(SeenPoint {
    position,
    covariance
});
state_of_struct!(Sighting {
    anchor,
    next,
    shown,
    next_shown,
    point,
    count
});

impl State for Shown {
    fn write(&self, out: &mut StateWriter) {
        match self {
            Self::Landmark(landmark) => {
                0_u8.write(out);
                landmark.write(out);
            }
            Self::Agent(anchor, lever) => {
                1_u8.write(out);
                anchor.write(out);
                lever.write(out);
            }
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        match u8::read(input)? {
            0 => u32::read(input).map(Self::Landmark),
            1 => Ok(Self::Agent(State::read(input)?, State::read(input)?)),
            _ => Err(CorruptState::Invalid),
        }
    }
}

impl SeenPoint {
    /// Of a relation, with the variances of its components: along the axes \[m²\], or of the distance \[m²\] and of the
    /// two angles about the seen direction, along growing azimuth and elevation \[rad²\].
    pub(super) fn new(relation: &Relation, variance: &Vector3<f64>) -> Self {
        let floor = DEVIATION_MIN_M * DEVIATION_MIN_M;
        let (position, axes, variance) = match relation {
            Relation::Position(seen) => (*seen.translation_m(), Matrix3::identity(), *variance),
            Relation::Pose(seen) => {
                let turn = seen.pose().rotation.to_rotation_matrix().into_inner();
                (seen.pose().translation.vector, turn, *variance)
            }
            Relation::RangeBearing(seen) => {
                let (sin_azimuth, cos_azimuth) = seen.azimuth_rad().sin_cos();
                let (sin_elevation, cos_elevation) = seen.elevation_rad().sin_cos();
                let forward = Vector3::new(
                    cos_elevation * cos_azimuth,
                    cos_elevation * sin_azimuth,
                    sin_elevation,
                );
                let left = Vector3::new(-sin_azimuth, cos_azimuth, 0.0);
                let up = forward.cross(&left);
                let range_m = seen.range_m().max(DISTANCE_MIN_M);
                let square = range_m * range_m;
                (
                    forward * range_m,
                    Matrix3::from_columns(&[forward, left, up]),
                    variance.component_mul(&Vector3::new(1.0, square, square)),
                )
            }
        };
        let variance = variance.map(|variance| variance + floor);
        let covariance = axes * Matrix3::from_diagonal(&variance) * axes.transpose();
        Self {
            position,
            covariance: symmetric(&covariance),
        }
    }

    /// The point in the frame of an anchor from which a motion with this covariance led to where it was seen:
    /// Δ exp(ξ) p.
    pub(super) fn before(&self, motion: &Isometry3<f64>, covariance: &PoseCovariance) -> Self {
        let turn = motion.rotation.to_rotation_matrix().into_inner();
        let spread = self.covariance + swing(&self.position, covariance);
        Self {
            position: turn * self.position + motion.translation.vector,
            covariance: symmetric(&(turn * spread * turn.transpose())),
        }
    }

    /// The point in the frame of the anchor to which a motion led from where it was seen: exp(−ξ) Δ⁻¹ p.
    pub(super) fn after(&self, motion: &Isometry3<f64>, covariance: &PoseCovariance) -> Self {
        let back = motion.rotation.to_rotation_matrix().into_inner().transpose();
        let position = back * (self.position - motion.translation.vector);
        let spread = back * self.covariance * back.transpose();
        Self {
            position,
            covariance: symmetric(&(spread + swing(&position, covariance))),
        }
    }

    /// The mean of two points, weighted by their information.
    pub(super) fn mean(&self, other: &Self) -> Option<Self> {
        let (own, others) = (
            self.covariance.try_inverse()?,
            other.covariance.try_inverse()?,
        );
        let covariance = symmetric(&(own + others).try_inverse()?);
        let shift = covariance * (others * (other.position - self.position));
        Some(Self {
            position: self.position + shift,
            covariance,
        })
    }
}

/// What an error ξ of a pose does to a point p in its frame, ρ + φ×p: the covariance of that.
pub(super) fn swing(point: &Vector3<f64>, covariance: &PoseCovariance) -> Matrix3<f64> {
    let mut jacobian = SMatrix::<f64, 3, 6>::zeros();
    jacobian.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
    let lever = -point.cross_matrix();
    jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&lever);
    jacobian * covariance.matrix() * jacobian.transpose()
}

pub(super) fn symmetric(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    (matrix + matrix.transpose()) * 0.5
}
