//! The uncertainty of a pose and how motion moves it.

use nalgebra::{Isometry3, Matrix3, Matrix6, UnitQuaternion, Vector3, Vector6};
use state::{CorruptState, State, StateReader, StateWriter};

use super::planar::ALL_AXES;
use super::positive::positive;
use super::symmetric::from_upper_triangle;

/// Covariance of a pose T = T̂ exp(ξ), 6×6, order translation \[m²\], rotation \[rad²\] of ξ.
///
/// ξ perturbs on the right, so its axes are those of the body. The matrix is exactly symmetric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseCovariance(Matrix6<f64>);

impl PoseCovariance {
    /// A pose known without error.
    pub fn zero() -> Self {
        Self(Matrix6::zeros())
    }

    /// Independent errors with these standard deviations \[m, m, m, rad, rad, rad\].
    pub fn from_sd(sd: &Vector6<f64>) -> Self {
        Self(Matrix6::from_diagonal(&sd.component_mul(sd)))
    }

    /// Of a symmetric matrix.
    pub fn from_matrix(matrix: &Matrix6<f64>) -> Self {
        Self(*matrix)
    }

    /// From a stored matrix; its upper triangle counts.
    pub fn from_upper_triangle(entries: &[f64; 21]) -> Self {
        Self(from_upper_triangle(&ALL_AXES, entries))
    }

    /// From the upper triangle of a matrix, which rounding may have left asymmetric.
    pub fn from_upper_part(matrix: &Matrix6<f64>) -> Self {
        Self::from_upper_triangle(&upper_triangle(matrix))
    }

    /// The covariance of T·Δ, where `increment` = Δ has independent errors on its right with
    /// standard deviations `noise_sd` \[m, m, m, rad, rad, rad\].
    ///
    /// ```text
    /// P′ = Ad(Δ⁻¹) P Ad(Δ⁻¹)ᵀ + diag(noise_sd²)
    /// ```
    ///
    /// to first order in the errors. With Δ = (t, R), Ad(Δ⁻¹) is the shear `| I −t× ; 0 I |`
    /// followed by Rᵀ on both blocks, so 3×3 blocks are multiplied instead of 6×6 matrices: every
    /// sample pays for this.
    #[must_use]
    pub fn after_motion(&self, increment: &Isometry3<f64>, noise_sd: &Vector6<f64>) -> Self {
        let rotation = *increment.rotation.to_rotation_matrix().matrix();
        let inverse = rotation.transpose();
        let lever = &increment.translation.vector;
        let position: Matrix3<f64> = self.0.fixed_view::<3, 3>(0, 0).into_owned();
        let cross: Matrix3<f64> = self.0.fixed_view::<3, 3>(0, 3).into_owned();
        let turn: Matrix3<f64> = self.0.fixed_view::<3, 3>(3, 3).into_owned();

        // (t× D) (t×)ᵀ = (t× (t× D)ᵀ)ᵀ, which is symmetric.
        let lever_turn = cross_columns(lever, &turn);
        let lever_cross = cross_columns(lever, &cross.transpose());
        let both = cross_columns(lever, &lever_turn.transpose());
        let sheared = position - lever_cross - lever_cross.transpose() + both;
        let sheared_cross = cross - lever_turn;
        let variance = noise_sd.component_mul(noise_sd);

        let position = inverse * sheared * rotation;
        let cross = inverse * sheared_cross * rotation;
        let turn = inverse * turn * rotation;
        let mut moved = assemble(&position, &cross, &turn);
        for k in 0..6 {
            moved[(k, k)] += variance[k];
        }
        Self(moved)
    }

    /// The matrix.
    pub fn matrix(&self) -> &Matrix6<f64> {
        &self.0
    }

    /// The same uncertainty about the axes of `map`, with the pose's `rotation` = R̂: position
    /// along, and rotation about, the map axes through the body's origin, as ROS messages state it.
    ///
    /// ```text
    /// diag(R, R) P diag(R, R)ᵀ
    /// ```
    pub fn in_map_axes(&self, rotation: &UnitQuaternion<f64>) -> Matrix6<f64> {
        let rotation = *rotation.to_rotation_matrix().matrix();
        let inverse = rotation.transpose();
        let block = |row, column| {
            let block: Matrix3<f64> = self.0.fixed_view::<3, 3>(row, column).into_owned();
            rotation * block * inverse
        };
        positive(&assemble(&block(0, 0), &block(0, 3), &block(3, 3)))
    }

    /// Standard deviation of the position \[m\]: the square root of the position block's trace.
    ///
    /// That is the root mean square distance from the estimate. It needs no eigenvalues, is the
    /// same in every frame, and is never less than the deviation along the worst axis, nor more
    /// than √3 times it.
    pub fn position_sd_m(&self) -> f64 {
        (self.0[(0, 0)] + self.0[(1, 1)] + self.0[(2, 2)]).sqrt()
    }

    /// Adds independent errors with these standard deviations \[m, m, m, rad, rad, rad\].
    pub fn inflate(&mut self, sd: &Vector6<f64>) {
        for k in 0..6 {
            self.0[(k, k)] += sd[k] * sd[k];
        }
    }
}

/// The 21 entries on and above the diagonal, row by row.
pub fn upper_triangle(matrix: &Matrix6<f64>) -> [f64; 21] {
    let mut entries = [0.0; 21];
    let cells = (0..6).flat_map(|row| (row..6).map(move |column| (row, column)));
    for (entry, cell) in entries.iter_mut().zip(cells) {
        *entry = matrix[cell];
    }
    entries
}

/// t× M: the cross product of a vector with every column.
fn cross_columns(t: &Vector3<f64>, matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let column = |k| t.cross(&matrix.column(k));
    Matrix3::from_columns(&[column(0), column(1), column(2)])
}

/// A symmetric matrix of its blocks. Of the diagonal blocks the upper triangle counts, so that
/// rounding cannot make the result asymmetric.
fn assemble(upper: &Matrix3<f64>, cross: &Matrix3<f64>, lower: &Matrix3<f64>) -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    for row in 0..3 {
        for column in 0..3 {
            let (low, high) = (row.min(column), row.max(column));
            matrix[(row, column)] = upper[(low, high)];
            matrix[(row + 3, column + 3)] = lower[(low, high)];
            matrix[(row, column + 3)] = cross[(row, column)];
            matrix[(column + 3, row)] = cross[(row, column)];
        }
    }
    matrix
}

impl State for PoseCovariance {
    fn write(&self, out: &mut StateWriter) {
        upper_triangle(self.matrix()).write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self::from_upper_triangle(&State::read(input)?))
    }
}
