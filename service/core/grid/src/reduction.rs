//! Lattice reduction: a basis of short, nearly orthogonal vectors for a given lattice.

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
    let mut vectors = given.to_vec();
    let mut coefficients: Vec<Vec<f64>> = (0..n)
        .map(|j| (0..n).map(|i| f64::from(u8::from(i == j))).collect())
        .collect();
    // The parts across all vectors before, and how much of those each vector holds.
    let mut across = vectors.clone();
    let mut along = vec![vec![0.0; n]; n];
    // Far more steps than reduction takes; the bound is a safeguard against rounding alone.
    let mut steps = 1000 * n * n;
    let mut k = 0;
    while k < n && steps > 0 {
        steps -= 1;
        for _ in 0..SIZE_ROUNDS {
            orthogonalise(k, &vectors, &mut across, &mut along);
            let mut changed = false;
            for j in (0..k).rev() {
                let times = along[k][j].round();
                if times.abs() >= 1.0 {
                    changed = true;
                    subtract(&mut vectors, k, j, times);
                    subtract(&mut coefficients, k, j, times);
                    let (lower, upper) = along.split_at_mut(k);
                    for (share, other) in upper[0].iter_mut().zip(&lower[j][..j]) {
                        *share -= times * other;
                    }
                }
            }
            if !changed {
                break;
            }
        }
        let shortens = k > 0 && {
            let before = squared(&across[k - 1]);
            squared(&across[k]) < (LOVASZ - along[k][k - 1].powi(2)) * before
        };
        if shortens {
            vectors.swap(k, k - 1);
            coefficients.swap(k, k - 1);
            orthogonalise(k - 1, &vectors, &mut across, &mut along);
            k -= 1;
        } else {
            k += 1;
        }
    }
    for (vector, coefficients) in vectors.iter_mut().zip(&coefficients) {
        vector.fill(0.0);
        for (given, times) in given.iter().zip(coefficients) {
            for (x, g) in vector.iter_mut().zip(given) {
                *x += times * g;
            }
        }
    }
    for k in 0..n {
        orthogonalise(k, &vectors, &mut across, &mut along);
    }
    for direction in &mut across {
        let length = squared(direction).sqrt();
        for x in direction {
            *x /= length;
        }
    }
    Reduced {
        vectors,
        coefficients,
        directions: across,
    }
}

/// Splits vector k into its parts along the vectors before and the part across them.
fn orthogonalise(k: usize, vectors: &[Vec<f64>], across: &mut [Vec<f64>], along: &mut [Vec<f64>]) {
    let mut rest = vectors[k].clone();
    for j in 0..k {
        let share = dot(&rest, &across[j]) / squared(&across[j]);
        along[k][j] = share;
        for (x, a) in rest.iter_mut().zip(&across[j]) {
            *x -= share * a;
        }
    }
    across[k] = rest;
}

/// Takes vector j away from vector k, which comes after it.
fn subtract(vectors: &mut [Vec<f64>], k: usize, j: usize, times: f64) {
    let (lower, upper) = vectors.split_at_mut(k);
    for (x, y) in upper[0].iter_mut().zip(&lower[j]) {
        *x -= times * y;
    }
}

/// Σ aᵢ bᵢ.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
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
