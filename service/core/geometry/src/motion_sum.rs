//! Motions one after the other, and what their errors add up to.

use nalgebra::{Isometry3, Matrix3, Matrix6, Vector3, Vector6};

use super::blocks::from_blocks;
use super::covariance::PoseCovariance;
use super::positive::positive;
use super::se3;
use super::symmetric::symmetric;
use state::state_of_struct;

/// A motion that goes on step by step, with the covariance of its error.
///
/// The errors of the steps are gathered about the axes of the beginning, where they just add up,
/// and are transformed to the end when someone asks:
///
/// ```text
/// T = Δ₁ Δ₂ … Δ_k      S = Σ Ad(Δ₁ … Δ_i) Q_i Ad(Δ₁ … Δ_i)ᵀ      P = Ad(T⁻¹) S Ad(T⁻¹)ᵀ
/// ```
///
/// A step costs three products of 3×3 matrices that way, instead of eight. To first order in the
/// errors.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionSum {
    motion: Isometry3<f64>,
    /// Covariance of the error about the axes of the beginning; its upper triangle of blocks.
    position: Matrix3<f64>,
    cross: Matrix3<f64>,
    turn: Matrix3<f64>,
}

state_of_struct!(MotionSum {
    motion,
    position,
    cross,
    turn
});

impl Default for MotionSum {
    fn default() -> Self {
        Self {
            motion: Isometry3::identity(),
            position: Matrix3::zeros(),
            cross: Matrix3::zeros(),
            turn: Matrix3::zeros(),
        }
    }
}

impl MotionSum {
    /// The motion until now.
    pub fn motion(&self) -> &Isometry3<f64> {
        &self.motion
    }

    /// Covariance of the motion's error, on its right.
    pub fn covariance(&self) -> PoseCovariance {
        let back = se3::adjoint(&self.motion.inverse());
        let moved = back * self.at_the_beginning() * back.transpose();
        PoseCovariance::from_matrix(&positive(&symmetric(&moved)))
    }

    /// Sum of the variances of where it led, about the axes of its beginning \[m²\].
    pub fn position_variance(&self) -> f64 {
        self.position.trace()
    }

    /// Covariance of the motion's error about the axes of its beginning.
    pub fn at_the_beginning(&self) -> Matrix6<f64> {
        from_blocks(
            &self.position,
            &self.cross,
            &self.cross.transpose(),
            &self.turn,
        )
    }

    /// Goes on by an increment whose error on its right has independent components of these
    /// variances \[m², m², m², rad², rad², rad²\]. Answers the rotation until then, as a matrix.
    pub fn append(&mut self, increment: &Isometry3<f64>, variance: &Vector6<f64>) -> Matrix3<f64> {
        self.motion *= increment;
        self.motion.rotation.renormalize_fast();
        let rotation = self.motion.rotation.to_rotation_matrix().into_inner();
        if *variance != Vector6::zeros() {
            self.add(&rotation, variance);
        }
        rotation
    }

    /// Goes on by another sum of motions, whose error is independent of this one's.
    pub fn extend(&mut self, next: &Self) {
        let lever = self.motion.translation.vector.cross_matrix();
        let turn = self.motion.rotation.to_rotation_matrix().into_inner();
        let about = |block: &Matrix3<f64>| turn * block * turn.transpose();
        // Ad(T) = | R  t×R ; 0  R |
        let (position, cross, turned) =
            (about(&next.position), about(&next.cross), about(&next.turn));
        let crossed = lever * cross.transpose();
        self.position +=
            symmetric(&(position + crossed + crossed.transpose() - lever * turned * lever));
        self.cross += cross + lever * turned;
        self.turn += symmetric(&turned);
        self.motion *= next.motion;
        self.motion.rotation.renormalize_fast();
    }

    /// Adds independent errors at the end of the motion, with these variances.
    pub fn inflate(&mut self, variance: &Vector6<f64>) {
        let rotation = self.motion.rotation.to_rotation_matrix().into_inner();
        self.add(&rotation, variance);
    }

    fn add(&mut self, rotation: &Matrix3<f64>, variance: &Vector6<f64>) {
        let is_planar = variance[2] == 0.0 && variance[3] == 0.0 && variance[4] == 0.0;
        if is_planar && rotation[(0, 2)] == 0.0 && rotation[(1, 2)] == 0.0 {
            self.add_planar(rotation, variance);
            return;
        }
        let lengths = spread(rotation, &variance.fixed_rows::<3>(0).into_owned());
        let angles = spread(rotation, &variance.fixed_rows::<3>(3).into_owned());
        let lever = self.motion.translation.vector.cross_matrix();
        let cross = lever * angles;
        self.position += lengths - cross * lever;
        self.cross += cross;
        self.turn += angles;
    }

    /// The same where neither the noise nor the rotation leaves the plane, as of a robot on a
    /// floor.
    fn add_planar(&mut self, rotation: &Matrix3<f64>, variance: &Vector6<f64>) {
        let (cos, sin) = (rotation[(0, 0)], rotation[(1, 0)]);
        let (along, across, about) = (variance[0], variance[1], variance[5]);
        let lever = &self.motion.translation.vector;
        let (x, y) = (lever.y, -lever.x); // how a turn at the end moves the beginning
        self.position[(0, 0)] += cos * cos * along + sin * sin * across + about * x * x;
        self.position[(1, 1)] += sin * sin * along + cos * cos * across + about * y * y;
        let mixed = cos * sin * (along - across) + about * x * y;
        self.position[(0, 1)] += mixed;
        self.position[(1, 0)] += mixed;
        self.cross[(0, 2)] += about * x;
        self.cross[(1, 2)] += about * y;
        self.turn[(2, 2)] += about;
    }
}

/// R diag(variance) Rᵀ, exactly symmetric.
fn spread(rotation: &Matrix3<f64>, variance: &Vector3<f64>) -> Matrix3<f64> {
    let scaled = Matrix3::from_fn(|row, column| rotation[(row, column)] * variance[column]);
    let mut matrix = Matrix3::zeros();
    for row in 0..3 {
        for column in row..3 {
            let entry = (0..3)
                .map(|k| scaled[(row, k)] * rotation[(column, k)])
                .sum();
            matrix[(row, column)] = entry;
            matrix[(column, row)] = entry;
        }
    }
    matrix
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps with noise of their own, about all axes.
    fn steps() -> impl Iterator<Item = (Isometry3<f64>, Vector6<f64>)> {
        (0..200).map(|k| {
            let at = f64::from(k);
            let linear = Vector3::new(0.3, 0.1 * at.sin(), -0.05 * (0.7 * at).cos());
            let angular = Vector3::new(0.2 * (0.3 * at).sin(), -0.1, 0.4 * at.cos());
            let variance = Vector6::new(1e-4, 2e-4, 3e-5, 4e-4, 1e-5, (1.0 + at) * 1e-6);
            (se3::exp(&linear, &angular), variance)
        })
    }

    /// A sum that goes on by another one is that of all their steps.
    #[test]
    fn sums_follow_one_another() {
        let mut whole = MotionSum::default();
        let mut parts = [MotionSum::default(), MotionSum::default()];
        for (index, (increment, variance)) in steps().enumerate() {
            whole.append(&increment, &variance);
            parts[usize::from(index >= 77)].append(&increment, &variance);
        }
        let [mut first, second] = parts;
        first.extend(&second);
        let apart = whole.motion().inv_mul(first.motion());
        assert!(se3::twist(&apart).norm() < 1e-12);
        let (all, both) = (whole.at_the_beginning(), first.at_the_beginning());
        assert!((all - both).norm() < 1e-12 * all.norm(), "{all} {both}");
    }

    #[test]
    fn it_is_the_covariance_carried_along_step_by_step() {
        let mut sum = MotionSum::default();
        let mut expected = PoseCovariance::zero();
        let mut motion = Isometry3::identity();
        for (increment, variance) in steps() {
            sum.append(&increment, &variance);
            expected = expected.after_motion(&increment, &variance.map(f64::sqrt));
            motion *= increment;
            let error = (sum.covariance().matrix() - expected.matrix()).norm();
            assert!(error < 1e-10 * expected.matrix().norm(), "{error}");
        }
        let apart = motion.inv_mul(sum.motion());
        assert!(apart.translation.vector.norm() < 1e-10 && apart.rotation.angle() < 1e-10);
    }

    #[test]
    fn what_is_added_at_the_end_is_added_to_the_covariance_there() {
        let mut sum = MotionSum::default();
        for (increment, variance) in steps() {
            sum.append(&increment, &variance);
        }
        let variance = Vector6::new(1.0, 2.0, 3.0, 0.1, 0.2, 0.3);
        let before = *sum.covariance().matrix();
        sum.inflate(&variance);
        let added = sum.covariance().matrix() - before;
        assert!((added - Matrix6::from_diagonal(&variance)).norm() < 1e-9);
    }

    #[test]
    fn motion_in_the_plane_stays_exactly_there() {
        let mut sum = MotionSum::default();
        let mut expected = PoseCovariance::zero();
        let increment = Isometry3::new(Vector3::new(0.3, -0.1, 0.0), Vector3::z() * 0.7);
        let variance = Vector6::new(0.1, 0.2, 0.0, 0.0, 0.0, 0.3);
        for _ in 0..100 {
            sum.append(&increment, &variance);
            expected = expected.after_motion(&increment, &variance.map(f64::sqrt));
        }
        let covariance = *sum.covariance().matrix();
        let error = (covariance - expected.matrix()).norm();
        assert!(error < 1e-12 * expected.matrix().norm(), "{error}");
        for out in crate::OUT_OF_PLANE {
            assert!(
                covariance
                    .row(out)
                    .iter()
                    .all(|entry| entry.abs() < f64::MIN_POSITIVE)
            );
        }
    }
}
