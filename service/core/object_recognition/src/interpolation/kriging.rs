//! Universal kriging: the best linear unbiased prediction from values around.

use nalgebra::{DMatrix, DVector, Dyn, LU, Vector3};

/// Weights of the values at some places for a prediction in between.
///
/// The values are a Gaussian process of unit variance with a Matérn covariance (ν = 5/2) on top of
/// a linear trend along some axes, and noise (Matheron 1969; Rasmussen and Williams 2006, ch. 2.7
/// and 4.2).
#[derive(Debug)]
pub(super) struct Kriging {
    middle: Vector3<f64>,
    positions: Vec<Vector3<f64>>,
    axes: Vec<Vector3<f64>>,
    scale_m: f64,
    matrix: LU<f64, Dyn, Dyn>,
}

/// Weights of the values, and the variance of the prediction per that of the process.
#[derive(Debug)]
pub(super) struct Weights {
    pub(super) of: Vec<f64>,
    pub(super) variance: f64,
}

impl Kriging {
    /// Over these positions \[m\], with a trend along these axes, a length \[m\], and noise per
    /// variance of the process. `None` if they do not fix the trend.
    pub(super) fn new(
        positions: Vec<Vector3<f64>>,
        axes: &[Vector3<f64>],
        length_m: f64,
        noise: f64,
    ) -> Option<Self> {
        let count = positions.len();
        if count < axes.len() + 2 {
            return None;
        }
        let middle = positions.iter().sum::<Vector3<f64>>() / count as f64;
        let size = count + 1 + axes.len();
        let mut matrix = DMatrix::zeros(size, size);
        for (row, at) in positions.iter().enumerate() {
            for (column, other) in positions[..row].iter().enumerate() {
                let covariance = covariance((at - other).norm() / length_m);
                matrix[(row, column)] = covariance;
                matrix[(column, row)] = covariance;
            }
            matrix[(row, row)] = covariance(0.0) + noise;
            for (number, value) in trend(at, &middle, axes, length_m).enumerate() {
                matrix[(row, count + number)] = value;
                matrix[(count + number, row)] = value;
            }
        }
        let matrix = matrix.lu();
        matrix.is_invertible().then(|| Self {
            middle,
            positions,
            axes: axes.to_vec(),
            scale_m: length_m,
            matrix,
        })
    }

    /// For a prediction at a point \[m\].
    pub(super) fn weights(&self, point: &Vector3<f64>) -> Weights {
        let near = self.positions.iter();
        let covariances = near.map(|at| covariance((at - point).norm() / self.scale_m));
        let trend = trend(point, &self.middle, &self.axes, self.scale_m);
        let right = DVector::from_vec(covariances.chain(trend).collect());
        let solved = { self.matrix.solve(&right) }.expect("the matrix is invertible");
        Weights {
            variance: (1.0 - solved.dot(&right)).max(0.0),
            of: solved.iter().copied().take(self.positions.len()).collect(),
        }
    }
}

/// A constant, and what grows linearly along each axis from the middle, in lengths.
fn trend(
    point: &Vector3<f64>,
    middle: &Vector3<f64>,
    axes: &[Vector3<f64>],
    length_m: f64,
) -> impl Iterator<Item = f64> {
    let apart = point - middle;
    let along = axes.iter().map(move |axis| axis.dot(&apart) / length_m);
    std::iter::once(1.0).chain(along)
}

impl Weights {
    /// The prediction of these values.
    pub(super) fn mean(&self, values: impl Iterator<Item = f64>) -> f64 {
        self.of.iter().zip(values).map(|(w, value)| w * value).sum()
    }
}

/// Matérn covariance (ν = 5/2) at a distance in lengths.
fn covariance(distance: f64) -> f64 {
    let a = 5.0_f64.sqrt() * distance;
    (1.0 + a + a * a / 3.0) * (-a).exp()
}
