//! The assumed noise of odometry in a joint covariance: it is followed, and taken back.

use nalgebra::{DMatrix, Matrix6};

use super::covariance::JointCovariance;
use super::noise_share::NoiseShare;
use super::tuning::{COVARIANCE_ROUNDING, NOISE_SHARE_DIM_MAX, NOISE_SHARES_MAX};

impl JointCovariance {
    /// Notes that the pose from `offset` on has moved with these covariances of its noise, of
    /// lengths and of angles, which are part of the covariance already.
    pub(super) fn add_to_shares(&mut self, agent: u32, offset: usize, noise: &[Matrix6<f64>; 2]) {
        let dim = self.dim();
        for (is_of_angles, noise) in [false, true].into_iter().zip(noise) {
            let own =
                |share: &NoiseShare| share.agent == agent && share.is_of_angles == is_of_angles;
            let shares = self.shares_mut();
            let index = shares.iter().position(own).or_else(|| {
                (shares.len() < NOISE_SHARES_MAX).then(|| {
                    shares.push(NoiseShare::new(agent, is_of_angles, dim));
                    shares.len() - 1
                })
            });
            if let Some(index) = index {
                shares[index].add(dim, offset, noise);
            }
        }
        if dim > NOISE_SHARE_DIM_MAX {
            self.shares_mut().clear();
        }
    }

    /// The noise of an agent's odometry is followed no more.
    pub(super) fn drop_shares(&mut self, agent: u32) {
        self.shares_mut().retain(|share| share.agent != agent);
    }

    /// The noise of an agent's odometry was too large by these parts of it, of lengths and of
    /// angles, or too small where they are negative: takes them back, and follows it no more.
    /// Answers whether anything has changed.
    ///
    /// Where something else has made the covariance smaller than this can be, it stays as it is.
    pub(super) fn take_back(&mut self, agent: u32, parts: [f64; 2]) -> bool {
        let dim = self.dim();
        let (own, others): (Vec<NoiseShare>, Vec<NoiseShare>) = std::mem::take(self.shares_mut())
            .into_iter()
            .partition(|share| share.agent == agent);
        *self.shares_mut() = others;
        let mut entries = self.entries().to_vec();
        for share in &own {
            let part = parts[usize::from(share.is_of_angles)];
            for (entry, noise) in entries.iter_mut().zip(share.entries.iter()) {
                *entry -= part * noise;
            }
        }
        for k in 0..dim {
            let before = self.variance(k);
            entries[k * dim + k] += COVARIANCE_ROUNDING * before;
        }
        let is_covariance = !own.is_empty() && is_positive(dim, &entries);
        if is_covariance {
            self.replace(entries);
        }
        is_covariance
    }
}

/// Whether a symmetric matrix has no negative eigenvalue, beside those components that have no
/// variance at all.
fn is_positive(dim: usize, entries: &[f64]) -> bool {
    let known: Vec<usize> = (0..dim).filter(|&k| entries[k * dim + k] != 0.0).collect();
    let of_known = DMatrix::from_fn(known.len(), known.len(), |row, column| {
        entries[known[row] * dim + known[column]]
    });
    of_known.iter().all(|entry| entry.is_finite()) && of_known.cholesky().is_some()
}

#[cfg(test)]
mod tests;
