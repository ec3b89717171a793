//! What is expected to be seen at a point, by what was seen about it.
//!
//! Views of a channel are taken for a Gaussian process over the points from which they were seen, whose kernel the channel's own
//! views have taught. With the views U (rows) from the points about a point x, their kernel matrix K and the kernel k to x:
//!
//! ```text
//! expected  v̂(x) = Uᵀ K⁻¹ k        left open  e(x) = 1 − kᵀ K⁻¹ k        off  q = |v − v̂|² / e
//! ```
//!
//! (Rasmussen & Williams 2006, §2.2). As all views are unit vectors, G = U Uᵀ and b = U v are all that is needed of them:
//! |v − v̂|² = 1 − 2 kᵀK⁻¹b + kᵀK⁻¹GK⁻¹k. Leaving one out at a time says how well the views about x expect one another (Sundararajan &
//! Keerthi 2001); where they do so badly, q counts by so much less.

use nalgebra::{DMatrix, DVector, Matrix3, Point3, Vector3};

use crate::chronicle::revisit::Kernel;

/// Views about a point that count, the nearest first.
const NEAR_MAX: usize = 12;
/// Part that is always left open: positions and kernel are not exact.
const OPEN_MIN: f64 = 0.02;
/// A point is known when no more than this is left open of what is seen there.
const OPEN_MAX: f64 = 0.8;

/// A view with the point from which it was seen.
#[derive(Clone, Copy, Debug)]
pub(in crate::chronicle) struct Seen<'a> {
    pub(in crate::chronicle) at: Point3<f64>,
    pub(in crate::chronicle) vector: &'a [f32],
}

/// The views about a point, ready for what was seen near it.
#[derive(Clone, Debug)]
pub(super) struct Neighbourhood {
    kernel: Kernel,
    points: Vec<Point3<f64>>,
    /// K⁻¹.
    inverse: DMatrix<f64>,
    /// K⁻¹ G K⁻¹.
    gram: DMatrix<f64>,
    /// K⁻¹ b.
    likeness: DVector<f64>,
    /// How far the views are from what they expect of one another; 1 if they are what they should be.
    misfit: f64,
}

/// What a look says of the point from which it was made.
#[derive(Clone, Copy, Debug)]
pub(super) struct Expectation {
    /// Part of what is seen that the views about the point leave open.
    pub(super) open: f64,
    /// Square of how far off it is, 1 on average.
    pub(super) off: f64,
    /// Derivative of half the square by the point \[1/m\], and the Gauss–Newton part of the second one \[1/m²\].
    pub(super) gradient: Vector3<f64>,
    pub(super) hessian: Matrix3<f64>,
}

impl Neighbourhood {
    /// The views about a point, for a look; `None` where there are none.
    pub(super) fn of(
        look: &[f32],
        about: &Point3<f64>,
        views: &[Seen<'_>],
        kernel: Kernel,
    ) -> Option<Self> {
        let mut near: Vec<(f64, &Seen<'_>)> = views
            .iter()
            .map(|seen| ((seen.at - about).norm_squared(), seen))
            .filter(|(squared, _)| *squared <= 4.0 * kernel.length_m.powi(2))
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.truncate(NEAR_MAX);
        if near.is_empty() {
            return None;
        }
        let count = near.len();
        let matrix = DMatrix::from_fn(count, count, |row, column| {
            if row == column {
                1.0 + OPEN_MIN
            } else {
                kernel.at((near[row].1.at - near[column].1.at).norm_squared())
            }
        });
        let inverse = matrix.cholesky()?.inverse();
        let cosine = |a: &[f32], b: &[f32]| f64::from(crate::percept::dot(a, b));
        let gram = DMatrix::from_fn(count, count, |row, column| {
            cosine(near[row].1.vector, near[column].1.vector)
        });
        let likeness = DVector::from_fn(count, |row, _| cosine(near[row].1.vector, look));
        let gram = &inverse * gram * &inverse;
        let each = (0..count).map(|k| gram[(k, k)] / inverse[(k, k)]);
        let misfit = (each.sum::<f64>() / count as f64).max(1.0);
        Some(Self {
            kernel,
            points: near.iter().map(|(_, seen)| seen.at).collect(),
            likeness: &inverse * likeness,
            inverse,
            gram,
            misfit,
        })
    }

    /// What the look says of a point; `None` where nothing is known. The point itself is known to `spread_m`.
    pub(super) fn expect(&self, at: &Point3<f64>, spread_m: f64) -> Option<Expectation> {
        let count = self.points.len();
        let length_squared = self.kernel.length_m.powi(2);
        let kernel = DVector::from_fn(count, |row, _| {
            self.kernel.at((self.points[row] - at).norm_squared())
        });
        let open = 1.0 - kernel.dot(&(&self.inverse * &kernel));
        if open > OPEN_MAX {
            return None;
        }
        let open = (open.max(OPEN_MIN) + spread_m.powi(2) / length_squared).min(1.0) * self.misfit;
        let expected = &self.gram * &kernel;
        let squared = (1.0 - 2.0 * kernel.dot(&self.likeness) + kernel.dot(&expected)).max(0.0);
        // ∂k/∂x = −k (x − p) / ℓ²
        let slopes = DMatrix::from_fn(count, 3, |row, axis| {
            -kernel[row] * (at[axis] - self.points[row][axis]) / length_squared
        });
        let pull = slopes.transpose() * (&expected - &self.likeness) / open;
        let stiff = slopes.transpose() * &self.gram * &slopes / open;
        Some(Expectation {
            open,
            off: squared / open,
            gradient: pull.fixed_rows::<3>(0).into_owned(),
            hessian: stiff.fixed_view::<3, 3>(0, 0).into_owned(),
        })
    }
}

impl Kernel {
    fn at(&self, distance_squared: f64) -> f64 {
        self.likeness * (-0.5 * distance_squared / self.length_m.powi(2)).exp()
    }
}
