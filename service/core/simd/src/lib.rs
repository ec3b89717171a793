//! Inner loops in the widest vectors of the machine.

use pulp::{Arch, Simd, WithSimd};

/// Work that is compiled once for each instruction set.
struct Work<F>(F);

impl<R, F: FnMut() -> R> WithSimd for Work<F> {
    type Output = R;

    // `FnMut::call_mut` is the closure itself, which is inlined. `FnOnce::call_once`, by which pulp
    // calls a closure, may be a function around it, and that is compiled for the smallest vectors.
    #[expect(clippy::inline_always, reason = "compiled for the vectors of `S`")]
    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) -> R {
        (self.0)()
    }
}

/// Does what a closure says, compiled for the widest vectors of the machine.
///
/// Only what is inlined into the closure is compiled so: mark it and what it calls with
/// `#[inline(always)]`, and pass no functions to iterators that are not inlined themselves.
/// Results are the same on every machine: no operation is contracted or reordered.
///
/// ```
/// let (a, b) = ([1.0_f32, 2.0, 3.0], [4.0_f32, 5.0, 6.0]);
/// let product: f32 = simd::dispatch(
///     #[inline(always)]
///     || a.iter().zip(&b).map(|(a, b)| a * b).sum(),
/// );
/// assert!((product - 32.0).abs() < 1e-6);
/// ```
#[expect(
    clippy::inline_always,
    reason = "the choice of the instruction set is one jump"
)]
#[inline(always)]
pub fn dispatch<R>(work: impl FnMut() -> R) -> R {
    Arch::new().dispatch(Work(work))
}
