//! How far a link that does not fit may pull.

/// Robust kernel ρ: the cost of a link by its squared error.
///
/// With s = rᵀ Ω r, the squared error in standard deviations, a link costs ρ(s) and counts with the
/// weight ρ′(s):
///
/// ```text
/// Gaussian       ρ = s
/// Huber          ρ = s  for s ≤ k²,  2 k √s − k²  beyond
/// Cauchy         ρ = k² ln(1 + s/k²)
/// Geman–McClure  ρ = k² s / (k² + s)
/// ```
///
/// k is in standard deviations of the link's own noise (Barron 2019, Table 1; Zhang 1997).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kernel {
    /// The link is right: motion, a prior.
    Gaussian,
    /// Errors beyond k pull with a constant force.
    Huber(Scale),
    /// Errors beyond k pull less the larger they are.
    Cauchy(Scale),
    /// Errors far beyond k do not pull at all: for links of which many may be false.
    GemanMcClure(Scale),
}

/// The k of a kernel, positive, in standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale(f64);

/// A kernel's scale is not positive and finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the scale of a robust kernel is positive and finite")]
pub struct InvalidScale;

impl Scale {
    /// A scale in standard deviations.
    ///
    /// # Errors
    /// It is not positive and finite.
    pub fn new(standard_deviations: f64) -> Result<Self, InvalidScale> {
        if standard_deviations > 0.0 && standard_deviations.is_finite() {
            Ok(Self(standard_deviations))
        } else {
            Err(InvalidScale)
        }
    }
}

impl Kernel {
    /// ρ and ρ′ at the squared error `s`, with k² of Geman–McClure multiplied by `widening` ≥ 1:
    /// wide kernels are convex, which is how a graduated relaxation begins.
    pub(super) fn cost_and_weight(self, s: f64, widening: f64) -> (f64, f64) {
        match self {
            Self::Gaussian => (s, 1.0),
            Self::Huber(Scale(k)) if s <= k * k => (s, 1.0),
            Self::Huber(Scale(k)) => (2.0 * k * s.sqrt() - k * k, k / s.sqrt()),
            Self::Cauchy(Scale(k)) => {
                let square = k * k;
                (square * (s / square).ln_1p(), square / (square + s))
            }
            Self::GemanMcClure(Scale(k)) => {
                let square = k * k * widening;
                let share = square / (square + s);
                (share * s, share * share)
            }
        }
    }

    /// k² of a kernel that a graduated relaxation widens.
    pub(super) fn graduated_square(self) -> Option<f64> {
        match self {
            Self::GemanMcClure(Scale(k)) => Some(k * k),
            Self::Gaussian | Self::Huber(_) | Self::Cauchy(_) => None,
        }
    }
}
