//! The plane in which all places of a model lie.

use nalgebra::{Matrix3, Point3, Vector3};

use super::tuning::FLAT_SHARE;
use crate::numeric::centroid;

/// The normal of the plane in which all places lie, if they do.
pub(crate) fn plane_normal(felt: &[Point3<f64>]) -> Option<Vector3<f64>> {
    let middle = centroid(felt.iter().map(|position| position.coords));
    let spread = felt.iter().map(|position| {
        let apart = position.coords - middle;
        apart * apart.transpose()
    });
    let axes = spread.sum::<Matrix3<f64>>().symmetric_eigen();
    let (least, value) = axes.eigenvalues.argmin();
    let is_flat = value < FLAT_SHARE * axes.eigenvalues.max();
    is_flat.then(|| axes.eigenvectors.column(least).into_owned())
}
