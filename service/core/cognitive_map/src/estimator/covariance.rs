//! The joint covariance of everything in a frame, as one dense symmetric matrix.

use std::sync::Arc;

use std::ops::Range;

use nalgebra::{SMatrix, SVector};

use super::jacobian::Block;
use super::noise_share::{NoiseShare, ShareProjection};
use super::tuning::{CONDITION_MIN, COVARIANCE_ROUNDING, NOISE_SHARES_MAX};
use geometry::symmetric;

/// A covariance of any dimension, exactly symmetric, row by row. A clone shares the entries.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct JointCovariance {
    dim: usize,
    entries: Arc<Vec<f64>>,
    /// Parts of it that noise makes of which little is known.
    shares: Vec<NoiseShare>,
}

/// What a measurement would do: H P, and S = H P Hᵀ without the measurement's own noise.
#[derive(Clone, Debug)]
pub(super) struct Projection<const M: usize> {
    /// H P, one row of the state's dimension for each row of the measurement.
    rows: [Vec<f64>; M],
    /// H P Hᵀ.
    pub(super) spread: SMatrix<f64, M, M>,
    /// Of each share.
    of_shares: Vec<ShareProjection<M>>,
}

impl JointCovariance {
    /// Number of components.
    pub(super) fn dim(&self) -> usize {
        self.dim
    }

    /// From all entries, row by row: the square of `dim`.
    pub(super) fn from_entries(dim: usize, entries: Vec<f64>) -> Option<Self> {
        (entries.len() == dim * dim).then(|| Self {
            dim,
            entries: Arc::new(entries),
            shares: Vec::new(),
        })
    }

    /// Parts of it that noise makes of which little is known.
    pub(super) fn shares(&self) -> &[NoiseShare] {
        &self.shares
    }

    /// The same, to be changed.
    pub(super) fn shares_mut(&mut self) -> &mut Vec<NoiseShare> {
        &mut self.shares
    }

    /// Replaces all entries, row by row, by as many.
    pub(super) fn replace(&mut self, entries: Vec<f64>) {
        debug_assert_eq!(entries.len(), self.dim * self.dim);
        self.entries = Arc::new(entries);
    }

    /// All entries, row by row.
    pub(super) fn entries(&self) -> &[f64] {
        &self.entries
    }

    /// Variance of a component.
    pub(super) fn variance(&self, component: usize) -> f64 {
        self.entries[component * self.dim + component]
    }

    /// All components.
    pub(super) fn all(&self) -> Range<usize> {
        0..self.dim
    }

    /// A row.
    fn row(&self, row: usize) -> &[f64] {
        &self.entries[row * self.dim..(row + 1) * self.dim]
    }

    /// The block of `R` rows and `C` columns that begins at a cell.
    pub(super) fn block<const R: usize, const C: usize>(
        &self,
        row: usize,
        column: usize,
    ) -> SMatrix<f64, R, C> {
        SMatrix::from_fn(|r, c| self.entries[(row + r) * self.dim + column + c])
    }

    /// Replaces the symmetric block on the diagonal that begins at `offset`.
    pub(super) fn set_diagonal<const N: usize>(
        &mut self,
        offset: usize,
        block: &SMatrix<f64, N, N>,
    ) {
        let (dim, entries) = (self.dim, Arc::make_mut(&mut self.entries));
        for row in 0..N {
            for column in 0..N {
                let (low, high) = (row.min(column), row.max(column));
                entries[(offset + row) * dim + offset + column] = block[(low, high)];
            }
        }
    }

    /// Makes components from `offset` on uncorrelated with everything, with these variances.
    pub(super) fn isolate<const N: usize>(&mut self, offset: usize, variances: &SVector<f64, N>) {
        let (dim, entries) = (self.dim, Arc::make_mut(&mut self.entries));
        for k in offset..offset + N {
            for other in 0..dim {
                entries[k * dim + other] = 0.0;
                entries[other * dim + k] = 0.0;
            }
            entries[k * dim + k] = variances[k - offset];
        }
        for share in &mut self.shares {
            share.isolate(dim, offset, N);
        }
    }

    /// Makes room for `width` more components, uncorrelated and without variance; answers where.
    pub(super) fn grow(&mut self, width: usize) -> usize {
        let (old, new) = (self.dim, self.dim + width);
        let mut entries = vec![0.0; new * new];
        for row in 0..old {
            entries[row * new..row * new + old].copy_from_slice(self.row(row));
        }
        self.entries = Arc::new(entries);
        self.dim = new;
        for share in &mut self.shares {
            share.grow(old, width);
        }
        old
    }

    /// Appends y = J x + n, where x are `width` components from `offset` on; answers where y
    /// begins.
    pub(super) fn append<const K: usize>(
        &mut self,
        blocks: &[Block<K>],
        noise: &SMatrix<f64, K, K>,
    ) -> usize {
        let projection = self.project(blocks);
        let mut shares = std::mem::take(&mut self.shares);
        for (share, projection) in shares.iter_mut().zip(&projection.of_shares) {
            share.append(self.dim, projection);
        }
        let at = self.grow(K);
        self.shares = shares;
        let (dim, entries) = (self.dim, Arc::make_mut(&mut self.entries));
        for (k, row) in projection.rows.iter().enumerate() {
            for (other, &value) in row.iter().enumerate() {
                entries[(at + k) * dim + other] = value;
                entries[other * dim + at + k] = value;
            }
        }
        self.set_diagonal(at, &(projection.spread + noise));
        at
    }

    /// Drops `width` components from `offset` on; those behind move up.
    pub(super) fn remove(&mut self, offset: usize, width: usize) {
        let kept = |index: &usize| !(offset..offset + width).contains(index);
        let new = self.dim - width;
        let mut entries = Vec::with_capacity(new * new);
        for row in (0..self.dim).filter(kept) {
            let row = self.row(row);
            entries.extend_from_slice(&row[..offset]);
            entries.extend_from_slice(&row[offset + width..]);
        }
        self.entries = Arc::new(entries);
        for share in &mut self.shares {
            share.remove(self.dim, offset, width);
        }
        self.dim = new;
    }

    /// Replaces components by a linear function of themselves, x ← F x, in all cross terms; the
    /// block on the diagonal becomes `own`.
    pub(super) fn transform<const N: usize>(
        &mut self,
        offset: usize,
        transition: &SMatrix<f64, N, N>,
        own: &SMatrix<f64, N, N>,
    ) {
        let (dim, entries) = (self.dim, Arc::make_mut(&mut self.entries));
        let behind = offset + N;
        for column in (0..offset).chain(behind..dim) {
            let before = SVector::<f64, N>::from_fn(|k, _| entries[column * dim + offset + k]);
            let after = transition * before;
            for k in 0..N {
                entries[column * dim + offset + k] = after[k];
                entries[(offset + k) * dim + column] = after[k];
            }
        }
        for share in &mut self.shares {
            share.transform(dim, offset, transition);
        }
        self.set_diagonal(offset, own);
    }

    /// Projects the covariance onto a measurement with Jacobian H.
    pub(super) fn project<const M: usize>(&self, blocks: &[Block<M>]) -> Projection<M> {
        let mut rows = std::array::from_fn(|_| vec![0.0; self.dim]);
        for block in blocks {
            for column in 0..block.width {
                let source = self.row(block.offset + column);
                for (k, row) in rows.iter_mut().enumerate() {
                    let factor = block.jacobian[(k, column)];
                    if factor != 0.0 {
                        for (entry, value) in row.iter_mut().zip(source) {
                            *entry += factor * value;
                        }
                    }
                }
            }
        }
        let mut spread = SMatrix::<f64, M, M>::zeros();
        for block in blocks {
            for (k, row) in rows.iter().enumerate() {
                for column in 0..block.width {
                    let value = row[block.offset + column];
                    for other in 0..M {
                        spread[(k, other)] += block.jacobian[(other, column)] * value;
                    }
                }
            }
        }
        let mut spread = symmetric(&spread);
        for block in blocks {
            for column in 0..block.width {
                let variance = self.variance(block.offset + column);
                for k in 0..M {
                    let factor = block.jacobian[(k, column)];
                    spread[(k, k)] += CONDITION_MIN * factor * factor * variance;
                }
            }
        }
        let of_shares = self.shares.iter();
        Projection {
            rows,
            spread,
            of_shares: of_shares
                .map(|share| share.project(self.dim, blocks))
                .collect(),
        }
    }

    /// Takes in a measurement with this innovation, whose covariance is S; answers the correction
    /// of the state, or `None` when S is not positive definite.
    ///
    /// ```text
    /// S = L Lᵀ      W = P Hᵀ L⁻ᵀ      δ = W L⁻¹ ν      P ← P − W Wᵀ + ε diag P
    /// ```
    ///
    /// Each entry of W Wᵀ is the same sum as its mirror image, so that P stays exactly symmetric.
    /// What rounding can take away of it, to first order in the precision of a float and in units
    /// of the variances, is less than the ε that is added, because S is not smaller than a part of
    /// the variances of whose differences it is made: so P stays positive.
    ///
    /// Of a measurement that is to correct some components only, the others and what ties them to
    /// one another stay as they are (Schmidt 1966); P stays positive, too.
    pub(super) fn update<const M: usize>(
        &mut self,
        projection: Projection<M>,
        innovation: &SVector<f64, M>,
        innovation_covariance: &SMatrix<f64, M, M>,
        corrected: &Range<usize>,
    ) -> Option<Vec<f64>> {
        let lower = innovation_covariance.cholesky()?.unpack();
        let mut rows = projection.rows;
        let mut whitened = *innovation;
        for k in 0..M {
            let (done, rest) = rows.split_at_mut(k);
            let row = &mut rest[0];
            for (j, earlier) in done.iter().enumerate() {
                let factor = lower[(k, j)];
                for (entry, value) in row.iter_mut().zip(earlier) {
                    *entry -= factor * value;
                }
                whitened[k] -= factor * whitened[j];
            }
            let inverse = lower[(k, k)].recip();
            for entry in row.iter_mut() {
                *entry *= inverse;
            }
            whitened[k] *= inverse;
        }
        if !whitened.iter().all(|x| x.is_finite()) {
            return None;
        }
        let dim = self.dim;
        let mut correction = vec![0.0; dim];
        for (row, factor) in rows.iter().zip(whitened.iter()) {
            let corrections = correction[corrected.clone()].iter_mut();
            for (entry, value) in corrections.zip(&row[corrected.clone()]) {
                *entry += factor * value;
            }
        }
        for (index, target) in Arc::make_mut(&mut self.entries)
            .chunks_exact_mut(dim)
            .enumerate()
        {
            let variance = target[index];
            let columns = if corrected.contains(&index) {
                0..dim
            } else {
                corrected.clone()
            };
            for row in &rows {
                let factor = row[index];
                if factor != 0.0 {
                    let entries = target[columns.clone()].iter_mut();
                    for (entry, value) in entries.zip(&row[columns.clone()]) {
                        *entry -= factor * value;
                    }
                }
            }
            target[index] += COVARIANCE_ROUNDING * variance;
        }
        if !self.shares.is_empty() {
            let gains = gains(rows, &lower, corrected);
            for (share, projection) in self.shares.iter_mut().zip(projection.of_shares) {
                share.update(dim, projection, &gains);
            }
        }
        Some(correction)
    }

    /// Lets three components from `source` on act on all others: P ← (I + E) P (I + E)ᵀ, where
    /// column k of E at `source` is `levers[k]`, which is zero at the three components themselves.
    ///
    /// ```text
    /// P ← P + V W + Wᵀ Vᵀ      W = U + ½ P_ss Vᵀ
    /// ```
    ///
    /// with the levers V and the three rows U of P. Mirrored entries are the same sums.
    pub(super) fn shear(&mut self, source: usize, levers: &[Vec<f64>; 3]) {
        let dim = self.dim;
        shear(dim, &mut self.entries, source, levers);
        for share in &mut self.shares {
            shear(dim, &mut share.entries, source, levers);
        }
    }

    /// Lays another covariance over the diagonal from `offset` on.
    pub(super) fn place(&mut self, offset: usize, other: &Self) {
        let dim = self.dim;
        let lay = |entries: &mut Arc<Vec<f64>>, other_entries: &[f64]| {
            let entries = Arc::make_mut(entries);
            for (row, source) in other_entries.chunks_exact(other.dim.max(1)).enumerate() {
                let start = (offset + row) * dim + offset;
                entries[start..start + other.dim].copy_from_slice(source);
            }
        };
        lay(&mut self.entries, &other.entries);
        let room = NOISE_SHARES_MAX.saturating_sub(self.shares.len());
        for share in other.shares.iter().take(room) {
            let mut placed = NoiseShare::new(share.agent, share.is_of_angles, dim);
            lay(&mut placed.entries, &share.entries);
            self.shares.push(placed);
        }
    }

    /// Adds to `width` components from `offset` on a linear function of six others: x ← x + J y.
    /// Those are in no share.
    pub(super) fn add(
        &mut self,
        offset: usize,
        width: usize,
        source: usize,
        by: &SMatrix<f64, 6, 6>,
    ) {
        let (dim, entries) = (self.dim, Arc::make_mut(&mut self.entries));
        for pass in 0..2 {
            for row in 0..width {
                for column in 0..dim {
                    let at = |own: usize| {
                        if pass == 0 {
                            own * dim + column
                        } else {
                            column * dim + own
                        }
                    };
                    let added: f64 = (0..6).map(|k| by[(row, k)] * entries[at(source + k)]).sum();
                    entries[at(offset + row)] += added;
                }
            }
        }
        for row in 0..width {
            for column in 0..row {
                entries[(offset + row) * dim + offset + column] =
                    entries[(offset + column) * dim + offset + row];
            }
        }
    }
}

/// Columns of the gain K = W L⁻¹, of which rows that are not to be corrected are zero.
fn gains<const M: usize>(
    whitened: [Vec<f64>; M],
    lower: &SMatrix<f64, M, M>,
    corrected: &Range<usize>,
) -> [Vec<f64>; M] {
    // K L = W, from the last column on.
    let mut gains = whitened;
    for k in (0..M).rev() {
        let (rest, done) = gains.split_at_mut(k + 1);
        let gain = &mut rest[k];
        for (j, later) in done.iter().enumerate() {
            let factor = lower[(k + 1 + j, k)];
            for (entry, value) in gain.iter_mut().zip(later) {
                *entry -= factor * value;
            }
        }
        let inverse = lower[(k, k)].recip();
        for (index, entry) in gain.iter_mut().enumerate() {
            let counts = corrected.contains(&index);
            *entry = if counts { *entry * inverse } else { 0.0 };
        }
    }
    gains
}

/// Lets three components from `source` on act on all others of a symmetric matrix: see
/// [`JointCovariance::shear`].
fn shear(dim: usize, entries: &mut Arc<Vec<f64>>, source: usize, levers: &[Vec<f64>; 3]) {
    let row = |k: usize| &entries[(source + k) * dim..][..dim];
    let own = SMatrix::<f64, 3, 3>::from_fn(|k, other| row(k)[source + other]);
    let mut rows: [Vec<f64>; 3] = std::array::from_fn(|k| row(k).to_vec());
    let variances: [f64; 3] = std::array::from_fn(|k| own[(k, k)]);
    for (k, row) in rows.iter_mut().enumerate() {
        for (other, lever) in levers.iter().enumerate() {
            let half = 0.5 * own[(k, other)];
            for (entry, value) in row.iter_mut().zip(lever) {
                *entry += half * value;
            }
        }
    }
    for (index, target) in Arc::make_mut(entries).chunks_exact_mut(dim).enumerate() {
        for (lever, row) in levers.iter().zip(&rows) {
            let (by_lever, by_row) = (lever[index], row[index]);
            for ((entry, row), lever) in target.iter_mut().zip(row).zip(lever) {
                *entry += by_lever * row + by_row * lever;
            }
        }
        for (lever, variance) in levers.iter().zip(variances) {
            target[index] += COVARIANCE_ROUNDING * lever[index] * lever[index] * variance;
        }
    }
}
