//! The inner product of two vectors.

/// Σ aᵢ bᵢ of vectors of one length, in order.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    debug_assert_eq!(a.len(), b.len(), "vectors of one space have one length");
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
