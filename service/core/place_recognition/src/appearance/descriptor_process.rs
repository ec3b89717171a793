//! Descriptor Gaussian process: the descriptor that is expected at a point, by views about it.
//!
//! Views of a channel are samples of a Gaussian process over position with the kernel of the
//! channel. With views U (rows) from points about a point x, their kernel matrix K and the kernel k
//! to x:
//!
//! ```text
//! mean v̂(x) = Uᵀ K⁻¹ k        variance e(x) = 1 − kᵀ K⁻¹ k        residual q = |v − v̂|² / e
//! ```
//!
//! (Rasmussen & Williams 2006, §2.2). All views are unit vectors, so G = U Uᵀ and b = U v suffice:
//! |v − v̂|² = 1 − 2 kᵀK⁻¹b + kᵀK⁻¹GK⁻¹k. Leave-one-out residuals say how well the views about x
//! predict one another (Sundararajan & Keerthi 2001); where they do so badly, e grows by the same
//! factor.

use nalgebra::{DMatrix, DVector, Matrix3, Point3, Vector3};

use crate::descriptor::cosine;
use crate::tuning::process as tuning;
use crate::views::Kernel;

/// A view with its position.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReferenceView<'a> {
    pub(crate) at: Point3<f64>,
    pub(crate) vector: &'a [f32],
}

/// Reference views with the numbers of their channels.
pub(crate) type ReferenceViews<'a> = Vec<(u8, ReferenceView<'a>)>;

/// The process about a point, conditioned on a query.
#[derive(Clone, Debug)]
pub(crate) struct DescriptorProcess {
    kernel: Kernel,
    points: Vec<Point3<f64>>,
    /// K⁻¹.
    inverse: DMatrix<f64>,
    /// K⁻¹ G K⁻¹.
    gram: DMatrix<f64>,
    /// K⁻¹ b.
    cross: DVector<f64>,
    /// Mean squared leave-one-out residual of the views; at least 1.
    misfit: f64,
}

/// The residual of a query at a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Expectation {
    /// Variance of the prediction.
    pub(super) open: f64,
    /// Squared residual, 1 on average.
    pub(super) off: f64,
    /// Gradient of half the squared residual by the point \[1/m\], and its Gauss–Newton Hessian
    /// \[1/m²\].
    pub(super) gradient: Vector3<f64>,
    pub(super) hessian: Matrix3<f64>,
}

/// The residual of a query at an uncertain point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prediction {
    /// Variance of the prediction, that of the point included.
    pub(crate) open: f64,
    /// Squared residual, 1 on average.
    pub(crate) off: f64,
}

/// The `most` nearest of some views, given with their squared distances \[m²\], within two lengths
/// of the kernel; the nearest first.
pub(super) fn nearest<'a, 'v: 'a>(
    views: impl Iterator<Item = (f64, &'a ReferenceView<'v>)>,
    kernel: Kernel,
    most: usize,
) -> Vec<&'a ReferenceView<'v>> {
    let mut near: Vec<_> = views
        .filter(|(squared, _)| *squared <= 4.0 * kernel.length_m.powi(2))
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    near.truncate(most);
    near.into_iter().map(|(_, seen)| seen).collect()
}

/// K⁻¹ and G = U Uᵀ of some views; `None` if there are none.
pub(super) fn kernel_matrices(
    near: &[&ReferenceView<'_>],
    kernel: Kernel,
) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
    let count = near.len();
    if count == 0 {
        return None;
    }
    let mut matrix = DMatrix::from_diagonal_element(count, count, 1.0 + tuning::OPEN_MIN);
    let mut gram = DMatrix::zeros(count, count);
    for column in 0..count {
        for row in column..count {
            let (one, other) = (near[row], near[column]);
            // Both are the same either way round.
            let product = cosine(one.vector, other.vector);
            (gram[(row, column)], gram[(column, row)]) = (product, product);
            if row != column {
                let known = kernel.at((one.at - other.at).norm_squared());
                (matrix[(row, column)], matrix[(column, row)]) = (known, known);
            }
        }
    }
    Some((matrix.cholesky()?.inverse(), gram))
}

impl DescriptorProcess {
    /// The process of the views about a point, for a query; `None` if there are none.
    pub(crate) fn of(
        query: &[f32],
        about: &Point3<f64>,
        views: &[ReferenceView<'_>],
        kernel: Kernel,
    ) -> Option<Self> {
        let views = views
            .iter()
            .map(|seen| ((seen.at - about).norm_squared(), seen));
        let near = nearest(views, kernel, tuning::NEAR_MAX);
        let count = near.len();
        let (inverse, gram) = kernel_matrices(&near, kernel)?;
        let cross = DVector::from_fn(count, |row, _| cosine(near[row].vector, query));
        let gram = &inverse * gram * &inverse;
        let each = (0..count).map(|k| gram[(k, k)] / inverse[(k, k)]);
        let misfit = (each.sum::<f64>() / count as f64).max(1.0);
        Some(Self {
            kernel,
            points: near.iter().map(|seen| seen.at).collect(),
            cross: &inverse * cross,
            inverse,
            gram,
            misfit,
        })
    }

    /// The residual at a point that is known with a covariance \[m²\]; `None` where little is
    /// known. The mean over the point is a prediction with another kernel:
    ///
    /// ```text
    /// k̃ = E k = c |I + Σ/ℓ²|^−½ exp(−½ dᵀ (ℓ²I + Σ)⁻¹ d)        variance  1 − k̃ᵀ K⁻¹ k̃
    /// ```
    pub(crate) fn predict(
        &self,
        at: &Point3<f64>,
        covariance: &Matrix3<f64>,
    ) -> Option<Prediction> {
        let known = DVector::from_fn(self.points.len(), |row, _| {
            self.kernel.at((self.points[row] - at).norm_squared())
        });
        if (1.0 - known.dot(&(&self.inverse * &known))) * self.misfit > tuning::KNOWN_MAX {
            return None;
        }
        let length_squared = self.kernel.length_m.powi(2);
        let spread = Matrix3::identity() * length_squared + covariance;
        let factor = spread.cholesky()?;
        let share = (length_squared.powi(3) / factor.determinant()).sqrt();
        let kernel = DVector::from_fn(self.points.len(), |row, _| {
            let apart = self.points[row] - at;
            self.kernel.cosine * share * (-0.5 * apart.dot(&factor.solve(&apart))).exp()
        });
        let open =
            (1.0 - kernel.dot(&(&self.inverse * &kernel))).max(tuning::OPEN_MIN) * self.misfit;
        if open > tuning::OPEN_MAX {
            return None;
        }
        let expected = kernel.dot(&(&self.gram * &kernel));
        let squared = (1.0 - 2.0 * kernel.dot(&self.cross) + expected).max(0.0);
        let off = squared / open;
        Some(Prediction { open, off })
    }

    /// The residual at a point that is known to `spread_m`; `None` where nothing is known.
    pub(super) fn expect(&self, at: &Point3<f64>, spread_m: f64) -> Option<Expectation> {
        let count = self.points.len();
        let length_squared = self.kernel.length_m.powi(2);
        let kernel = DVector::from_fn(count, |row, _| {
            self.kernel.at((self.points[row] - at).norm_squared())
        });
        let open = 1.0 - kernel.dot(&(&self.inverse * &kernel));
        if open > tuning::OPEN_MAX {
            return None;
        }
        let open =
            (open.max(tuning::OPEN_MIN) + spread_m.powi(2) / length_squared).min(1.0) * self.misfit;
        let expected = &self.gram * &kernel;
        let squared = (1.0 - 2.0 * kernel.dot(&self.cross) + kernel.dot(&expected)).max(0.0);
        // ∂k/∂x = −k (x − p) / ℓ²
        let slopes = DMatrix::from_fn(count, 3, |row, axis| {
            -kernel[row] * (at[axis] - self.points[row][axis]) / length_squared
        });
        let normal_equations = slopes.transpose() * (&expected - &self.cross) / open;
        let stiff = slopes.transpose() * &self.gram * &slopes / open;
        Some(Expectation {
            open,
            off: squared / open,
            gradient: normal_equations.fixed_rows::<3>(0).into_owned(),
            hessian: stiff.fixed_view::<3, 3>(0, 0).into_owned(),
        })
    }
}

impl Kernel {
    pub(super) fn at(&self, distance_squared: f64) -> f64 {
        self.cosine * (-0.5 * distance_squared / self.length_m.powi(2)).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NUMBERS: usize = 48;
    const KERNEL: Kernel = Kernel {
        cosine: 0.99,
        length_m: 1.0,
        numbers: 48.0,
    };

    /// A view of a smooth scenery, of length 1.
    fn view(at: &Point3<f64>) -> Vec<f32> {
        let wave = |k: usize, axis: usize| ((k * 3 + axis) as f64 * 12.9898).sin() * 1.7;
        let number = |k: usize| {
            (wave(k, 0) * at.x + wave(k, 1) * at.y + wave(k, 2) * at.z + k as f64 * 2.4).cos()
        };
        let numbers: Vec<f64> = (0..NUMBERS).map(number).collect();
        let length = numbers.iter().map(|x| x * x).sum::<f64>().sqrt();
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a view needs no more digits"
        )]
        let short = |x: &f64| (x / length) as f32;
        numbers.iter().map(short).collect()
    }

    fn points() -> Vec<Point3<f64>> {
        let point = |k: u32| {
            let k = f64::from(k);
            Point3::new(0.5 * k.sin(), 0.4 * (1.7 * k).cos(), 0.3 * (0.6 * k).sin())
        };
        (0..7).map(point).collect()
    }

    fn neighbourhood(query: &[f32], points: &[Point3<f64>]) -> DescriptorProcess {
        let vectors: Vec<Vec<f32>> = points.iter().map(view).collect();
        let seen = points.iter().zip(&vectors);
        let seen: Vec<ReferenceView<'_>> = seen
            .map(|(&at, vector)| ReferenceView { at, vector })
            .collect();
        DescriptorProcess::of(query, &Point3::origin(), &seen, KERNEL).unwrap()
    }

    /// Against the sum over the views themselves.
    #[test]
    fn what_is_off_is_the_distance_to_what_is_expected() {
        let points = points();
        let query = view(&Point3::new(0.1, 0.2, -0.1));
        let near = neighbourhood(&query, &points);
        for at in [
            Point3::new(0.1, 0.2, -0.1),
            Point3::new(-0.4, 0.0, 0.3),
            Point3::origin(),
        ] {
            let kernel = near
                .points
                .iter()
                .map(|p| KERNEL.at((p - at).norm_squared()));
            let weights = &near.inverse * DVector::from_iterator(points.len(), kernel);
            let mut squared = 0.0;
            for (number, seen) in query.iter().enumerate() {
                let views = near
                    .points
                    .iter()
                    .map(|point| f64::from(view(point)[number]));
                let expected: f64 = views.zip(weights.iter()).map(|(x, w)| x * w).sum();
                squared += (f64::from(*seen) - expected).powi(2);
            }
            let found = near.expect(&at, 0.0).unwrap();
            assert!((found.off * found.open - squared).abs() < 1e-5, "{squared}");
        }
    }

    #[test]
    fn the_gradient_is_that_of_half_the_square() {
        let query = view(&Point3::new(0.1, 0.2, -0.1));
        let near = neighbourhood(&query, &points());
        let at = Point3::new(-0.2, 0.3, 0.1);
        let here = near.expect(&at, 0.0).unwrap();
        let step = 1e-5;
        for axis in 0..3 {
            let mut moved = at;
            moved[axis] += step;
            let there = near.expect(&moved, 0.0).unwrap();
            let slope = 0.5 * (there.off * there.open - here.off * here.open) / step / here.open;
            let error = (slope - here.gradient[axis]).abs();
            assert!(
                error < 1e-3 * slope.abs().max(1.0),
                "{slope} {}",
                here.gradient[axis]
            );
        }
    }

    #[test]
    fn a_view_is_expected_where_it_was_made_and_nowhere_else() {
        let at = Point3::new(0.1, 0.2, -0.1);
        let near = neighbourhood(&view(&at), &points());
        let off = |at: &Point3<f64>| near.expect(at, 0.0).unwrap().off;
        for apart in [Vector3::x(), Vector3::y(), -Vector3::z(), -Vector3::x()] {
            assert!(off(&at) < off(&(at + apart * 0.4)));
        }
    }

    /// Against what is expected at points drawn from the covariance.
    #[test]
    fn what_is_foreseen_is_the_mean_over_where_the_point_may_be() {
        let (at, points) = (Point3::new(0.1, 0.2, -0.1), points());
        let near = neighbourhood(&view(&at), &points);
        let exact = near.predict(&at, &Matrix3::zeros()).unwrap();
        let expected = near.expect(&at, 0.0).unwrap();
        assert!((exact.open - expected.open).abs() < 1e-9);
        assert!((exact.off - expected.off).abs() < 1e-6);
        // Five points along each axis, by Gauss and Hermite: exact up to the ninth power.
        let sd_m = 0.3;
        let (nodes, weights) = (
            [-2.856_970, -1.355_626, 0.0, 1.355_626, 2.856_970],
            [
                0.011_257_4,
                0.222_075_9,
                0.533_333_3,
                0.222_075_9,
                0.011_257_4,
            ],
        );
        let mut mean = DVector::zeros(points.len());
        for k in 0..125_usize {
            let digits = [k % 5, k / 5 % 5, k / 25];
            let off = Vector3::from_fn(|axis, _| sd_m * nodes[digits[axis]]);
            let weight: f64 = digits.iter().map(|digit| weights[*digit]).product();
            let kernel = near.points.iter().map(|point| {
                let squared = (point - (at + off)).norm_squared();
                weight * KERNEL.at(squared)
            });
            mean += DVector::from_iterator(points.len(), kernel);
        }
        let open = (1.0 - mean.dot(&(&near.inverse * &mean))) * near.misfit;
        let unsure = Matrix3::identity() * sd_m * sd_m;
        let predicted = near.predict(&at, &unsure).unwrap();
        assert!(
            (predicted.open - open).abs() < 1e-3,
            "{} {open}",
            predicted.open
        );
        assert!(predicted.open > exact.open);
    }

    #[test]
    fn far_from_all_views_nothing_is_expected() {
        let near = neighbourhood(&view(&Point3::origin()), &points());
        assert!(near.expect(&Point3::new(9.0, 0.0, 0.0), 0.0).is_none());
        let alone = DescriptorProcess::of(&[1.0], &Point3::origin(), &[], KERNEL);
        assert!(alone.is_none());
    }
}
