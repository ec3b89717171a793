//! The normal equations of one link.

use nalgebra::{Matrix6, Vector6};

/// Normal equations of one link at given poses: to second order in the motions δ of its nodes the
/// link costs
///
/// ```text
/// s + 2 Σ gₐᵀ δₐ + Σ δₐᵀ Hₐᵦ δᵦ
/// ```
///
/// Points fill the first three rows.
#[derive(Clone, Debug)]
pub(super) struct NormalBlocks {
    pub(super) from_from: Matrix6<f64>,
    /// Rows of the node that was measured, columns of the one that measured.
    pub(super) to_from: Matrix6<f64>,
    pub(super) to_to: Matrix6<f64>,
    pub(super) from_gradient: Vector6<f64>,
    pub(super) to_gradient: Vector6<f64>,
    /// Of a motion: what its calibration adds.
    pub(super) by_calibration: Option<CalibrationBlocks>,
}

/// The blocks of a link's calibration.
#[derive(Clone, Debug)]
pub(super) struct CalibrationBlocks {
    pub(super) own: Matrix6<f64>,
    /// Rows of the node, columns of the calibration.
    pub(super) from: Matrix6<f64>,
    pub(super) to: Matrix6<f64>,
    pub(super) gradient: Vector6<f64>,
}

impl NormalBlocks {
    /// Of a link that says nothing.
    pub(super) fn zero() -> Self {
        Self {
            from_from: Matrix6::zeros(),
            to_from: Matrix6::zeros(),
            to_to: Matrix6::zeros(),
            from_gradient: Vector6::zeros(),
            to_gradient: Vector6::zeros(),
            by_calibration: None,
        }
    }
}
