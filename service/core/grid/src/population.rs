//! The cells of the grid modules: activations of a code, and the interference pattern.

use nalgebra::{Point3, Vector3};

use super::lattice::shortest_turns;
pub use super::tuning::TUNING_WIDTH;

use super::similarity::gaussian_confidence;
use super::{GridCode, GridModules, Lattice, Phase};

/// Preferred phases along each lattice axis.
pub const CELLS_PER_AXIS: usize = 3;

/// Cells of one module.
pub const CELLS_PER_MODULE: usize = CELLS_PER_AXIS * CELLS_PER_AXIS * CELLS_PER_AXIS;

/// Preferred phase of a cell: its index counts thirds of a turn along the first lattice axis, then
/// the second, then the third (the last runs fastest).
pub fn preferred_phase(cell: usize) -> Phase {
    let third = |index: usize| (index % CELLS_PER_AXIS) as f64 / CELLS_PER_AXIS as f64;
    let (row, layer) = (
        cell / CELLS_PER_AXIS,
        cell / (CELLS_PER_AXIS * CELLS_PER_AXIS),
    );
    Phase::wrap(Vector3::new(third(layer), third(row), third(cell)))
}

/// Activations of one module's cells in \[0, 1\]: the Gaussian of seed Eq. 1 of the torus distance
/// d between phase and preferred phase, both in metres.
///
/// ```text
/// a_i = exp(−d² / (2 σ²))        σ = TUNING_WIDTH · spacing
/// ```
pub fn activation(lattice: &Lattice, phase: &Phase) -> [f64; CELLS_PER_MODULE] {
    let sigma_m = TUNING_WIDTH * lattice.spacing_m();
    std::array::from_fn(|cell| {
        let distance_m = lattice.torus_distance_m(phase, &preferred_phase(cell));
        gaussian_confidence(distance_m, sigma_m)
    })
}

/// The vector a ∈ R^(27 M) of all cells' activations, module after module, finest first.
pub fn population_vector(modules: &GridModules, code: &GridCode) -> Vec<f64> {
    let modules = modules.lattices().iter().zip(code.phases());
    modules
        .flat_map(|(lattice, phase)| activation(lattice, phase))
        .collect()
}

/// The interference pattern of a population (seed Eq. 4).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interference {
    /// I = Σ aᵢ cᵢ \[m\].
    pub pattern: Vector3<f64>,
    /// Σ aᵢ.
    pub total: f64,
}

impl Interference {
    /// The normalised form I / Σ aᵢ \[m\], the population vector's estimate of the position in
    /// `map`; `None` when no cell is active.
    pub fn normalised(&self) -> Option<Point3<f64>> {
        (self.total > 0.0).then(|| Point3::from(self.pattern / self.total))
    }
}

/// The interference pattern I = Σ aᵢ cᵢ (seed Eq. 4) of a code.
///
/// A grid cell has many firing fields; its centre cᵢ is that of its field nearest to `around` \[m\]
/// in `map`, the position believed before. The normalised pattern corrects a belief that is wrong
/// by less than half the finest spacing. Measured with the default settings (finest spacing 1 m),
/// it is at most 0.012 m off for a true belief, 0.05 m for one that is 0.2 m off, and 0.2 m for one
/// that is 0.4 m off.
pub fn interference_pattern(
    modules: &GridModules,
    code: &GridCode,
    around: &Point3<f64>,
) -> Interference {
    let mut interference = Interference {
        pattern: Vector3::zeros(),
        total: 0.0,
    };
    for (lattice, phase) in modules.lattices().iter().zip(code.phases()) {
        let here = lattice.locate(around).1;
        for (cell, activation) in activation(lattice, phase).into_iter().enumerate() {
            let away = shortest_turns(&(preferred_phase(cell).turns() - here.turns()));
            let centre = around.coords + lattice.basis() * away;
            interference.pattern += centre * activation;
            interference.total += activation;
        }
    }
    interference
}
