//! Planar motion as a part of spatial motion.
//!
//! A twist has the components (x, y, z, roll, pitch, yaw); planar motion has x, y and yaw alone.
//! These three span a subgroup, so what is computed for them in SE(3) is what SE(2) gives.

use std::ops::Range;

use nalgebra::{Matrix3, Matrix6, Vector6};

/// Components of spatial motion: along x, y and z, and about them.
pub const ALL_AXES: [usize; 6] = [0, 1, 2, 3, 4, 5];

/// Components of planar motion: along x and y, and about z.
pub const PLANAR_AXES: [usize; 3] = [0, 1, 5];

/// Components that planar motion lacks: along z, and about x and y.
pub const OUT_OF_PLANE: Range<usize> = 2..5;

/// The entries of planar motion.
pub fn planar_part(matrix: &Matrix6<f64>) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| matrix[(PLANAR_AXES[row], PLANAR_AXES[column])])
}

/// A matrix with these entries of planar motion, and zeros elsewhere.
pub fn from_planar_part(planar: &Matrix3<f64>) -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    for (row, &to_row) in PLANAR_AXES.iter().enumerate() {
        for (column, &to_column) in PLANAR_AXES.iter().enumerate() {
            matrix[(to_row, to_column)] = planar[(row, column)];
        }
    }
    matrix
}

/// Sets the entries out of the plane to zero: a covariance without error there.
pub fn clear_out_of_plane(matrix: &mut Matrix6<f64>) {
    for k in OUT_OF_PLANE {
        matrix.row_mut(k).fill(0.0);
        matrix.column_mut(k).fill(0.0);
    }
}

/// Keeps a Gauss-Newton step in the plane: no gradient out of it, and `stiffness` of each such
/// component on the diagonal of the Hessian, so that it can be inverted.
pub fn hold_in_plane(
    gradient: &mut Vector6<f64>,
    hessian: &mut Matrix6<f64>,
    stiffness: impl Fn(usize) -> f64,
) {
    clear_out_of_plane(hessian);
    for k in OUT_OF_PLANE {
        gradient[k] = 0.0;
        hessian[(k, k)] = stiffness(k);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_stays_in_the_plane() {
        let mut gradient = Vector6::new(1.0, 2.0, 3.0, 4.0, 5.0, 6.0);
        let mut hessian = Matrix6::from_fn(|row, column| if row == column { 9.0 } else { 1.0 });
        hold_in_plane(&mut gradient, &mut hessian, |k| 10.0 + k as f64);
        let step = hessian.try_inverse().unwrap() * gradient;
        assert!(
            OUT_OF_PLANE
                .clone()
                .all(|k| step[k].abs() < f64::MIN_POSITIVE)
        );
        assert!(PLANAR_AXES.iter().all(|&k| step[k].abs() > 1e-3));
        let planar = planar_part(&hessian);
        let mut cleared = hessian;
        clear_out_of_plane(&mut cleared);
        assert_eq!(cleared, from_planar_part(&planar));
    }
}
