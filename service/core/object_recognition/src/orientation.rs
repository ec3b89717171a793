//! Prior over the rotation between the episode's frame and a model's.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{UnitQuaternion, Vector3};

/// Prior over the rotation from the episode's frame into a model's.
#[derive(Clone, Debug, PartialEq)]
pub enum Orientation {
    /// The frames are parallel.
    Known,
    /// One of these, all equally likely: `map_from_episode`.
    Finite(Vec<UnitQuaternion<f64>>),
    /// Any rotation.
    Free,
}

impl Orientation {
    /// The 24 rotations of a cube.
    pub fn cube() -> Self {
        let quarter = |axis: Vector3<f64>, turns: u8| {
            UnitQuaternion::new(axis * (FRAC_PI_2 * f64::from(turns)))
        };
        // Six directions of the z axis, four rotations about each.
        let tilts = [
            quarter(Vector3::x(), 0),
            quarter(Vector3::x(), 1),
            quarter(Vector3::x(), 2),
            quarter(Vector3::x(), 3),
            quarter(Vector3::y(), 1),
            quarter(Vector3::y(), 3),
        ];
        let all = tilts
            .iter()
            .flat_map(|tilt| (0..4).map(move |turns| tilt * quarter(Vector3::z(), turns)));
        Self::Finite(all.collect())
    }

    /// The rotations, if there are finitely many.
    pub(crate) fn rotations(&self) -> Option<Vec<UnitQuaternion<f64>>> {
        match self {
            Self::Known => Some(vec![UnitQuaternion::identity()]),
            Self::Finite(rotations) => Some(rotations.clone()),
            Self::Free => None,
        }
    }
}
