//! The state of one grid module.

use nalgebra::Vector3;

use super::{Lattice, Phase};

/// Where one module stands: its reference grid point and the phase within that point's cell.
///
/// The integer part is kept apart from the phase, so precision does not fade with distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModuleState {
    /// Lattice index of the reference grid point.
    pub reference: [i64; 3],
    /// Phase in its cell.
    pub phase: Phase,
}

impl ModuleState {
    /// Moves by a displacement \[m\] in `map`; true when that entered a new lattice cell, whose
    /// corner is the new reference grid point (seed, section 3.1 D).
    ///
    /// Indices are exact for positions up to 10⁸ m at 1 mm spacing, and far beyond; they stop at
    /// the ends of `i64` instead of wrapping.
    pub fn advance(&mut self, lattice: &Lattice, displacement: &Vector3<f64>) -> bool {
        let turns = self.phase.turns() + lattice.phase_displacement(displacement);
        if let Some(phase) = Phase::within_cell(&turns) {
            self.phase = phase;
            return false;
        }
        let (cells, phase) = Phase::split(&turns);
        self.phase = phase;
        for (index, cells) in self.reference.iter_mut().zip(cells) {
            *index = index.saturating_add(cells);
        }
        cells != [0; 3]
    }
}
