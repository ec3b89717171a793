//! The bytes of vectors, poses and the types that are shared all over the map.

use nalgebra::{Isometry3, Point3, SMatrix, Translation3, UnitQuaternion, Vector3, Vector4};

use super::{CorruptState, State, StateReader, StateWriter};
use crate::geometry::{PoseCovariance, upper_triangle};
use crate::grid::{GridState, ModuleState, Phase};
use crate::record::AgentId;
use crate::sample::Label;

impl<const R: usize, const C: usize> State for SMatrix<f64, R, C> {
    fn write(&self, out: &mut StateWriter) {
        for value in self.iter() {
            value.write(out);
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let mut matrix = Self::zeros();
        for value in matrix.iter_mut() {
            *value = State::read(input)?;
        }
        Ok(matrix)
    }
}

impl State for Point3<f64> {
    fn write(&self, out: &mut StateWriter) {
        self.coords.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Vector3::read(input).map(Self::from)
    }
}

impl State for UnitQuaternion<f64> {
    fn write(&self, out: &mut StateWriter) {
        self.coords.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        // Not normalised again: that might change the last bit.
        Vector4::read(input).map(|coords| Self::new_unchecked(coords.into()))
    }
}

impl State for Isometry3<f64> {
    fn write(&self, out: &mut StateWriter) {
        self.translation.vector.write(out);
        self.rotation.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let translation = Translation3::from(Vector3::read(input)?);
        Ok(Self::from_parts(translation, State::read(input)?))
    }
}

impl State for PoseCovariance {
    fn write(&self, out: &mut StateWriter) {
        upper_triangle(self.matrix()).write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self::from_upper_triangle(&State::read(input)?))
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

impl State for AgentId {
    fn write(&self, out: &mut StateWriter) {
        self.0.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        State::read(input).map(Self)
    }
}

impl State for Label {
    fn write(&self, out: &mut StateWriter) {
        // Labels are at most 128 bytes long.
        u8::try_from(self.as_str().len())
            .expect("a label's length fits a byte")
            .write(out);
        out.0.extend(self.as_str().as_bytes());
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let len = u8::read(input)?;
        let text = std::str::from_utf8(input.take(len.into())?);
        text.ok()
            .and_then(|text| Self::new(text).ok())
            .ok_or(CorruptState::Invalid)
    }
}
