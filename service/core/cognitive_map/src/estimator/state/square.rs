//! The bytes of square matrices.

use ::state::{CorruptState, State, StateReader, StateWriter};

/// Whether a matrix is the same to the last bit with rows for columns.
fn is_symmetric(dim: usize, entries: &[f64]) -> bool {
    let mirror = |at: usize| entries[at % dim * dim + at / dim];
    (0..entries.len()).all(|at| entries[at].to_bits() == mirror(at).to_bits())
}

/// Writes one half of a symmetric matrix, unless rounding made the halves differ.
pub(super) fn write_square(dim: usize, entries: &[f64], out: &mut StateWriter) {
    let is_symmetric = is_symmetric(dim, entries);
    is_symmetric.write(out);
    for row in 0..dim {
        let first = if is_symmetric { row } else { 0 };
        for entry in &entries[row * dim + first..(row + 1) * dim] {
            entry.write(out);
        }
    }
}

pub(super) fn read_square(
    dim: usize,
    input: &mut StateReader<'_>,
) -> Result<Vec<f64>, CorruptState> {
    let is_half = bool::read(input)?;
    let mut entries = vec![0.0; dim * dim];
    for row in 0..dim {
        let first = if is_half { row } else { 0 };
        for column in first..dim {
            let entry = f64::read(input)?;
            entries[row * dim + column] = entry;
            if is_half {
                entries[column * dim + row] = entry;
            }
        }
    }
    if is_half == is_symmetric(dim, &entries) {
        Ok(entries)
    } else {
        Err(CorruptState::Invalid)
    }
}
