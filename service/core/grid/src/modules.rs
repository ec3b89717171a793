//! The grid modules of a space.

use nalgebra::{Quaternion, UnitQuaternion};

use super::Lattice;

/// The two turns whose powers are the modules' orientations, before normalising (w, x, y, z).
const TURNS: [[f64; 4]; 2] = [[5.0, -1.0, 0.0, -1.0], [4.0, 0.0, -1.0, 2.0]];

/// Number and spacings of grid modules.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridSettings {
    /// Number of modules, 1 to 16.
    pub modules: usize,
    /// Spacing of the finest module \[m\].
    pub spacing_m: f64,
    /// Ratio of the spacings of neighbouring modules, above 1 (1.4 to 1.7 in rats: Stensola et al.
    /// 2012).
    pub ratio: f64,
}

impl Default for GridSettings {
    fn default() -> Self {
        Self {
            modules: 6,
            spacing_m: 1.2,
            ratio: 1.618,
        }
    }
}

/// The modules' lattices: the immutable geometry of a space's grid cells.
///
/// Module m has spacing d₀ rᵐ and orientation Aᵐ Bᵐ, where A and B are two fixed rotations. They
/// were found by a search over small whole quaternions for the largest angle between the axes (the
/// directions to the twelve nearest lattice points) of any two modules: 10° with 6 modules, 3.7°
/// with 16. There are two of them because the powers of one rotation would leave its own axis where
/// it is, and along that direction all modules would see the same lattice, only scaled.
///
/// The orientations are the same in every space, not drawn from its seed: codes of spaces with
/// equal spacings can then be compared, and no seed gives a worse code than another. Powers of
/// whole quaternions take only multiplications and square roots, which are bit-identical on all
/// machines.
#[derive(Clone, Debug, PartialEq)]
pub struct GridModules(Box<[Lattice]>);

impl GridModules {
    /// The modules that the settings ask for, finest first.
    pub fn new(settings: &GridSettings) -> Self {
        let [first, second] = TURNS.map(|[w, x, y, z]| {
            UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)).into_inner()
        });
        let mut spacing_m = settings.spacing_m;
        let mut orientation = Quaternion::identity();
        let mut lattices = Vec::with_capacity(settings.modules);
        for _ in 0..settings.modules {
            lattices.push(Lattice::new(
                spacing_m,
                UnitQuaternion::new_normalize(orientation),
            ));
            spacing_m *= settings.ratio;
            // From Aᵐ Bᵐ to Aᵐ⁺¹ Bᵐ⁺¹.
            orientation = first * orientation * second;
        }
        Self(lattices.into())
    }

    /// The lattices, finest first; there is at least one.
    pub fn lattices(&self) -> &[Lattice] {
        &self.0
    }
}
