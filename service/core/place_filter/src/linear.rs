//! Cholesky factors of small matrices, by rows of sixteen numbers.
//!
//! Every entry is summed in one fixed order, whatever vectors the compiler chooses: the bits do not
//! depend on it.

/// Numbers of a row that are computed at once: four vectors of AVX2.
pub(crate) const LANES: usize = 16;

/// Numbers side by side, of as many columns.
pub(crate) type Row = [f64; LANES];

/// Rows of a product that are computed at once: its sums are what the registers of AVX2 hold.
const TILE: usize = 4;
/// Columns of a product that are computed at once.
const HALF: usize = 8;

/// L of K = L Lᵀ, row by row.
#[derive(Debug)]
pub(crate) struct Lower {
    n: usize,
    entries: Vec<f64>,
    /// Reciprocals of its diagonal.
    inverse: Vec<f64>,
}

impl Lower {
    /// The factor of a symmetric matrix; `None` if that is not positive definite. `entries` answers
    /// the entries of a row in [`LANES`] columns from one on: those beyond the last column may be
    /// anything, since nothing that is read depends on them, and those beyond the diagonal are
    /// those of the matrix.
    pub(crate) fn factor(n: usize, entries: impl Fn(usize, usize) -> Row) -> Option<Self> {
        let mut factor = Self {
            n,
            entries: vec![0.0; n * n],
            inverse: Vec::with_capacity(n),
        };
        let is_definite = simd::dispatch(
            #[inline(always)]
            || {
                let mut above = Vec::with_capacity(n);
                let mut first = 0;
                while first < n && factor.add_rows(first, &mut above, &entries) {
                    first += LANES;
                }
                first >= n
            },
        );
        is_definite.then_some(factor)
    }

    /// Factors the next [`LANES`] rows; answers whether the matrix is positive definite so far.
    #[expect(
        clippy::inline_always,
        reason = "compiled for the vectors of a dispatch"
    )]
    #[inline(always)]
    fn add_rows(
        &mut self,
        first: usize,
        above: &mut Vec<Row>,
        entries: &impl Fn(usize, usize) -> Row,
    ) -> bool {
        let count = (self.n - first).min(LANES);
        // The rows that are new are columns of their transpose, which are solved side by side.
        above.clear();
        above.resize(first, [0.0; LANES]);
        for (row, above) in above.iter_mut().enumerate() {
            *above = entries(row, first);
        }
        self.forwards_inline(above);
        let mut own = [[0.0; LANES]; LANES];
        for (k, own) in own.iter_mut().take(count).enumerate() {
            *own = entries(first + k, first);
        }
        subtract_products(above, &mut own);
        let mut inverse = [0.0; LANES];
        let is_definite = factor_upper(&mut own, &mut inverse, count);
        for k in 0..count {
            let row = &mut self.entries[(first + k) * self.n..][..=first + k];
            let (before, rest) = row.split_at_mut(first);
            for (entry, above) in before.iter_mut().zip(above.iter()) {
                *entry = above[k];
            }
            for (entry, own) in rest.iter_mut().zip(&own) {
                *entry = own[k];
            }
        }
        self.inverse.extend_from_slice(&inverse[..count]);
        is_definite
    }

    /// Solves L X = B in place.
    pub(crate) fn forwards(&self, rows: &mut [Row]) {
        simd::dispatch(
            #[inline(always)]
            || self.forwards_inline(rows),
        );
    }

    /// As [`forwards`](Self::forwards), of the first rows if there are fewer.
    #[expect(
        clippy::inline_always,
        reason = "compiled for the vectors of a dispatch"
    )]
    #[inline(always)]
    pub(crate) fn forwards_inline(&self, rows: &mut [Row]) {
        for k in 0..rows.len() {
            let (before, rest) = rows.split_at_mut(k);
            let mut own = rest[0];
            let factors = &self.entries[k * self.n..][..k];
            for (row, factor) in before.iter().zip(factors) {
                for lane in 0..LANES {
                    own[lane] -= factor * row[lane];
                }
            }
            for lane in &mut own {
                *lane *= self.inverse[k];
            }
            rest[0] = own;
        }
    }

    /// Solves L Lᵀ x = b in place.
    pub(crate) fn solve(&self, values: &mut [f64]) {
        for k in 0..self.n {
            let factors = &self.entries[k * self.n..][..k];
            let sum = dot(&values[..k], factors);
            values[k] = (values[k] - sum) * self.inverse[k];
        }
        for k in (0..self.n).rev() {
            let value = values[k] * self.inverse[k];
            values[k] = value;
            let factors = &self.entries[k * self.n..][..k];
            for (other, factor) in values.iter_mut().zip(factors) {
                *other -= factor * value;
            }
        }
    }

    /// ½ ln |K|.
    pub(crate) fn log_root(&self) -> f64 {
        (0..self.n).map(|k| self.entries[k * self.n + k].ln()).sum()
    }
}

/// Factors the first rows and columns of a symmetric matrix in place, so that K = Uᵀ U, with the
/// reciprocals of the diagonal; answers whether it is positive definite. What stands below its
/// diagonal and beyond those columns must not be read.
#[expect(
    clippy::inline_always,
    reason = "compiled for the vectors of a dispatch"
)]
#[inline(always)]
pub(crate) fn factor_upper(matrix: &mut [Row; LANES], inverse: &mut Row, count: usize) -> bool {
    for k in 0..count {
        let pivot = matrix[k][k];
        if pivot.is_nan() || pivot <= 0.0 {
            return false;
        }
        let root = pivot.sqrt();
        inverse[k] = 1.0 / root;
        let (done, later) = matrix.split_at_mut(k + 1);
        let own = &mut done[k];
        for lane in own.iter_mut() {
            *lane *= inverse[k];
        }
        own[k] = root;
        for (i, row) in (k + 1..count).zip(later) {
            let factor = own[i];
            for lane in 0..LANES {
                row[lane] -= factor * own[lane];
            }
        }
    }
    true
}

/// Solves Uᵀ X = B in place for the first rows of a factor by [`factor_upper`].
#[expect(
    clippy::inline_always,
    reason = "compiled for the vectors of a dispatch"
)]
#[inline(always)]
pub(crate) fn solve_upper(factor: &[Row; LANES], inverse: &Row, rows: &mut [Row]) {
    for k in 0..rows.len() {
        let (before, rest) = rows.split_at_mut(k);
        let mut own = rest[0];
        for (row, factors) in before.iter().zip(factor) {
            for lane in 0..LANES {
                own[lane] -= factors[k] * row[lane];
            }
        }
        for lane in &mut own {
            *lane *= inverse[k];
        }
        rest[0] = own;
    }
}

/// Subtracts Σ rᵀ r of some rows r from a symmetric matrix, from its diagonal and what is right of
/// that.
#[expect(
    clippy::inline_always,
    reason = "compiled for the vectors of a dispatch"
)]
#[inline(always)]
pub(crate) fn subtract_products(rows: &[Row], from: &mut [Row; LANES]) {
    for first in (0..LANES).step_by(TILE) {
        for column in (first / HALF * HALF..LANES).step_by(HALF) {
            let mut sums = [[0.0; HALF]; TILE];
            for row in rows {
                // Copies and counted loops: with references the compiler does not keep the sums in
                // registers.
                let factors: [f64; TILE] =
                    { row[first..first + TILE].try_into() }.expect("the slice has TILE numbers");
                let lanes: [f64; HALF] =
                    { row[column..column + HALF].try_into() }.expect("the slice has HALF numbers");
                for k in 0..TILE {
                    for lane in 0..HALF {
                        sums[k][lane] += factors[k] * lanes[lane];
                    }
                }
            }
            for (into, sums) in from[first..first + TILE].iter_mut().zip(&sums) {
                for (entry, sum) in into[column..column + HALF].iter_mut().zip(sums) {
                    *entry -= sum;
                }
            }
        }
    }
}

/// Sum of products, four at a time so that it takes few cycles.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (fours_a, fours_b) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = fours_a
        .remainder()
        .iter()
        .zip(fours_b.remainder())
        .map(|(a, b)| a * b)
        .sum();
    for (a, b) in fours_a.zip(fours_b) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A positive definite matrix.
    fn entry(row: usize, column: usize) -> f64 {
        let apart = row as f64 - column as f64;
        (-0.1 * apart * apart).exp() + if row == column { 0.3 } else { 0.0 }
    }

    fn entries(row: usize, first: usize) -> Row {
        std::array::from_fn(|lane| entry(row, first + lane))
    }

    /// Matrices of fewer and of more rows than are computed at once, times a known vector.
    #[test]
    fn a_factor_solves_what_it_is_a_factor_of() {
        for n in [1, 7, 16, 17, 48, 61] {
            let factor = Lower::factor(n, entries).expect("it is positive definite");
            let wanted: Vec<f64> = (0..n).map(|k| (k as f64).sin()).collect();
            let times = |row: usize| -> f64 {
                let of = |column: usize| entry(row, column) * wanted[column];
                (0..n).map(of).sum()
            };
            let mut values: Vec<f64> = (0..n).map(times).collect();
            let mut rows: Vec<Row> = values.iter().map(|&value| [value; LANES]).collect();
            factor.solve(&mut values);
            for (value, wanted) in values.iter().zip(&wanted) {
                assert!((value - wanted).abs() < 1e-12, "{n}: {value} {wanted}");
            }
            // Lᵀ x of the same.
            factor.forwards(&mut rows);
            for (k, row) in rows.iter().enumerate() {
                let of = |j: usize| factor.entries[j * n + k] * wanted[j];
                let there: f64 = (k..n).map(of).sum();
                assert!(
                    (row[LANES - 1] - there).abs() < 1e-12,
                    "{n}: {row:?} {there}"
                );
            }
        }
        assert!(Lower::factor(2, |_, _| [1.0; LANES]).is_none());
    }

    #[test]
    fn a_small_factor_solves_the_same() {
        let mut matrix: [Row; LANES] = std::array::from_fn(|row| entries(row, 0));
        let mut inverse = [0.0; LANES];
        assert!(factor_upper(&mut matrix, &mut inverse, 11));
        let whole = Lower::factor(11, entries).expect("it is positive definite");
        let mut rows: Vec<Row> = (0..11).map(|k| [f64::from(k); LANES]).collect();
        let mut same = rows.clone();
        solve_upper(&matrix, &inverse, &mut rows);
        whole.forwards(&mut same);
        for (row, same) in rows.iter().zip(&same) {
            assert!((row[3] - same[3]).abs() < 1e-12, "{row:?} {same:?}");
        }
    }
}
