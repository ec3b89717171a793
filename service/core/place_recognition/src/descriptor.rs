//! Similarity of two descriptors.

/// Sums of a scalar product that grow side by side, so that the compiler may use vector registers:
/// a single sum has an order of additions that it has to keep.
const LANES: usize = 16;

/// Scalar product of two vectors of one length, in the widest vectors of the machine: the sums are
/// the same in any.
#[inline]
pub fn dot(a: &[f32], b: &[f32]) -> f32 {
    simd::dispatch(
        #[inline(always)]
        || dot_inline(a, b),
    )
}

/// As [`dot`], within a dispatch.
#[expect(
    clippy::inline_always,
    reason = "compiled for the vectors of a dispatch"
)]
#[inline(always)]
pub(crate) fn dot_inline(a: &[f32], b: &[f32]) -> f32 {
    let (a, a_rest) = a.as_chunks::<LANES>();
    let (b, b_rest) = b.as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..LANES {
            sums[lane] += a[lane] * b[lane];
        }
    }
    let rest: f32 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f32>() + rest
}

/// Cosine of two unit vectors, as the sum of their products.
pub(crate) fn cosine(a: &[f32], b: &[f32]) -> f64 {
    f64::from(dot(a, b))
}

/// Angle between two unit vectors \[rad\].
pub(crate) fn angle_rad(a: &[f32], b: &[f32]) -> f64 {
    cosine(a, b).clamp(-1.0, 1.0).acos()
}
