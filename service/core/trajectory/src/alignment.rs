//! The rigid motion which brings an estimate nearest to the truth.

use geometry::{planar_procrustes, procrustes};
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

/// What is fitted before an error is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alignment {
    /// Nothing: the estimate is in the frame of the truth.
    None,
    /// SE(2): a turn about z and a shift in x and y. Heights are compared as they are. For planar
    /// robots: SE(3) could turn a planar path over and so mirror it.
    Planar,
    /// SE(3): any rotation and shift, no scale.
    Spatial,
}

impl Alignment {
    /// The motion `T` of this kind which minimises `Σ ‖T e_i − g_i‖²` over estimates `e` and
    /// truths `g`, pair by pair.
    ///
    /// The rotation is the orthogonal Procrustes solution with the determinant held at +1
    /// (Umeyama 1991, Eqs. 40-43, without scale); in the plane it is the angle of
    /// `Σ e_i · g_i` and `Σ e_i × g_i` about the centroids. Without pairs: the identity.
    pub fn fit(self, estimate_m: &[Vector3<f64>], truth_m: &[Vector3<f64>]) -> Isometry3<f64> {
        if estimate_m.is_empty() || self == Self::None {
            return Isometry3::identity();
        }
        let estimate_centre = centroid(estimate_m);
        let truth_centre = centroid(truth_m);
        let mut covariance = Matrix3::zeros();
        for (estimate, truth) in estimate_m.iter().zip(truth_m) {
            covariance += (truth - truth_centre) * (estimate - estimate_centre).transpose();
        }
        let rotation = match self {
            Self::None => UnitQuaternion::identity(),
            Self::Planar => planar_procrustes(&covariance),
            Self::Spatial => procrustes(&covariance),
        };
        let mut shift = truth_centre - rotation * estimate_centre;
        if self == Self::Planar {
            shift.z = 0.0;
        }
        Isometry3::from_parts(Translation3::from(shift), rotation)
    }
}

/// The mean position.
fn centroid(positions_m: &[Vector3<f64>]) -> Vector3<f64> {
    positions_m.iter().sum::<Vector3<f64>>() / positions_m.len() as f64
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn points() -> impl Strategy<Value = Vec<Vector3<f64>>> {
        let point = (-50.0..50.0, -50.0..50.0, -50.0..50.0);
        prop::collection::vec(point.prop_map(|(x, y, z)| Vector3::new(x, y, z)), 4..30)
    }

    fn sum_of_squares(motion: &Isometry3<f64>, e: &[Vector3<f64>], g: &[Vector3<f64>]) -> f64 {
        let moved = |e: &Vector3<f64>| motion.rotation * e + motion.translation.vector;
        e.iter()
            .zip(g)
            .map(|(e, g)| (moved(e) - g).norm_squared())
            .sum()
    }

    proptest! {
        #[test]
        fn a_rigid_motion_is_undone(
            truth in points(),
            turn in prop::array::uniform3(-3.1..3.1_f64),
            shift in prop::array::uniform3(-1e3..1e3_f64),
        ) {
            let spatial = Isometry3::new(shift.into(), Vector3::from(turn) * 0.57);
            let planar = Isometry3::new(
                Vector3::new(shift[0], shift[1], 0.0),
                Vector3::new(0.0, 0.0, turn[2]),
            );
            let both = [(Alignment::Spatial, spatial), (Alignment::Planar, planar)];
            for (alignment, motion) in both {
                let moved: Vec<_> =
                    truth.iter().map(|g| motion.rotation * g + motion.translation.vector).collect();
                let fitted = alignment.fit(&moved, &truth);
                prop_assert!(sum_of_squares(&fitted, &moved, &truth).sqrt() < 1e-8);
            }
        }

        #[test]
        fn no_nearby_motion_fits_better(
            (estimate, truth) in (points(), points()),
            turn in prop::array::uniform3(-0.05..0.05_f64),
            shift in prop::array::uniform3(-0.5..0.5_f64),
        ) {
            let n = estimate.len().min(truth.len());
            let (estimate, truth) = (&estimate[..n], &truth[..n]);
            let best = Alignment::Spatial.fit(estimate, truth);
            let other = best * Isometry3::new(shift.into(), turn.into());
            let least = sum_of_squares(&best, estimate, truth);
            prop_assert!(least <= sum_of_squares(&other, estimate, truth) * (1.0 + 1e-9));
            let best = Alignment::Planar.fit(estimate, truth);
            let nearby = Isometry3::new(
                Vector3::new(shift[0], shift[1], 0.0),
                Vector3::new(0.0, 0.0, turn[2]),
            );
            let least = sum_of_squares(&best, estimate, truth);
            prop_assert!(least <= sum_of_squares(&(best * nearby), estimate, truth) * (1.0 + 1e-9));
        }
    }

    #[test]
    fn a_mirrored_path_is_not_mirrored_back() {
        let truth = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [1.0, 2.0, 0.0],
            [0.0, 0.0, 3.0],
        ]
        .map(Vector3::from);
        let mirrored = truth.map(|p| Vector3::new(-p.x, p.y, p.z));
        let fitted = Alignment::Spatial.fit(&mirrored, &truth);
        let matrix = fitted.rotation.to_rotation_matrix();
        assert!((matrix.matrix().determinant() - 1.0).abs() < 1e-12);
        assert!(sum_of_squares(&fitted, &mirrored, &truth) > 0.1);
    }

    #[test]
    fn degenerate_pairs_still_fit() {
        let still = [Vector3::new(1.0, 2.0, 3.0); 5];
        let there = [Vector3::new(-4.0, 0.0, 3.0); 5];
        for alignment in [Alignment::Planar, Alignment::Spatial] {
            let fitted = alignment.fit(&still, &there);
            assert!(
                sum_of_squares(&fitted, &still, &there) < 1e-20,
                "{alignment:?}"
            );
        }
    }
}
