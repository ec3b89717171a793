//! Bytes of vectors, matrices, rotations and rigid motions.

use nalgebra::{Isometry3, Point3, SMatrix, Translation3, Unit, UnitQuaternion, Vector3, Vector4};

use crate::{CorruptState, State, StateReader, StateWriter};

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

impl State for Unit<Vector3<f64>> {
    fn write(&self, out: &mut StateWriter) {
        self.as_ref().write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        // Not normalised again: that might change the last bit.
        Vector3::read(input).map(Self::new_unchecked)
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
