//! One hypothesis where the rotation is one of a few: a Gaussian over translations.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::library::ObjectId;
use crate::tuning::MERGE_CELL_SD;

/// One hypothesis: a Gaussian over the translation, its mass being e^`evidence`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TranslationHypothesis {
    pub(crate) object: ObjectId,
    pub(crate) rotation: u16,
    /// The episode's origin in the model's frame \[m\].
    pub(crate) translation: Vector3<f64>,
    /// Variance of the translation per axis \[m²\]: all of its terms are isotropic.
    pub(crate) variance_m2: f64,
    /// Log-likelihood of the contacts so far, without the share of the model within a step.
    pub(crate) evidence: f64,
}

impl TranslationHypothesis {
    /// Its mean pose.
    pub(crate) fn pose(&self, rotations: &[UnitQuaternion<f64>]) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::from(self.translation),
            rotations[usize::from(self.rotation)],
        )
    }

    /// Object, rotation and cell of the translation: hypotheses with one key are merged.
    pub(crate) fn key(&self) -> u128 {
        /// Bits of a cell's number along an axis; cells that differ by more are far beyond any map.
        const BITS: u32 = 26;
        // The width of a cell is rounded down to a power of two, the exponent's bits alone, so that
        // hypotheses of about the same variance have the same cells.
        const EXPONENT: u64 = 0x7FF0_0000_0000_0000;
        let cell = MERGE_CELL_SD * self.variance_m2.sqrt().max(1e-12);
        let per_cell = 1.0 / f64::from_bits(cell.to_bits() & EXPONENT);
        #[expect(clippy::cast_possible_truncation, reason = "saturates")]
        let at = self.translation.map(|x| (x * per_cell).round() as i64);
        let map = u128::from(self.object.0) << 16 | u128::from(self.rotation);
        at.iter().fold(map, |key, at| {
            key << BITS | u128::from(at.cast_unsigned() & ((1 << BITS) - 1))
        })
    }
}
