//! Whether a map that is strained explains contacts better than the map as it was learned.

use nalgebra::{Point3, SMatrix, SVector, Vector3};

use super::deviation;

/// Motions of the pose: three shifts, three turns.
const POSE: usize = 6;
/// Ways in which something else differs at first from what it is like: stretched along three axes, sheared across three,
/// or its surface farther out everywhere.
const WAYS: usize = 7;
const ALL: usize = POSE + WAYS;

/// How high one contact lies over a map's surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Height {
    /// Where, from the map's middle \[m\].
    pub(super) point: Point3<f64>,
    /// The surface's normal there.
    pub(super) normal: Vector3<f64>,
    /// Height \[m\].
    pub(super) depth_m: f64,
    /// Its variance \[m²\].
    pub(super) variance_m2: f64,
    /// Share of the map's own errors in that.
    pub(super) map_share: f64,
    /// Probability that it is one over the smooth surface.
    pub(super) share: f64,
}

/// The heights of contacts over a map, as a right pose of a map that is strained would have them.
///
/// With d the heights, P what a small motion of the pose makes of them, G what each way to strain the map by one deviation makes of
/// them, and W their inverse variances, the strain is told by y = Gᵀ W d, of which what the pose could be is taken away; without
/// strain its covariance is H, the same of Gᵀ W G. The sum yᵀ (1 + H)⁻¹ y is what the log-likelihood gains if the ways are
/// normal numbers, twice; without strain its mean is tr K and its variance 2 tr K², K = H (1 + H)⁻¹.
#[derive(Clone, Debug)]
pub(super) struct Strain {
    /// Half the map's extent \[m\]: a strain of one moves its ends so far.
    radius_m: f64,
    /// Deviation of each way, at the map's ends \[m\].
    differs_m: f64,
    matrix: SMatrix<f64, ALL, ALL>,
    right: SVector<f64, ALL>,
    count: f64,
    /// Shares of the map's own errors.
    map_shares: f64,
}

impl Strain {
    /// Of a map of this extent, from which others differ by about so much.
    pub(super) fn new(extent_m: f64, differs_m: f64) -> Self {
        let radius_m = (0.5 * extent_m).max(1e-9);
        let mut matrix = SMatrix::<f64, ALL, ALL>::zeros();
        // The pose may be anywhere in the map.
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
            map_shares: 0.0,
        }
    }

    /// One more contact.
    pub(super) fn add(&mut self, height: &Height) {
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
        self.map_shares += height.share * height.map_share;
    }

    /// How much better a strained map explains the contacts than one of `places` places that is as it was learned, as a
    /// deviation. `together` contacts on average are where the map errs alike. `None` if nothing tells.
    pub(super) fn deviation(&self, places: usize, together: f64) -> Option<f64> {
        let matrix = &self.matrix;
        let pose = matrix.fixed_view::<POSE, POSE>(0, 0).try_inverse()?;
        let lever = matrix.fixed_view::<WAYS, POSE>(POSE, 0) * pose;
        let own = matrix.fixed_view::<WAYS, WAYS>(POSE, POSE)
            - lever * matrix.fixed_view::<POSE, WAYS>(0, POSE);
        let pull = self.right.fixed_rows::<WAYS>(POSE) - lever * self.right.fixed_rows::<POSE>(0);
        // The map is as uncertain as so many contacts leave it, and its errors are those of all contacts near one another.
        let map_share = self.map_shares / self.count.max(1e-9);
        let alike = 1.0 + map_share * (together - 1.0).max(0.0);
        let per = 1.0 / ((1.0 + self.count / places.max(1) as f64) * alike);
        let (own, pull) = (own * per, pull * per);
        let one = SMatrix::<f64, WAYS, WAYS>::identity();
        let inverse = (one + own).try_inverse()?;
        let gain = pull.dot(&(inverse * pull));
        let told = one - inverse;
        let (mean, squares) = (told.trace(), told.norm_squared());
        if mean < 1e-9 || squares < 1e-18 {
            return None;
        }
        // A sum of unlike squares is about a multiple of a chi-squared number (Satterthwaite 1946).
        let degrees = mean * mean / squares;
        Some(deviation::of_chi_squared(gain / mean * degrees, degrees))
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

    /// Of 60 contacts with a ball of 80 mm that differs so much from the one learned where its normal is this.
    fn deviation(trial: u64, differs_m: impl Fn(&Vector3<f64>) -> f64) -> f64 {
        let mut strain = Strain::new(0.08, 0.004);
        for k in 0..60 {
            let key = 1000 * trial + 4 * k;
            let normal_at = Vector3::from_fn(|axis, _| normal(key + axis as u64)).normalize();
            strain.add(&Height {
                point: Point3::from(normal_at * 0.04),
                normal: normal_at,
                depth_m: differs_m(&normal_at) + NOISE_M * normal(key + 3),
                variance_m2: NOISE_M * NOISE_M,
                map_share: 0.0,
                share: 1.0,
            });
        }
        strain.deviation(1000, 1.0).unwrap()
    }

    #[test]
    fn another_size_or_shape_is_told_and_another_pose_is_none() {
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
        // One of 83 mm, and one that is 4 mm longer than wide; each contact tells 0.75 deviations, or less.
        let (larger, _) = many(&|_| 0.0015);
        let (longer, _) = many(&|normal| 0.002 * (2.0 * normal.z * normal.z - 1.0));
        assert!(larger < -2.5 && longer < -2.5, "{larger} {longer}");
    }

    #[test]
    fn errors_of_the_map_that_many_contacts_share_are_no_other_shape() {
        let mean = |together: f64| {
            let deviations = (0..100).map(|trial| {
                let mut strain = Strain::new(0.08, 0.004);
                // Where the map errs as much as a contact does, and eight contacts with each place.
                for k in 0..64 {
                    let place = 1_000_000 + 1000 * trial + 4 * (k / 8);
                    let normal_at =
                        Vector3::from_fn(|axis, _| normal(place + axis as u64)).normalize();
                    let own = normal(2_000_000 + 1000 * trial + k);
                    strain.add(&Height {
                        point: Point3::from(normal_at * 0.04),
                        normal: normal_at,
                        depth_m: NOISE_M * (normal(place + 3) + own),
                        variance_m2: 2.0 * NOISE_M * NOISE_M,
                        map_share: 0.5,
                        share: 1.0,
                    });
                }
                strain.deviation(1_000_000, together).unwrap()
            });
            deviations.sum::<f64>() / 100.0
        };
        let (told, untold) = (mean(8.0), mean(1.0));
        assert!(told.abs() < 0.5 && untold < -1.5, "{told} {untold}");
    }

    #[test]
    fn contacts_that_the_map_does_not_explain_tell_nothing_of_its_shape() {
        assert!(Strain::new(0.08, 0.004).deviation(1000, 1.0).is_none());
    }
}
