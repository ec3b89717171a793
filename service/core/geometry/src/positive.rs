//! Covariances without the negative eigenvalues that rounding leaves.

use nalgebra::SMatrix;

/// Least variance along or about an axis, as a part of those of its three axes: what lies below is
/// rounding.
const AXIS_MIN: f64 = 1e-15;
/// Least pivot of a matrix of correlations.
const PIVOT_MIN: f64 = 1e-14;
/// By how much variances grow at first where rounding has left a covariance without a root, as a
/// part of each.
const GROWTH_MIN: f64 = 1e-12;

/// A covariance of one or two vectors of three components, symmetric, as a positive semidefinite
/// one: unchanged where it has a Cholesky factor. Elsewhere variances that rounding has lost become
/// what it may have left, covariances are held to what the variances allow, and all variances are
/// enlarged, each by the same part of itself, by at most ten times as much as is needed.
///
/// What is known without error, a row of zeros, stays so. Of a matrix with an entry that is not
/// finite nothing is changed.
pub fn positive<const N: usize>(matrix: &SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return *matrix;
    }
    let mut positive = *matrix;
    for block in (0..N).step_by(3) {
        let axes = block..(block + 3).min(N);
        let part = axes.clone().map(|k| AXIS_MIN * matrix[(k, k)].max(0.0));
        let least: f64 = part.sum();
        for k in axes {
            if matrix.row(k).iter().any(|&entry| entry != 0.0) {
                positive[(k, k)] = matrix[(k, k)].max(least);
            }
            if positive[(k, k)] <= 0.0 {
                positive.row_mut(k).fill(0.0);
                positive.column_mut(k).fill(0.0);
            }
        }
    }
    let sd = positive.diagonal().map(f64::sqrt);
    for row in 0..N {
        for column in (0..N).filter(|&column| column != row) {
            let most = sd[row] * sd[column];
            positive[(row, column)] = positive[(row, column)].clamp(-most, most);
        }
    }
    let mut growth = 0.0;
    while !has_root(&positive, growth) {
        growth = if growth == 0.0 {
            GROWTH_MIN
        } else {
            10.0 * growth
        };
    }
    for k in 0..N {
        positive[(k, k)] *= 1.0 + growth;
    }
    positive
}

/// Whether the matrix of correlations, with a diagonal of 1 + `growth`, has a Cholesky factor.
fn has_root<const N: usize>(covariance: &SMatrix<f64, N, N>, growth: f64) -> bool {
    let scale = covariance.diagonal().map(|variance| {
        if variance > 0.0 {
            variance.sqrt().recip()
        } else {
            0.0
        }
    });
    let mut lower = SMatrix::<f64, N, N>::zeros();
    for row in 0..N {
        for column in 0..=row {
            let own = if row == column {
                1.0 + growth
            } else {
                covariance[(row, column)] * scale[row] * scale[column]
            };
            let rest = (0..column).fold(own, |rest, k| rest - lower[(row, k)] * lower[(column, k)]);
            if row == column {
                if rest < PIVOT_MIN {
                    return false;
                }
                lower[(row, row)] = rest.sqrt();
            } else {
                lower[(row, column)] = rest / lower[(column, column)];
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DimName, Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};
    use proptest::prelude::*;

    #[test]
    fn a_covariance_stays_as_it_is() {
        let matrix = Matrix3::new(2.0, 0.3, 0.0, 0.3, 1e-9, 0.0, 0.0, 0.0, 0.0);
        let own = Matrix3::new(2.0, 1e-6, 0.0, 1e-6, 1e-9, 0.0, 0.0, 0.0, 0.0);
        assert_eq!(positive(&own), own);
        assert_ne!(positive(&matrix), matrix);
    }

    #[test]
    fn what_rounding_has_left_gets_a_root() {
        let axis = Vector3::new(1.0, 0.1, 1e-7);
        let mut matrix = axis * axis.transpose();
        matrix[(2, 2)] = -1e-18;
        let mended = positive(&matrix);
        assert!(mended.symmetric_eigenvalues().min() > -1e-17);
        // The third variance is lost, and with it what its covariances of 1e-7 were.
        assert!((mended - matrix).amax() < 1e-7 * matrix.amax());
        assert!((mended - matrix).fixed_view::<2, 2>(0, 0).amax() < 1e-9);
        let absurd = Matrix6::from_fn(|row, column| if row == column { 1.0 } else { -3.0 });
        assert!(positive(&absurd).symmetric_eigenvalues().min() >= 0.0);
    }

    /// Numbers of either sign and of any size that the estimate meets, and zero.
    fn number() -> impl Strategy<Value = f64> {
        prop_oneof![
            1 => Just(0.0),
            6 => (-12.0..12.0_f64, -1.0..1.0_f64).prop_map(|(order, unit)| {
                unit.signum() * 10_f64.powf(order)
            }),
            3 => -1.0..1.0_f64,
        ]
    }

    fn symmetric<const N: usize>(entries: &[f64]) -> SMatrix<f64, N, N> {
        SMatrix::from_fn(|row, column| entries[row.max(column) * N + row.min(column)])
    }

    /// What holds of whatever is repaired.
    fn is_sound<const N: usize>(matrix: &SMatrix<f64, N, N>) -> Result<(), TestCaseError>
    where
        nalgebra::Const<N>: DimName,
    {
        let mended = positive(matrix);
        prop_assert!(mended.iter().all(|entry| entry.is_finite()), "{mended}");
        prop_assert_eq!(mended, mended.transpose());
        prop_assert!(mended.diagonal().iter().all(|&variance| variance >= 0.0));
        prop_assert!(has_root(&mended, 1e-13), "{mended}");
        for k in 0..N {
            let is_zero = matrix.row(k).iter().all(|&entry| entry == 0.0);
            prop_assert!(!is_zero || mended.row(k).iter().all(|&entry| entry == 0.0));
            // Variances grow by what is needed at most, and covariances do not grow.
            prop_assert!(mended[(k, k)] >= matrix[(k, k)]);
            for other in (0..N).filter(|&other| other != k) {
                prop_assert!(mended[(k, other)].abs() <= matrix[(k, other)].abs());
            }
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn any_symmetric_matrix_becomes_a_covariance(
            entries in prop::collection::vec(number(), 36),
            zeros in prop::array::uniform6(prop::bool::weighted(0.1)),
        ) {
            let mut six = symmetric::<6>(&entries);
            for k in (0..6).filter(|&k| zeros[k]) {
                six.row_mut(k).fill(0.0);
                six.column_mut(k).fill(0.0);
            }
            is_sound(&six)?;
            is_sound(&six.fixed_view::<3, 3>(0, 0).into_owned())?;
            is_sound(&-six)?;
            is_sound(&(six * 1e12))?;
        }

        /// A covariance turned in space is one, however large: the repair changes it by rounding.
        #[test]
        fn a_turned_covariance_is_changed_by_rounding(
            factors in prop::collection::vec(-1.0..1.0_f64, 36),
            orders in prop::array::uniform2(-6.0..6.0_f64),
            axis in prop::array::uniform3(-3.2..3.2_f64),
            rank in 1..7_usize,
        ) {
            let mut root = Matrix6::from_iterator(factors);
            root.columns_mut(rank.min(6), 6 - rank.min(6)).fill(0.0);
            let scale = Vector6::from_fn(|k, _| 10_f64.powf(orders[k / 3]));
            let root = Matrix6::from_diagonal(&scale) * root;
            let turn = UnitQuaternion::from_scaled_axis(axis.into()).to_rotation_matrix();
            let mut both = Matrix6::zeros();
            both.fixed_view_mut::<3, 3>(0, 0).copy_from(turn.matrix());
            both.fixed_view_mut::<3, 3>(3, 3).copy_from(turn.matrix());
            let turned = both * root * root.transpose() * both.transpose();
            let turned = (turned + turned.transpose()) * 0.5;
            is_sound(&turned)?;
            let changed = positive(&turned) - turned;
            for (row, column) in (0..6).flat_map(|row| (0..6).map(move |column| (row, column))) {
                let block = |k: usize| {
                    let first = 3 * (k / 3);
                    turned.fixed_view::<3, 3>(first, first).trace().sqrt()
                };
                let most = 1e-9 * block(row) * block(column);
                prop_assert!(changed[(row, column)].abs() <= most, "{changed} of {turned}");
            }
        }
    }

    #[test]
    fn numbers_near_the_end_of_all_numbers_stay_finite() {
        for size in [1e300, 1e-300] {
            let own = Matrix6::from_fn(|row, column| if row == column { size } else { -size });
            let mended = positive(&own);
            assert!(mended.iter().all(|entry| entry.is_finite()), "{mended}");
        }
        let large = Matrix3::from_diagonal_element(0.5 * f64::MAX);
        assert_eq!(
            positive(&large),
            large,
            "also where the sum of variances is no number"
        );
        let not = Matrix3::from_element(f64::NAN);
        assert!(
            positive(&not).iter().all(|entry| entry.is_nan()),
            "left as it is"
        );
    }
}
