//! Dense kernels on the lower triangle of a column-major matrix.
//!
//! Column j of a matrix with leading dimension `ld` stands at `j·ld`; what lies above the diagonal
//! is scratch, and the kernels write there what nobody reads. `ld` is a multiple of [`LANES`] and
//! the rows between the matrix and `ld` are zero, so that no loop over rows has a remainder. Every
//! entry is summed in one fixed order, whatever vector width the compiler chooses: the bits do not
//! depend on it.

/// Rows that are computed at once.
pub(super) const LANES: usize = 8;

/// Columns that are computed at once: 8 × 4 sums are what the registers of AVX2 hold.
const TILE: usize = 4;

/// Below this many columns a factor is computed column by column.
const COLUMNS_MIN: usize = 8;

/// Share of its original diagonal entry below which a pivot counts as rounding noise: the direction
/// is one about which nothing is known.
const NOISE: f64 = 1e-13;

/// What a pivot that is only noise becomes. The solution then does not move along it.
pub(super) const FIXED: f64 = 1e150;

/// The inner product, in order.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The leading dimension for this many rows.
pub(super) fn leading_dimension(n_rows: usize) -> usize {
    n_rows.next_multiple_of(LANES)
}

/// Factors the first `n_pivots` columns of the symmetric `matrix` (leading dimension `ld`) in place
/// and subtracts what they explain from the columns up to `n_columns`:
///
/// ```text
/// | A  Bᵀ |   | L₁₁ 0 | | L₁₁ᵀ L₂₁ᵀ |
/// | B  C  | = | L₂₁ I | | 0    C − L₂₁ L₂₁ᵀ |
/// ```
///
/// A pivot that is not above the noise of its own cancellation is fixed: its unknown gets no
/// correction. Returns the number of such pivots.
pub(super) fn factor(matrix: &mut [f64], ld: usize, n_pivots: usize, n_columns: usize) -> usize {
    let diagonal: Vec<f64> = (0..n_pivots).map(|k| matrix[k * ld + k]).collect();
    let mut n_fixed = 0;
    factor_columns(matrix, ld, 0, n_pivots, &diagonal, &mut n_fixed);
    subtract_products(matrix, ld, 0..n_pivots, n_pivots..n_columns);
    n_fixed
}

/// Factors the columns `from..to`, into which all earlier ones have been subtracted, by halves: so
/// nearly all work is done by [`subtract_products`] on columns that are still in the cache.
fn factor_columns(
    matrix: &mut [f64],
    ld: usize,
    from: usize,
    to: usize,
    diagonal: &[f64],
    n_fixed: &mut usize,
) {
    if to - from > COLUMNS_MIN {
        let middle = from + (to - from) / 2;
        factor_columns(matrix, ld, from, middle, diagonal, n_fixed);
        subtract_products(matrix, ld, from..middle, middle..to);
        factor_columns(matrix, ld, middle, to, diagonal, n_fixed);
        return;
    }
    for k in from..to {
        let (pivots, later) = matrix[..to * ld].split_at_mut((k + 1) * ld);
        let pivot_column = &mut pivots[k * ld..];
        let pivot = pivot_column[k];
        let is_noise = pivot.is_nan() || pivot <= NOISE * diagonal[k].max(0.0);
        let first = k / LANES * LANES;
        if is_noise {
            *n_fixed += 1;
            pivot_column[first..].fill(0.0);
            pivot_column[k] = FIXED;
            continue;
        }
        let root = pivot.sqrt();
        let inverse = 1.0 / root;
        for entry in &mut pivot_column[first..] {
            *entry *= inverse;
        }
        pivot_column[k] = root;
        for (column, j) in later.chunks_exact_mut(ld).zip(k + 1..) {
            let factor = pivot_column[j];
            for (entry, pivot_entry) in column[first..].iter_mut().zip(&pivot_column[first..]) {
                *entry -= factor * pivot_entry;
            }
        }
    }
}

/// Subtracts Lₖ Lₖᵀ of the columns `from` from the columns `into`, which lie behind them.
fn subtract_products(
    matrix: &mut [f64],
    ld: usize,
    from: std::ops::Range<usize>,
    into: std::ops::Range<usize>,
) {
    if from.is_empty() || into.is_empty() {
        return;
    }
    let (done, rest) = matrix.split_at_mut(into.start * ld);
    let done = &done[from.start * ld..from.end * ld];
    let columns = &mut rest[..into.len() * ld];
    simd::dispatch(
        #[inline(always)]
        || {
            for (tile, j) in columns
                .chunks_mut(TILE * ld)
                .zip(into.clone().step_by(TILE))
            {
                match tile.len() / ld {
                    1 => subtract_tile::<1>(done, tile, ld, j),
                    2 => subtract_tile::<2>(done, tile, ld, j),
                    3 => subtract_tile::<3>(done, tile, ld, j),
                    _ => subtract_tile::<TILE>(done, tile, ld, j),
                }
            }
        },
    );
}

/// As [`subtract_products`], for `N` columns from `j` on.
#[expect(
    clippy::inline_always,
    reason = "only what is inlined into the dispatched closure is compiled for the vectors that it chose"
)]
#[inline(always)]
fn subtract_tile<const N: usize>(done: &[f64], tile: &mut [f64], ld: usize, j: usize) {
    for row in (j / LANES * LANES..ld).step_by(LANES) {
        let mut sums = [[0.0; LANES]; N];
        for column in done.chunks_exact(ld) {
            // Copies and counted loops: with references the compiler does not keep the sums in
            // registers.
            let rows: [f64; LANES] = column[row..row + LANES].try_into().expect("LANES long");
            let factors: [f64; N] = column[j..j + N].try_into().expect("N long");
            for c in 0..N {
                for l in 0..LANES {
                    sums[c][l] += factors[c] * rows[l];
                }
            }
        }
        for (column, sum) in tile.chunks_exact_mut(ld).zip(&sums) {
            for (entry, sum) in column[row..row + LANES].iter_mut().zip(sum) {
                *entry -= sum;
            }
        }
    }
}
