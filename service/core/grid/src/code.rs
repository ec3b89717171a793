//! Grid codes: the phases of all modules, whole or with modules erased.

use nalgebra::Point3;

use super::{GridModules, Phase};

/// The phases of all modules of a space, finest first.
#[derive(Clone, Debug, PartialEq)]
pub struct GridCode(Box<[Phase]>);

impl GridModules {
    /// The grid code at a position \[m\] in `map`.
    pub fn code_at(&self, position: &Point3<f64>) -> GridCode {
        let phases = self
            .lattices()
            .iter()
            .map(|lattice| lattice.locate(position).1);
        GridCode::new(phases.collect::<Box<[_]>>())
    }
}

impl GridCode {
    /// From the phases of all modules, finest first.
    pub fn new(phases: impl Into<Box<[Phase]>>) -> Self {
        Self(phases.into())
    }

    /// The phases, finest module first.
    pub fn phases(&self) -> &[Phase] {
        &self.0
    }
}

/// A grid code of which some modules may be unknown; at least one is known.
#[derive(Clone, Debug, PartialEq)]
pub struct PartialCode(Box<[Option<Phase>]>);

/// Why phases are not a code of a space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidCode {
    /// The space has another number of modules.
    #[error("the code has {given} modules where the space has {expected}")]
    WrongModuleCount {
        /// Modules of the space.
        expected: usize,
        /// Modules of the code.
        given: usize,
    },
    /// Every module is erased.
    #[error("the code has no module at all")]
    Empty,
}

impl PartialCode {
    /// From one entry per module of the space, finest first; `None` is an erased module.
    ///
    /// # Errors
    /// The number of entries is not the number of modules, or all of them are erased.
    pub fn new(modules: &GridModules, phases: Vec<Option<Phase>>) -> Result<Self, InvalidCode> {
        let expected = modules.lattices().len();
        let given = phases.len();
        if given != expected {
            return Err(InvalidCode::WrongModuleCount { expected, given });
        }
        if phases.iter().all(Option::is_none) {
            return Err(InvalidCode::Empty);
        }
        Ok(Self(phases.into()))
    }

    /// The entries, finest module first.
    pub fn phases(&self) -> &[Option<Phase>] {
        &self.0
    }
}

impl From<&GridCode> for PartialCode {
    /// A whole code: nothing is erased.
    fn from(code: &GridCode) -> Self {
        Self(code.phases().iter().copied().map(Some).collect())
    }
}
