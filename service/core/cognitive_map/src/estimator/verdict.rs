//! Whether a sighting counted.

use nalgebra::Vector6;

/// What became of a sighting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Verdict {
    /// The target is new.
    Learned,
    /// It counted: normalised innovation squared, before any weighting, and number of components.
    Accepted {
        /// Normalised innovation squared.
        nis: f64,
        /// Number of components.
        components: u32,
    },
    /// It did not.
    Refused,
    /// A distance was too long, as that of a reflection is: it says nothing, against nobody.
    Reflected,
    /// It waits for others that say where the target is.
    Pending,
}

impl Verdict {
    /// Whether what was seen is worth to be remembered.
    pub(super) fn is_accepted(self) -> bool {
        !matches!(self, Self::Refused | Self::Reflected)
    }
}

/// A sighting's verdict, and the variances it was weighed with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Outcome {
    pub(super) verdict: Verdict,
    /// Variances of its components, before those far from what is expected lose weight.
    pub(super) variance: Vector6<f64>,
}

impl Outcome {
    /// Of a sighting that says nothing.
    pub(super) fn nothing() -> Self {
        Self {
            verdict: Verdict::Refused,
            variance: Vector6::zeros(),
        }
    }
}
