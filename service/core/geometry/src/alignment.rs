//! Alignment of points with points.

use nalgebra::{Isometry3, Matrix3, Point3, SVD, Translation3, Vector3};

use super::rotation::{planar_procrustes, rotation_of};

/// Steps of a decomposition, which needs some ten.
const STEPS_MAX: usize = 200;

/// The rigid motion of least squares that takes the second point of each pair to the first (Horn
/// 1987), by weight. `None` when the points have no extent. In the plane only a turn about z and a
/// shift along x and y is sought.
pub fn align(
    pairs: &[(Point3<f64>, Point3<f64>)],
    weights: &[f64],
    is_planar: bool,
) -> Option<Isometry3<f64>> {
    let to = centre(pairs.iter().map(|pair| pair.0.coords), weights);
    let from = centre(pairs.iter().map(|pair| pair.1.coords), weights);
    let mut products = Matrix3::zeros();
    for (pair, &weight) in pairs.iter().zip(weights) {
        products += (pair.0.coords - to) * (pair.1.coords - from).transpose() * weight;
    }
    let rotation = if is_planar {
        let sine = products[(1, 0)] - products[(0, 1)];
        let cosine = products[(0, 0)] + products[(1, 1)];
        if sine == 0.0 && cosine == 0.0 {
            return None;
        }
        planar_procrustes(&products)
    } else {
        // Numbers beyond all bounds must not keep it going for ever.
        let svd = SVD::try_new(products, true, true, f64::EPSILON, STEPS_MAX)?;
        rotation_of(&svd)?
    };
    let mut shift = to - rotation * from;
    if is_planar {
        // Both move on one floor.
        shift.z = 0.0;
    }
    let pose = Isometry3::from_parts(Translation3::from(shift), rotation);
    let numbers = pose
        .translation
        .vector
        .iter()
        .chain(pose.rotation.coords.iter());
    numbers.copied().all(f64::is_finite).then_some(pose)
}

/// Weighted mean.
pub fn centre(points: impl Iterator<Item = Vector3<f64>>, weights: &[f64]) -> Vector3<f64> {
    let sum: Vector3<f64> = points
        .zip(weights)
        .map(|(point, &weight)| point * weight)
        .sum();
    sum / weights.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_numbers_keep_it_going_for_ever() {
        let points = [
            [1.0, 2.0, 3.0],
            [4.0, -1.0, 0.5],
            [0.0, 7.0, -2.0],
            [3.0, 3.0, 1.0],
        ];
        for value in [f64::NAN, f64::INFINITY, 1e300, 1e-300] {
            for scale in [1.0, 1e-160, 1e160] {
                let mut pairs = points.map(|point| {
                    let point = Point3::from(point.map(|x| x * scale));
                    (point, point)
                });
                pairs[1].0.x = value;
                pairs[2].1.z = -value;
                if let Some(pose) = align(&pairs, &[1.0; 4], false) {
                    assert!(pose.translation.vector.iter().all(|x| x.is_finite()));
                }
            }
        }
    }
}
