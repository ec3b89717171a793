//! Jacobians of measurements, of which most columns are zero.

use nalgebra::SMatrix;

/// The part of a measurement's Jacobian that belongs to neighbouring components of the state.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block<const M: usize> {
    /// First component.
    pub(super) offset: usize,
    /// Number of components, at most 6.
    pub(super) width: usize,
    /// The Jacobian; columns from `width` on do not count.
    pub(super) jacobian: SMatrix<f64, M, 6>,
}
