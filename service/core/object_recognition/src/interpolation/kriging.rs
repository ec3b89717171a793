//! Universal kriging: the best linear unbiased prediction from values around.

use nalgebra::{DMatrix, DVector, Vector3};

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
    inverse: DMatrix<f64>,
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
        let mut kriging = Self {
            middle,
            positions,
            axes: axes.to_vec(),
            scale_m: length_m,
            inverse: DMatrix::zeros(0, 0),
        };
        let size = count + 1 + axes.len();
        let mut matrix = DMatrix::zeros(size, size);
        for (row, at) in kriging.positions.iter().enumerate() {
            for (column, other) in kriging.positions.iter().enumerate() {
                matrix[(row, column)] = covariance((at - other).norm() / length_m);
            }
            matrix[(row, row)] += noise;
            for (number, value) in kriging.trend(at).into_iter().enumerate() {
                matrix[(row, count + number)] = value;
                matrix[(count + number, row)] = value;
            }
        }
        kriging.inverse = matrix.try_inverse()?;
        Some(kriging)
    }

    /// For a prediction at a point \[m\].
    pub(super) fn weights(&self, point: &Vector3<f64>) -> Weights {
        let near = self.positions.iter();
        let covariances = near.map(|at| covariance((at - point).norm() / self.scale_m));
        let right: Vec<f64> = covariances.chain(self.trend(point)).collect();
        let right = DVector::from_vec(right);
        let solved = &self.inverse * &right;
        Weights {
            variance: (1.0 - solved.dot(&right)).max(0.0),
            of: solved.iter().copied().take(self.positions.len()).collect(),
        }
    }

    fn trend(&self, point: &Vector3<f64>) -> Vec<f64> {
        let along = |axis: &Vector3<f64>| axis.dot(&(point - self.middle)) / self.scale_m;
        std::iter::once(1.0)
            .chain(self.axes.iter().map(along))
            .collect()
    }
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
