//! The grid state of an agent: every module's reference grid point and phase.

use nalgebra::{Point3, Vector3};
use state::{CorruptState, State, StateReader, StateWriter};

use super::{GridCode, GridModules, Lattice, ModuleState, Phase};

/// All modules' states, finest first.
#[derive(Clone, Debug, PartialEq)]
pub struct GridState(Box<[ModuleState]>);

impl GridModules {
    /// The grid state at a position \[m\] in `map`.
    pub fn locate(&self, position: &Point3<f64>) -> GridState {
        let state = |lattice: &Lattice| {
            let (reference, phase) = lattice.locate(position);
            ModuleState { reference, phase }
        };
        GridState::from_modules(self.lattices().iter().map(state).collect::<Box<[_]>>())
    }
}

impl GridState {
    /// From the states of all modules of a space, finest first.
    pub fn from_modules(modules: impl Into<Box<[ModuleState]>>) -> Self {
        Self(modules.into())
    }

    /// Moves every module by a displacement \[m\] in `map`, and calls `entered` with the index of
    /// each module that came into a new lattice cell and that cell's reference grid point.
    ///
    /// This is path integration: O(modules), whatever the distance and the memory.
    pub fn advance(
        &mut self,
        modules: &GridModules,
        displacement: &Vector3<f64>,
        mut entered: impl FnMut(usize, [i64; 3]),
    ) {
        for (index, (state, lattice)) in self.0.iter_mut().zip(modules.lattices()).enumerate() {
            if state.advance(lattice, displacement) {
                entered(index, state.reference);
            }
        }
    }

    /// The modules' states, finest first.
    pub fn modules(&self) -> &[ModuleState] {
        &self.0
    }

    /// The phases alone.
    pub fn code(&self) -> GridCode {
        GridCode::new(
            self.0
                .iter()
                .map(|module| module.phase)
                .collect::<Box<[_]>>(),
        )
    }

    /// The position \[m\] in `map`: the mean of what the modules say from reference grid point and
    /// phase.
    ///
    /// Unlike a code's, this position is unique. The modules differ by rounding only.
    pub fn decode(&self, modules: &GridModules) -> Point3<f64> {
        let mut sum = Vector3::zeros();
        for (state, lattice) in self.0.iter().zip(modules.lattices()) {
            sum += lattice.position(state.reference, &state.phase).coords;
        }
        Point3::from(sum / self.0.len() as f64)
    }
}

impl State for GridState {
    fn write(&self, out: &mut StateWriter) {
        // At most 16 modules.
        u8::try_from(self.modules().len())
            .expect("settings bound the modules")
            .write(out);
        for module in self.modules() {
            module.reference.write(out);
            module.phase.turns().write(out);
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let mut modules = Vec::new();
        for _ in 0..u8::read(input)? {
            let reference = State::read(input)?;
            let phase = Phase::wrap(State::read(input)?);
            modules.push(ModuleState { reference, phase });
        }
        Ok(Self::from_modules(modules))
    }
}
