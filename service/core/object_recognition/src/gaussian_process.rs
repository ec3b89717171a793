//! Gaussian processes: covariance and density of many values together.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn, Point3};

/// Matérn covariance (ν = 3/2) at a distance in lengths (Rasmussen and Williams 2006, eq. 4.17): of
/// what is smooth, and bends anywhere.
pub(crate) fn matern(distance: f64) -> f64 {
    let a = 3.0_f64.sqrt() * distance;
    (1.0 + a) * (-a).exp()
}

/// How many of these points tell something of their own: those within such a reach \[m\] of one
/// another tell the same.
pub(crate) fn independent(points: &[Point3<f64>], reach_m: f64) -> f64 {
    let reach_m = reach_m.max(f64::MIN_POSITIVE);
    let alike = |own: &Point3<f64>| {
        let others = points
            .iter()
            .map(|other| matern((own - other).norm() / reach_m));
        others.sum::<f64>()
    };
    points.iter().map(|own| 1.0 / alike(own)).sum()
}

/// Factor of the covariance of so many values, of which this is that of two. None where it is
/// singular.
pub(crate) fn factor(
    count: usize,
    covariance: impl Fn(usize, usize) -> f64,
) -> Option<Cholesky<f64, Dyn>> {
    // The factorisation reads the lower triangle alone.
    let lower = |row, column| {
        if row < column {
            0.0
        } else {
            covariance(row, column)
        }
    };
    Cholesky::new(DMatrix::from_fn(count, count, lower))
}

/// Log of the root of the determinant of a factored covariance.
pub(crate) fn log_root(factor: &Cholesky<f64, Dyn>) -> f64 {
    factor.l_dirty().diagonal().map(f64::ln).sum()
}

/// Log density of values about zero, up to the constant that all of as many have in common.
pub(crate) fn log_density(factor: &Cholesky<f64, Dyn>, values: &DVector<f64>) -> f64 {
    let mut white = values.clone();
    factor.l_dirty().solve_lower_triangular_mut(&mut white);
    -0.5 * white.norm_squared() - log_root(factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn covariance_falls_from_one() {
        assert!((matern(0.0) - 1.0).abs() < 1e-12);
        let falls = (0..100).map(|k| matern(0.1 * f64::from(k)));
        assert!(
            falls
                .collect::<Vec<_>>()
                .windows(2)
                .all(|two| two[1] < two[0])
        );
    }

    #[test]
    fn points_at_one_place_tell_what_one_of_them_tells() {
        let far = |k: u32| Point3::new(f64::from(k), 0.0, 0.0);
        let all: Vec<_> = (0..5)
            .flat_map(|k| std::iter::repeat_n(far(k), 20))
            .collect();
        assert!((independent(&all, 0.01) - 5.0).abs() < 1e-9);
        assert!(independent(&[], 0.01).abs() < 1e-12);
    }

    #[test]
    fn density_is_that_of_each_after_those_before() {
        // Of two values with correlation r the second one is normal about r times the first.
        let (r, values): (f64, [f64; 2]) = (0.6, [1.5, -0.4]);
        let factor = factor(2, |row, column| if row == column { 1.0 } else { r });
        let factor = factor.expect("it is positive");
        let together = log_density(&factor, &DVector::from_row_slice(&values));
        let variance = 1.0 - r * r;
        let off = values[1] - r * values[0];
        let apart = -0.5 * (values[0].powi(2) + off * off / variance + variance.ln());
        assert!((together - apart).abs() < 1e-12, "{together} {apart}");
        assert!(super::factor(2, |_, _| 1.0).is_none(), "one value twice");
    }
}
