//! Inner loops in the widest vectors of the machine.

mod functions;

use pulp::{Arch, Simd, WithSimd};

pub use functions::{exp, ln, sin_cos};

/// Work that is compiled once for each instruction set.
struct Work<F>(F);

impl<R, F: FnMut() -> R> WithSimd for Work<F> {
    type Output = R;

    // `FnMut::call_mut` is the closure itself, which is inlined. `FnOnce::call_once`, by which pulp
    // calls a closure, is a function around it unless the closure gives away what it holds, and
    // that function is compiled for the smallest vectors.
    #[expect(clippy::inline_always, reason = "compiled for the vectors of `S`")]
    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) -> R {
        (self.0)()
    }
}

/// Does what a closure says, compiled for the widest vectors that the machine has, of at most 256
/// bits.
///
/// Only what is inlined into the closure is compiled so: mark it and the functions that it calls
/// with `#[inline(always)]`. Results are those that it has without: no operation is contracted or
/// reordered, so that a sum of floating-point numbers is made of several side by side.
///
/// ```
/// let (factor, numbers) = (0.5_f32, vec![1.0_f32; 1000]);
/// let mut halves = vec![0.0; 1000];
/// simd::dispatch(
///     #[inline(always)]
///     || {
///         for (half, number) in halves.iter_mut().zip(&numbers) {
///             *half = factor * number;
///         }
///     },
/// );
/// assert!(halves.iter().all(|half| (half - 0.5).abs() < 1e-6));
/// ```
#[expect(clippy::inline_always, reason = "a call of it would be one call more")]
#[inline(always)]
pub fn dispatch<R>(work: impl FnMut() -> R) -> R {
    Arch::new().dispatch(Work(work))
}
