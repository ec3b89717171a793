//! What the assumed noise of an agent's odometry adds to a joint covariance, while it is not known
//! how large that noise is.
//!
//! A robot that sets out draws its first landmarks with odometry of which nothing is known. What it
//! is assumed to be off by then is how the whole map is turned, and no later sighting takes that
//! back: all of them are seen from within the map. Only the noise itself becomes known. With the
//! gains K that were used, the covariance of the errors is linear in the variance s of that noise:
//!
//! ```text
//! P = A + s D      motion   D ← F D Fᵀ + Q      sighting   D ← (I − K H) D (I − K H)ᵀ
//! ```
//!
//! D, a share, is followed for each agent and for lengths and angles apart. When the noise turns
//! out to be s₁ < s of what was assumed, the covariance becomes what it is with these gains:
//!
//! ```text
//! P ← P − (s − s₁) D
//! ```
//!
//! The estimate stays as it is. Where s₁ > s, the covariance grows likewise.

use std::sync::Arc;

use nalgebra::{Matrix6, SMatrix, SVector};

use super::jacobian::Block;
use geometry::symmetric;

/// A part D of a joint covariance: symmetric, row by row. A clone shares the entries.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct NoiseShare {
    /// Whose odometry it is of.
    pub(super) agent: u32,
    /// Whether of its angles, or else its lengths.
    pub(super) is_of_angles: bool,
    pub(super) entries: Arc<Vec<f64>>,
}

/// H D and H D Hᵀ of a share.
#[derive(Clone, Debug)]
pub(super) struct ShareProjection<const M: usize> {
    rows: [Vec<f64>; M],
    spread: SMatrix<f64, M, M>,
}

impl NoiseShare {
    /// Nothing yet, of so many components.
    pub(super) fn new(agent: u32, is_of_angles: bool, dim: usize) -> Self {
        Self {
            agent,
            is_of_angles,
            entries: Arc::new(vec![0.0; dim * dim]),
        }
    }

    pub(super) fn project<const M: usize>(
        &self,
        dim: usize,
        blocks: &[Block<M>],
    ) -> ShareProjection<M> {
        let mut rows = std::array::from_fn(|_| vec![0.0; dim]);
        for block in blocks {
            for column in 0..block.width {
                let source = &self.entries[(block.offset + column) * dim..][..dim];
                for (k, row) in rows.iter_mut().enumerate() {
                    let factor = block.jacobian[(k, column)];
                    for (entry, value) in row.iter_mut().zip(source) {
                        *entry += factor * value;
                    }
                }
            }
        }
        let mut spread = SMatrix::<f64, M, M>::zeros();
        for block in blocks {
            for (k, row) in rows.iter().enumerate() {
                for column in 0..block.width {
                    for other in 0..M {
                        let by_other = block.jacobian[(other, column)];
                        spread[(k, other)] += by_other * row[block.offset + column];
                    }
                }
            }
        }
        ShareProjection {
            rows,
            spread: symmetric(&spread),
        }
    }

    /// D ← (I − K H) D (I − K H)ᵀ, with the columns of the gain K.
    ///
    /// ```text
    /// D ← D − K Y − Yᵀ Kᵀ      Y = H D − ½ H D Hᵀ Kᵀ
    /// ```
    pub(super) fn update<const M: usize>(
        &mut self,
        dim: usize,
        projection: ShareProjection<M>,
        gains: &[Vec<f64>; M],
    ) {
        let ShareProjection { mut rows, spread } = projection;
        for (k, row) in rows.iter_mut().enumerate() {
            for (other, gain) in gains.iter().enumerate() {
                let half = 0.5 * spread[(k, other)];
                for (entry, gain) in row.iter_mut().zip(gain) {
                    *entry -= half * gain;
                }
            }
        }
        let entries = Arc::make_mut(&mut self.entries).chunks_exact_mut(dim);
        for (index, target) in entries.enumerate() {
            for (gain, row) in gains.iter().zip(&rows) {
                let (by_gain, by_row) = (gain[index], row[index]);
                for ((entry, row), gain) in target.iter_mut().zip(row).zip(gain) {
                    *entry -= by_gain * row + by_row * gain;
                }
            }
        }
    }

    /// Appends y = J x, of a projection onto J.
    pub(super) fn append<const K: usize>(&mut self, dim: usize, projection: &ShareProjection<K>) {
        self.grow(dim, K);
        let new = dim + K;
        let entries = Arc::make_mut(&mut self.entries);
        for (k, row) in projection.rows.iter().enumerate() {
            for (other, &value) in row.iter().enumerate() {
                entries[(dim + k) * new + other] = value;
                entries[other * new + dim + k] = value;
            }
            for other in 0..K {
                entries[(dim + k) * new + dim + other] = projection.spread[(k, other)];
            }
        }
    }

    /// Makes room for `width` more components.
    pub(super) fn grow(&mut self, dim: usize, width: usize) {
        let new = dim + width;
        let mut entries = vec![0.0; new * new];
        for (row, target) in self
            .entries
            .chunks_exact(dim.max(1))
            .zip(entries.chunks_exact_mut(new))
        {
            target[..dim].copy_from_slice(row);
        }
        self.entries = Arc::new(entries);
    }

    /// Drops `width` components from `offset` on.
    pub(super) fn remove(&mut self, dim: usize, offset: usize, width: usize) {
        let mut entries = Vec::with_capacity((dim - width) * (dim - width));
        for (_, row) in (0..dim)
            .zip(self.entries.chunks_exact(dim))
            .filter(|(index, _)| !(offset..offset + width).contains(index))
        {
            entries.extend_from_slice(&row[..offset]);
            entries.extend_from_slice(&row[offset + width..]);
        }
        self.entries = Arc::new(entries);
    }

    /// x ← F x for components from `offset` on.
    pub(super) fn transform<const N: usize>(
        &mut self,
        dim: usize,
        offset: usize,
        transition: &SMatrix<f64, N, N>,
    ) {
        let own = SMatrix::<f64, N, N>::from_fn(|row, column| {
            self.entries[(offset + row) * dim + offset + column]
        });
        let own = symmetric(&(transition * own * transition.transpose()));
        let entries = Arc::make_mut(&mut self.entries);
        for column in (0..offset).chain(offset + N..dim) {
            let before = SVector::<f64, N>::from_fn(|k, _| entries[column * dim + offset + k]);
            let after = transition * before;
            for k in 0..N {
                entries[column * dim + offset + k] = after[k];
                entries[(offset + k) * dim + column] = after[k];
            }
        }
        for row in 0..N {
            for column in 0..N {
                entries[(offset + row) * dim + offset + column] = own[(row, column)];
            }
        }
    }

    /// Components from `offset` on are not what they were.
    pub(super) fn isolate(&mut self, dim: usize, offset: usize, width: usize) {
        let entries = Arc::make_mut(&mut self.entries);
        for k in offset..offset + width {
            for other in 0..dim {
                entries[k * dim + other] = 0.0;
                entries[other * dim + k] = 0.0;
            }
        }
    }

    /// The pose from `offset` on has moved with noise of this covariance.
    pub(super) fn add(&mut self, dim: usize, offset: usize, noise: &Matrix6<f64>) {
        let noise = symmetric(noise);
        let entries = Arc::make_mut(&mut self.entries);
        for row in 0..6 {
            for column in 0..6 {
                entries[(offset + row) * dim + offset + column] += noise[(row, column)];
            }
        }
    }
}
