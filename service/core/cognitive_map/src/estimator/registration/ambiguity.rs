//! Ambiguous correspondences: those in which another landmark fits about as well.

use nalgebra::{Isometry3, Point3};

use super::{SURE_MARGIN, UncertainPoint};

/// The landmarks of two frames, as a motion lays those of the newer one into the older one.
#[derive(Debug)]
pub(super) struct Laid<'a> {
    older: &'a [UncertainPoint],
    newer: &'a [UncertainPoint],
    /// Positions of the newer ones in the older frame.
    positions: Vec<Point3<f64>>,
}

impl<'a> Laid<'a> {
    pub(super) fn new(
        pose: &Isometry3<f64>,
        older: &'a [UncertainPoint],
        newer: &'a [UncertainPoint],
    ) -> Self {
        let positions = newer.iter().map(|point| pose * point.position).collect();
        Self {
            older,
            newer,
            positions,
        }
    }

    /// The pairs, numbers of an older and a newer landmark, in which no other landmark of either
    /// frame may be meant.
    pub(super) fn unambiguous(&self, pairs: &[(usize, usize)]) -> Vec<(usize, usize)> {
        let is_sure = |pair: &&(usize, usize)| self.is_sure(**pair, &|_| true, &|_| true);
        pairs.iter().filter(is_sure).copied().collect()
    }

    /// The pairs in which no landmark that is in none of them may be meant. Two pairs may still be
    /// meant crosswise.
    pub(super) fn unrivalled(&self, pairs: &[(usize, usize)]) -> Vec<(usize, usize)> {
        let is_free_older = |at: usize| pairs.iter().all(|pair| pair.0 != at);
        let is_free_newer = |at: usize| pairs.iter().all(|pair| pair.1 != at);
        let is_sure = |pair: &&(usize, usize)| self.is_sure(**pair, &is_free_older, &is_free_newer);
        pairs.iter().filter(is_sure).copied().collect()
    }

    /// Whether each other landmark of those that count fits much worse than this pair.
    fn is_sure(
        &self,
        (older, newer): (usize, usize),
        counts_older: &dyn Fn(usize) -> bool,
        counts_newer: &dyn Fn(usize) -> bool,
    ) -> bool {
        let here = self.squared_m2(older, newer);
        let is_worse = |older: usize, newer: usize| {
            let variance = self.older[older].variance + self.newer[newer].variance;
            self.squared_m2(older, newer) - here > SURE_MARGIN * variance
        };
        let mut others_older = (0..self.older.len()).filter(|&at| at != older);
        let mut others_newer = (0..self.newer.len()).filter(|&at| at != newer);
        others_older.all(|at| is_worse(at, newer) || !counts_older(at))
            && others_newer.all(|at| is_worse(older, at) || !counts_newer(at))
    }

    fn squared_m2(&self, older: usize, newer: usize) -> f64 {
        (self.positions[newer] - self.older[older].position).norm_squared()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f64) -> UncertainPoint {
        UncertainPoint {
            position: Point3::new(x, 0.0, 0.0),
            variance: 0.01,
        }
    }

    #[test]
    fn who_has_a_rival_is_left_out() {
        // The second and third lie 0.4 m apart: 0.16 m² are 8 of their variance, where 12 would be
        // sure.
        let points = [point(0.0), point(5.0), point(5.4), point(10.0)];
        let laid = Laid::new(&Isometry3::identity(), &points, &points);
        let all = [(0, 0), (1, 1), (2, 2), (3, 3)];
        let ends = [(0, 0), (3, 3)];
        assert_eq!(laid.unambiguous(&all), ends);
        // Both are in a pair: only which is which is open.
        assert_eq!(laid.unrivalled(&all), all);
        // One of them is in none, in either frame.
        assert_eq!(laid.unrivalled(&[(0, 0), (1, 2), (3, 3)]), ends);
        // The newer frame has seen only one of them.
        let laid = Laid::new(&Isometry3::identity(), &points, &points[..2]);
        assert_eq!(laid.unrivalled(&[(0, 0), (1, 1)]), [(0, 0)]);
    }
}
