//! Legs: from one place to the next.

use crate::memory::ids::PlaceId;
use nalgebra::{Isometry3, Vector3};

use geometry::PoseCovariance;
use grid::{GridModules, octant};
use state::state_of_struct;

/// A leg: the way from one place to the next, as motion measured it.
#[derive(Clone, Debug, PartialEq)]
pub struct Leg {
    pub(super) from: PlaceId,
    pub(super) to: PlaceId,
    pub(super) relative: Isometry3<f64>,
    pub(super) covariance: PoseCovariance,
    pub(super) displacement: Vector3<f64>,
    pub(super) duration_s: f64,
    pub(super) length_m: f64,
}

state_of_struct!(Leg {
    from,
    to,
    relative,
    covariance,
    displacement,
    duration_s,
    length_m
});

impl Leg {
    /// Place at the start.
    pub fn from(&self) -> PlaceId {
        self.from
    }

    /// Place at the end.
    pub fn to(&self) -> PlaceId {
        self.to
    }

    /// Pose at the end, in the body frame at the start.
    ///
    /// The agent enters a place somewhere within its field, so this is the way between the poses of
    /// entering, not between the places' positions. The legs of a trip compose to the way of the
    /// whole trip.
    pub fn relative(&self) -> &Isometry3<f64> {
        &self.relative
    }

    /// Covariance of [`Leg::relative`] in the body frame at the end; it counts this leg's motion
    /// alone.
    pub fn covariance(&self) -> &PoseCovariance {
        &self.covariance
    }

    /// Displacement along the axes of `map` \[m\], as known when the leg was travelled.
    pub fn displacement(&self) -> &Vector3<f64> {
        &self.displacement
    }

    /// Phase displacement of each grid module, finest first \[turns along the lattice axes\].
    ///
    /// Phases are linear in displacement: the sum of the steps' phase displacements is that of the
    /// sum of the steps. So nothing is accumulated per module while the leg is under way.
    pub fn phase_displacement(&self, modules: &GridModules) -> Vec<Vector3<f64>> {
        let lattices = modules.lattices().iter();
        lattices
            .map(|lattice| lattice.phase_displacement(&self.displacement))
            .collect()
    }

    /// Octant of the displacement in `map`, 1 to 8.
    pub fn octant(&self) -> u8 {
        octant::octant_of(&self.displacement)
    }

    /// Duration on the sensor's clock \[s\].
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Length of the path \[m\].
    pub fn length_m(&self) -> f64 {
        self.length_m
    }
}
