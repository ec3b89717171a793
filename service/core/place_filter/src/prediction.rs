//! What level is expected at a point, by what places about it remember.

use nalgebra::{Point3, Vector3};

use crate::kernel::Kernel;
use crate::tuning::predict as tuning;

/// A place that remembers a level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Support {
    /// Where the level was sensed \[m\].
    pub at: Point3<f64>,
    /// The level.
    pub value: f64,
    /// Variance of that position along an axis \[m²\].
    pub spread_m2: f64,
    /// The same again if whoever asks has taught it; else 0.
    pub own_m2: f64,
}

/// A level that is expected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// The level.
    pub mean: f64,
    /// Its change per metre along the axes of the map.
    pub slope: Vector3<f64>,
    /// Variance of that along each axis.
    pub slope_variance: Vector3<f64>,
    /// Variance of the field there, without the noise of a level.
    pub variance: f64,
}

/// The field of a channel at a point, by simple kriging (Matheron 1963; Rasmussen & Williams 2006,
/// §2.2) from the nearest places:
///
/// ```text
/// m(x) = μ + kᵀ K⁻¹ (v − μ)      σ²(x) = σ² − kᵀ K⁻¹ k      K = k(xᵢ, xⱼ) + (n + σ² s²/ℓ²) I
/// ```
///
/// where s² is the variance of the position at which a level was sensed. `None` where nothing is
/// remembered near by.
pub(crate) fn predict(
    kernel: &Kernel,
    supports: &[Support],
    at: &Point3<f64>,
) -> Option<Prediction> {
    let n = supports.len().min(tuning::SUPPORTS);
    let supports = &supports[..n];
    let mut lower = [[0.0; tuning::SUPPORTS]; tuning::SUPPORTS];
    let mut of_values = [0.0; tuning::SUPPORTS];
    let mut of_point = [0.0; tuning::SUPPORTS];
    let mut to_point = [0.0; tuning::SUPPORTS];
    let mut of_slope = [Vector3::zeros(); tuning::SUPPORTS];
    let squared_length = kernel.length_m * kernel.length_m;
    // Cholesky, and both right-hand sides forwards at once.
    for row in 0..n {
        let support = &supports[row];
        for column in 0..=row {
            let squared = (support.at - supports[column].at).norm_squared();
            let mut entry = kernel.covariance(squared);
            if column == row {
                entry += kernel.nugget + kernel.squared_slope() * support.spread_m2;
            }
            for (own, other) in lower[row].iter().zip(&lower[column]).take(column) {
                entry -= own * other;
            }
            lower[row][column] = if column == row {
                entry.max(1e-9 * kernel.sill).sqrt()
            } else {
                entry / lower[column][column]
            };
        }
        to_point[row] = kernel.covariance((support.at - at).norm_squared());
        let (mut value, mut point) = (support.value - kernel.mean, to_point[row]);
        let mut slope = (support.at - at) * (to_point[row] / squared_length);
        for k in 0..row {
            slope -= of_slope[k] * lower[row][k];
            value -= lower[row][k] * of_values[k];
            point -= lower[row][k] * of_point[k];
        }
        of_values[row] = value / lower[row][row];
        of_point[row] = point / lower[row][row];
        of_slope[row] = slope / lower[row][row];
    }
    let explained: f64 = of_point[..n].iter().map(|x| x * x).sum();
    let variance = (kernel.sill - explained).max(0.0);
    if n == 0 || variance > tuning::OPEN_MAX * kernel.sill {
        return None;
    }
    // Backwards for the weights of the values.
    for row in (0..n).rev() {
        for k in row + 1..n {
            of_values[row] -= lower[k][row] * of_values[k];
        }
        of_values[row] /= lower[row][row];
    }
    let (mut mean, mut slope) = (kernel.mean, Vector3::zeros());
    let known = of_slope[..n].iter().map(|slope| slope.component_mul(slope));
    let known = known.fold(Vector3::zeros(), |sum, each| sum + each);
    for (k, support) in supports.iter().enumerate() {
        let part = of_values[k] * to_point[k];
        mean += part;
        slope += (support.at - at) * (part / squared_length);
    }
    Some(Prediction {
        mean,
        slope,
        slope_variance: known.map(|known| (kernel.squared_slope() - known).max(0.0)),
        variance,
    })
}
