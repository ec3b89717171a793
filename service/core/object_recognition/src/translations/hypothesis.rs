//! One hypothesis where the rotation is one of a few: a Gaussian over translations.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::object_id::ObjectId;
use crate::tuning::MERGE_CELL_SD;
use crate::variant::{Variant, VariantId};

/// Bits of a cell's number along an axis; cells that differ by more are far beyond any map.
const AXIS_BITS: u32 = 24;
/// Bits of a cell's number.
pub(crate) const CELL_BITS: u32 = 3 * AXIS_BITS;

/// One hypothesis: a Gaussian over the translation, its mass being e^`evidence`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TranslationHypothesis {
    pub(crate) object: ObjectId,
    pub(crate) variant: Variant,
    pub(crate) rotation: u16,
    /// The episode's origin in the model's frame \[m\].
    pub(crate) translation: Vector3<f64>,
    /// Variance of the translation per axis \[m²\]: all of its terms are isotropic.
    pub(crate) variance_m2: f64,
    /// Log-likelihood of the contacts so far, with the factor for the object's size.
    pub(crate) evidence: f64,
    /// Where the contacts after the first fell.
    pub(crate) falls: Falls,
}

/// Expected numbers of contacts with a model whose contacts fell on places alone.
///
/// A contact counts on both sides by its probabilities, as in a quasi-Bayes procedure (Makov &
/// Smith 1977, A quasi-Bayes unsupervised learning procedure for priors).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Falls {
    /// In gaps between places.
    pub(crate) gaps: f32,
    /// On places.
    pub(crate) places: f32,
    /// Beyond what was felt.
    pub(crate) beyond: f32,
}

impl TranslationHypothesis {
    /// The model and its rotation.
    pub(crate) fn map(&self) -> (VariantId, u16) {
        (self.of(), self.rotation)
    }

    /// The model.
    pub(crate) fn of(&self) -> VariantId {
        VariantId {
            object: self.object,
            variant: self.variant,
        }
    }

    /// Its mean pose.
    pub(crate) fn pose(&self, rotations: &[UnitQuaternion<f64>]) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::from(self.translation),
            rotations[usize::from(self.rotation)],
        )
    }

    /// Cell of the translation: hypotheses of one map and cell are merged.
    pub(crate) fn cell(&self) -> u128 {
        // The width of a cell is rounded down to a power of two, the exponent's bits alone, so that
        // hypotheses of about the same variance have the same cells.
        const EXPONENT: u64 = 0x7FF0_0000_0000_0000;
        /// 1.5 · 2⁵²: adding it leaves the nearest whole number in the low bits.
        const WHOLE: f64 = 6_755_399_441_055_744.0;
        const AXIS: u64 = (1 << AXIS_BITS) - 1;
        let cell = MERGE_CELL_SD * self.variance_m2.sqrt().max(1e-12);
        let per_cell = 1.0 / f64::from_bits(cell.to_bits() & EXPONENT);
        let at = self
            .translation
            .map(|x| (x * per_cell + WHOLE).to_bits() & AXIS);
        at.iter()
            .fold(0, |key, at| key << AXIS_BITS | u128::from(*at))
    }
}
