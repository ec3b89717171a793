//! Prior over the rotation between the episode's frame and a model's.

use std::f64::consts::{FRAC_PI_2, TAU};

use nalgebra::{UnitQuaternion, Vector3};

use crate::tuning::YAW_TURNS;

/// Prior over the rotation from the episode's frame into a model's.
#[derive(Clone, Debug, PartialEq)]
pub enum Orientation {
    /// The frames are parallel.
    Known,
    /// One of these, all equally likely: `map_from_episode`.
    Finite(Vec<UnitQuaternion<f64>>),
    /// Any rotation.
    Free,
    /// Any rotation about the z axis that both frames share, as of what stands on a table.
    Yaw,
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
            Self::Yaw => {
                let turn = |at: u16| Vector3::z() * (TAU * f64::from(at) / f64::from(YAW_TURNS));
                Some((0..YAW_TURNS).map(turn).map(UnitQuaternion::new).collect())
            }
            Self::Free => None,
        }
    }

    /// Standard deviation of a rotation about the z axis that one of [`rotations`](Self::rotations)
    /// stands for \[rad\].
    pub(crate) fn yaw_sd_rad(&self) -> f64 {
        match self {
            Self::Yaw => TAU / f64::from(YAW_TURNS) / 12.0_f64.sqrt(),
            Self::Known | Self::Finite(_) | Self::Free => 0.0,
        }
    }
}
