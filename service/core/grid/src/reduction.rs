//! Lattice reduction: a basis of short, nearly orthogonal vectors for a given lattice.

use crate::inner_product::dot;

/// A step must shorten by at least this factor in the square, or reduction could go on for ever.
const LOVASZ: f64 = 0.99;
/// Rounds of size reduction of one vector; two are enough when nothing is lost to rounding.
const SIZE_ROUNDS: usize = 8;

/// A reduced basis.
#[derive(Clone, Debug)]
pub(super) struct Reduced {
    /// The basis vectors, in the order that they are to be enumerated in, last one first.
    pub(super) vectors: Vec<Vec<f64>>,
    /// Each basis vector as a sum of the given ones: whole numbers.
    pub(super) coefficients: Vec<Vec<f64>>,
    /// Orthonormal directions, one per basis vector: vector j is a sum of the directions 0 to j.
    pub(super) directions: Vec<Vec<f64>>,
}

/// Reduces linearly independent vectors of one length (Lenstra, Lenstra & Lovász 1982, "Factoring
/// polynomials with rational coefficients", section 1, in floating point).
///
/// The result spans the same lattice whatever the rounding, because the whole coefficients are kept
/// and the vectors are summed anew from them. Rounding can only make the basis less short.
pub(super) fn reduce(given: &[Vec<f64>]) -> Reduced {
    let n = given.len();
    let mut basis = Basis::new(given);
    // Far more steps than reduction takes; the bound is a safeguard against rounding alone.
    let mut steps = 1000 * n * n;
    let mut k = 0;
    while k < n && steps > 0 {
        steps -= 1;
        basis.reduce_size(k);
        if basis.is_shorter_before(k) {
            basis.vectors.swap(k, k - 1);
            basis.coefficients.swap(k, k - 1);
            basis.orthogonalise(k - 1);
            k -= 1;
        } else {
            k += 1;
        }
    }
    basis.sum_anew(given);
    for direction in &mut basis.across {
        let length = squared(direction).sqrt();
        for x in direction {
            *x /= length;
        }
    }
    Reduced {
        vectors: basis.vectors,
        coefficients: basis.coefficients,
        directions: basis.across,
    }
}

/// A basis while it is reduced.
struct Basis {
    vectors: Vec<Vec<f64>>,
    /// Each vector as a sum of the given ones: whole numbers.
    coefficients: Vec<Vec<f64>>,
    /// The part of each vector across all vectors before.
    across: Vec<Vec<f64>>,
    /// How much of the other vectors' parts each vector holds.
    along: Vec<Vec<f64>>,
}

impl Basis {
    fn new(given: &[Vec<f64>]) -> Self {
        let n = given.len();
        let unit = |j| (0..n).map(|i| f64::from(u8::from(i == j))).collect();
        Self {
            vectors: given.to_vec(),
            coefficients: (0..n).map(unit).collect(),
            across: given.to_vec(),
            along: vec![vec![0.0; n]; n],
        }
    }

    /// Takes whole multiples of the vectors before away from vector k, until half of each is left
    /// at most.
    fn reduce_size(&mut self, k: usize) {
        for _ in 0..SIZE_ROUNDS {
            self.orthogonalise(k);
            let mut changed = false;
            for j in (0..k).rev() {
                let times = self.along[k][j].round();
                if times.abs() >= 1.0 {
                    changed = true;
                    subtract(&mut self.vectors, k, j, times);
                    subtract(&mut self.coefficients, k, j, times);
                    let (lower, upper) = self.along.split_at_mut(k);
                    for (share, other) in upper[0].iter_mut().zip(&lower[j][..j]) {
                        *share -= times * other;
                    }
                }
            }
            if !changed {
                break;
            }
        }
    }

    /// Whether vector k is shorter in the place of the one before (Lovász's condition).
    fn is_shorter_before(&self, k: usize) -> bool {
        k > 0 && {
            let before = squared(&self.across[k - 1]);
            squared(&self.across[k]) < (LOVASZ - self.along[k][k - 1].powi(2)) * before
        }
    }

    /// Splits vector k into its parts along the vectors before and the part across them.
    fn orthogonalise(&mut self, k: usize) {
        let mut rest = self.vectors[k].clone();
        for j in 0..k {
            let share = dot(&rest, &self.across[j]) / squared(&self.across[j]);
            self.along[k][j] = share;
            for (x, a) in rest.iter_mut().zip(&self.across[j]) {
                *x -= share * a;
            }
        }
        self.across[k] = rest;
    }

    /// Sums the vectors anew from the given ones.
    fn sum_anew(&mut self, given: &[Vec<f64>]) {
        for (vector, coefficients) in self.vectors.iter_mut().zip(&self.coefficients) {
            vector.fill(0.0);
            for (given, times) in given.iter().zip(coefficients) {
                for (x, g) in vector.iter_mut().zip(given) {
                    *x += times * g;
                }
            }
        }
        for k in 0..given.len() {
            self.orthogonalise(k);
        }
    }
}

/// Takes vector j away from vector k, which comes after it.
fn subtract(vectors: &mut [Vec<f64>], k: usize, j: usize, times: f64) {
    let (lower, upper) = vectors.split_at_mut(k);
    for (x, y) in upper[0].iter_mut().zip(&lower[j]) {
        *x -= times * y;
    }
}

/// Σ aᵢ².
fn squared(a: &[f64]) -> f64 {
    dot(a, a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn determinant(rows: &[Vec<f64>]) -> f64 {
        let n = rows.len();
        nalgebra::DMatrix::from_fn(n, n, |i, j| rows[i][j]).determinant()
    }

    proptest! {
        #[test]
        fn spans_the_same_lattice_with_short_vectors(
            entries in prop::collection::vec(prop::collection::vec(-9.0..9.0f64, 5), 5),
        ) {
            prop_assume!(determinant(&entries).abs() > 1.0);
            let reduced = reduce(&entries);
            // Whole coefficients of determinant ±1 are what leaves a lattice the same.
            prop_assert!((determinant(&reduced.coefficients).abs() - 1.0).abs() < 1e-6);
            let mut all = reduced.coefficients.iter().flatten();
            prop_assert!(all.all(|x| x.fract().abs() < f64::MIN_POSITIVE));
            // The first vector's bound: 2^((n−1)/4) det^(1/n), a little more for δ < 1.
            let shortest = squared(&reduced.vectors[0]).sqrt();
            prop_assert!(shortest <= 2.1 * determinant(&entries).abs().powf(0.2));
            for (j, vector) in reduced.vectors.iter().enumerate() {
                let parts: f64 =
                    reduced.directions[..=j].iter().map(|q| dot(q, vector).powi(2)).sum();
                prop_assert!((parts - squared(vector)).abs() < 1e-9 * squared(vector));
            }
        }
    }
}
