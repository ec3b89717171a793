//! Deformation test: whether a deformed model explains contacts better than the model as learned.

use nalgebra::{Point3, SMatrix, SVector, Vector3};

use crate::z_score;

/// Degrees of freedom of the pose: three translations, three rotations.
const POSE: usize = 6;
/// Deformations, the first by which similar objects differ: a stretch along each of three axes,
/// three shears, and an offset of the surface along its normals.
const DEFORMATIONS: usize = 7;
const ALL: usize = POSE + DEFORMATIONS;

/// Height of one contact over a model's surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Height {
    /// Position of the contact, from the model's middle \[m\].
    pub(crate) point: Point3<f64>,
    /// The surface's normal there.
    pub(crate) normal: Vector3<f64>,
    /// Height \[m\].
    pub(crate) depth_m: f64,
    /// Its variance \[m²\].
    pub(crate) variance_m2: f64,
    /// Share of that variance that is the model's own error.
    pub(crate) model_share: f64,
    /// Probability that the contact is one of the smooth surface.
    pub(crate) share: f64,
}

/// A score test of the heights of contacts against seven deformations of the model.
///
/// With d the heights, W their inverse variances, P their Jacobian with respect to the pose and G
/// that with respect to the deformations in standard deviations, the score is y = Gᵀ W d after the
/// pose is eliminated, and H, the Schur complement of Gᵀ W G, is its covariance for the model as
/// learned. With standard normal deformations twice the gain in log-likelihood is yᵀ (1 + H)⁻¹ y.
/// For the model as learned its mean is tr K and its variance 2 tr K², K = H (1 + H)⁻¹.
#[derive(Clone, Debug)]
pub(crate) struct DeformationTest {
    /// Half the model's extent \[m\]: a deformation of one moves its ends so far.
    radius_m: f64,
    /// Standard deviation of each deformation at the model's ends \[m\].
    differs_m: f64,
    matrix: SMatrix<f64, ALL, ALL>,
    right: SVector<f64, ALL>,
    count: f64,
    /// Sum of the model's shares of the heights' variances.
    model_shares: f64,
}

impl DeformationTest {
    /// For a model of this extent, from which other objects differ by about `differs_m`.
    pub(crate) fn new(extent_m: f64, differs_m: f64) -> Self {
        let radius_m = (0.5 * extent_m).max(1e-9);
        let mut matrix = SMatrix::<f64, ALL, ALL>::zeros();
        // Prior of the pose: anywhere in the model.
        let pose = 1.0 / (radius_m * radius_m);
        matrix
            .fixed_view_mut::<POSE, POSE>(0, 0)
            .fill_diagonal(pose);
        Self {
            radius_m,
            differs_m,
            matrix,
            right: SVector::zeros(),
            count: 0.0,
            model_shares: 0.0,
        }
    }

    /// One more contact.
    pub(crate) fn add(&mut self, height: &Height) {
        let (n, x) = (height.normal, height.point.coords / self.radius_m);
        let turn = x.cross(&n);
        let stretch = n.component_mul(&x) * self.differs_m;
        let shear =
            [(1, 2), (0, 2), (0, 1)].map(|(a, b)| (n[a] * x[b] + n[b] * x[a]) * self.differs_m);
        let row = SVector::<f64, ALL>::from_column_slice(&[
            n.x,
            n.y,
            n.z,
            turn.x,
            turn.y,
            turn.z,
            stretch.x,
            stretch.y,
            stretch.z,
            shear[0],
            shear[1],
            shear[2],
            self.differs_m,
        ]);
        let weight = height.share / height.variance_m2;
        self.matrix += row * row.transpose() * weight;
        self.right += row * (weight * height.depth_m);
        self.count += height.share;
        self.model_shares += height.share * height.model_share;
    }

    /// The test as a z-score: lower where a deformed model explains the contacts better than the
    /// model of `places` places as learned. `correlated` is the mean number of contacts that share
    /// an error of the model. `None` if the contacts fix no deformation.
    pub(crate) fn z_score(&self, places: usize, correlated: f64) -> Option<f64> {
        let matrix = &self.matrix;
        let pose = matrix.fixed_view::<POSE, POSE>(0, 0).try_inverse()?;
        let lever = matrix.fixed_view::<DEFORMATIONS, POSE>(POSE, 0) * pose;
        let own = matrix.fixed_view::<DEFORMATIONS, DEFORMATIONS>(POSE, POSE)
            - lever * matrix.fixed_view::<POSE, DEFORMATIONS>(0, POSE);
        let pull =
            self.right.fixed_rows::<DEFORMATIONS>(POSE) - lever * self.right.fixed_rows::<POSE>(0);
        // With n contacts and N places the model adds n/N to the variance, and its errors are
        // common to all contacts near one another.
        let model_share = self.model_shares / self.count.max(1e-9);
        let inflation = 1.0 + model_share * (correlated - 1.0).max(0.0);
        let per = 1.0 / ((1.0 + self.count / places.max(1) as f64) * inflation);
        let (own, pull) = (own * per, pull * per);
        let one = SMatrix::<f64, DEFORMATIONS, DEFORMATIONS>::identity();
        let inverse = (one + own).try_inverse()?;
        let gain = pull.dot(&(inverse * pull));
        let shrinkage = one - inverse;
        let (mean, squares) = (shrinkage.trace(), shrinkage.norm_squared());
        if mean < 1e-9 || squares < 1e-18 {
            return None;
        }
        // A sum of weighted squares is about a multiple of a chi-squared number (Satterthwaite
        // 1946).
        let degrees = mean * mean / squares;
        Some(z_score::from_chi_squared(gain / mean * degrees, degrees))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE_M: f64 = 0.002;

    fn normal(key: u64) -> f64 {
        let uniform = |k| random::uniform(8, [0, 0, key * 16 + k]);
        (0..12).map(uniform).sum::<f64>() - 6.0
    }

    /// Of 60 contacts with a ball of 80 mm that differs so much from the one learned where its
    /// normal is this.
    fn deviation(trial: u64, differs_m: impl Fn(&Vector3<f64>) -> f64) -> f64 {
        let mut deformation_test = DeformationTest::new(0.08, 0.004);
        for k in 0..60 {
            let key = 1000 * trial + 4 * k;
            let normal_at = Vector3::from_fn(|axis, _| normal(key + axis as u64)).normalize();
            deformation_test.add(&Height {
                point: Point3::from(normal_at * 0.04),
                normal: normal_at,
                depth_m: differs_m(&normal_at) + NOISE_M * normal(key + 3),
                variance_m2: NOISE_M * NOISE_M,
                model_share: 0.0,
                share: 1.0,
            });
        }
        deformation_test.z_score(1000, 1.0).unwrap()
    }

    #[test]
    fn another_size_or_shape_is_noticed_and_another_pose_is_none() {
        let many = |differs_m: &dyn Fn(&Vector3<f64>) -> f64| -> (f64, f64) {
            let all: Vec<f64> = (0..100).map(|trial| deviation(trial, differs_m)).collect();
            let mean = all.iter().sum::<f64>() / 100.0;
            let squares = all.iter().map(|own| (own - mean).powi(2)).sum::<f64>();
            (mean, (squares / 100.0).sqrt())
        };
        let (mean, sd) = many(&|_| 0.0);
        assert!(mean.abs() < 0.4 && (0.7..1.3).contains(&sd), "{mean} {sd}");
        // A ball that is moved is the same ball.
        let (moved, _) = many(&|normal| 0.003 * normal.x);
        assert!((moved - mean).abs() < 0.1, "{moved}");
        // One of 83 mm, and one that is 4 mm longer than wide; each contact differs by 0.75
        // deviations, or less.
        let (larger, _) = many(&|_| 0.0015);
        let (longer, _) = many(&|normal| 0.002 * (2.0 * normal.z * normal.z - 1.0));
        assert!(larger < -2.5 && longer < -2.5, "{larger} {longer}");
    }

    #[test]
    fn errors_of_the_map_that_many_contacts_share_are_no_other_shape() {
        let mean = |together: f64| {
            let deviations = (0..100).map(|trial| {
                let mut deformation_test = DeformationTest::new(0.08, 0.004);
                // Where the map errs as much as a contact does, and eight contacts with each place.
                for k in 0..64 {
                    let place = 1_000_000 + 1000 * trial + 4 * (k / 8);
                    let normal_at =
                        Vector3::from_fn(|axis, _| normal(place + axis as u64)).normalize();
                    let own = normal(2_000_000 + 1000 * trial + k);
                    deformation_test.add(&Height {
                        point: Point3::from(normal_at * 0.04),
                        normal: normal_at,
                        depth_m: NOISE_M * (normal(place + 3) + own),
                        variance_m2: 2.0 * NOISE_M * NOISE_M,
                        model_share: 0.5,
                        share: 1.0,
                    });
                }
                deformation_test.z_score(1_000_000, together).unwrap()
            });
            deviations.sum::<f64>() / 100.0
        };
        let (correlated, independent) = (mean(8.0), mean(1.0));
        assert!(
            correlated.abs() < 0.5 && independent < -1.5,
            "{correlated} {independent}"
        );
    }

    #[test]
    fn contacts_that_the_map_does_not_explain_fix_no_deformation() {
        assert!(
            DeformationTest::new(0.08, 0.004)
                .z_score(1000, 1.0)
                .is_none()
        );
    }
}
