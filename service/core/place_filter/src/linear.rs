//! Cholesky factors of small matrices.

/// L of K = L Lᵀ, row by row.
pub(crate) struct Lower {
    n: usize,
    entries: Vec<f64>,
}

impl Lower {
    /// The factor of a matrix whose lower half is given; `None` if that is not positive definite.
    pub(crate) fn factor(n: usize, entry: impl Fn(usize, usize) -> f64) -> Option<Self> {
        let mut entries = vec![0.0; n * n];
        for row in 0..n {
            let (above, rest) = entries.split_at_mut(row * n);
            let own = &mut rest[..=row];
            for column in 0..row {
                let other = &above[column * n..=column * n + column];
                let sum = dot(&own[..column], &other[..column]);
                own[column] = (entry(row, column) - sum) / other[column];
            }
            let pivot = entry(row, row) - dot(&own[..row], &own[..row]);
            if pivot.is_nan() || pivot <= 0.0 {
                return None;
            }
            own[row] = pivot.sqrt();
        }
        Some(Self { n, entries })
    }

    /// Solves L X = B in place, with rows of `width`.
    pub(crate) fn forwards(&self, rows: &mut [f64], width: usize) {
        for k in 0..self.n {
            let (before, rest) = rows.split_at_mut(k * width);
            let own = &mut rest[..width];
            let factors = &self.entries[k * self.n..=k * self.n + k];
            for (row, factor) in before.chunks_exact(width).zip(factors) {
                for (own, other) in own.iter_mut().zip(row) {
                    *own -= factor * other;
                }
            }
            for own in own {
                *own /= factors[k];
            }
        }
    }

    /// Solves Lᵀ X = B in place, with rows of `width`.
    pub(crate) fn backwards(&self, rows: &mut [f64], width: usize) {
        for k in (0..self.n).rev() {
            let factors = &self.entries[k * self.n..=k * self.n + k];
            let (before, rest) = rows.split_at_mut(k * width);
            let own = &mut rest[..width];
            for value in &mut *own {
                *value /= factors[k];
            }
            for (row, factor) in before.chunks_exact_mut(width).zip(factors) {
                for (other, own) in row.iter_mut().zip(&*own) {
                    *other -= factor * own;
                }
            }
        }
    }

    /// ½ ln |K|.
    pub(crate) fn log_root(&self) -> f64 {
        (0..self.n).map(|k| self.entries[k * self.n + k].ln()).sum()
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

    /// A matrix of seven rows with a known inverse times a vector.
    #[test]
    fn a_factor_solves_what_it_is_a_factor_of() {
        let entry = |row: usize, column: usize| {
            let apart = row as f64 - column as f64;
            (-0.1 * apart * apart).exp() + if row == column { 0.3 } else { 0.0 }
        };
        let factor = Lower::factor(7, entry).expect("it is positive definite");
        let wanted: Vec<f64> = (0..7).map(|k| f64::from(k).sin()).collect();
        let mut values: Vec<f64> = (0..7)
            .map(|row| {
                (0..7)
                    .map(|column| entry(row, column) * wanted[column])
                    .sum()
            })
            .collect();
        factor.forwards(&mut values, 1);
        factor.backwards(&mut values, 1);
        for (value, wanted) in values.iter().zip(&wanted) {
            assert!((value - wanted).abs() < 1e-12, "{value} {wanted}");
        }
        assert!(Lower::factor(2, |_, _| 1.0).is_none());
    }
}
