//! Motion whose turns may be better than is assumed.

use nalgebra::{Isometry3, Matrix6, Vector3, Vector6};

use geometry::MotionSum;

/// A sum of motions, with its noise in two parts: what it has in any case, and the noise of turns
/// that nobody states, which the settings assume.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct DoubtfulMotion {
    pub(super) certain: MotionSum,
    pub(super) assumed: MotionSum,
}

impl DoubtfulMotion {
    /// The motion.
    pub(super) fn motion(&self) -> &Isometry3<f64> {
        self.certain.motion()
    }

    /// Covariances of the motion's error, on its right: of the noise that is there in any case, and
    /// of that which is assumed.
    pub(super) fn covariances(&self) -> [Matrix6<f64>; 2] {
        [&self.certain, &self.assumed].map(|sum| *sum.covariance().matrix())
    }

    /// Goes on by an increment with these variances of the error on its right, and these that are
    /// assumed of its turn because it states none.
    #[inline]
    pub(super) fn append(
        &mut self,
        increment: &Isometry3<f64>,
        variance: &Vector6<f64>,
        assumed_turn: Option<&Vector3<f64>>,
    ) {
        let (mut certain, mut assumed) = (*variance, Vector6::zeros());
        if let Some(turn) = assumed_turn {
            assumed.fixed_rows_mut::<3>(3).copy_from(turn);
            // More than is assumed is known to be there.
            let mut turns = certain.fixed_rows_mut::<3>(3);
            turns.zip_apply(turn, |variance, assumed| {
                *variance = (*variance - assumed).max(0.0);
            });
        }
        self.certain.append(increment, &certain);
        self.assumed.append(increment, &assumed);
    }

    /// Goes on by another sum of motions, whose error is independent of this one's.
    pub(super) fn extend(&mut self, next: &Self) {
        self.certain.extend(&next.certain);
        self.assumed.extend(&next.assumed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A curve with noise of all components, with the noise of its turns as a part of what is
    /// assumed, or as stated.
    fn curve(assumed: Option<f64>, turns: f64) -> DoubtfulMotion {
        let mut sum = DoubtfulMotion::default();
        go_on(&mut sum, assumed, turns);
        sum
    }

    fn go_on(sum: &mut DoubtfulMotion, assumed: Option<f64>, turns: f64) {
        for k in 0..20 {
            let turn = Vector3::new(0.01, -0.02, 0.1 * f64::from(k % 3));
            let increment = Isometry3::new(Vector3::new(0.3, 0.02, 0.01), turn);
            let of_turn = Vector3::new(1e-4, 2e-4, 4e-4);
            let mut variance = Vector6::new(1e-3, 2e-3, 1e-3, 0.0, 0.0, 0.0);
            variance
                .fixed_rows_mut::<3>(3)
                .copy_from(&(of_turn * turns));
            let assumed = assumed.map(|factor| of_turn * factor);
            sum.append(&increment, &variance, assumed.as_ref());
        }
    }

    fn assert_same(one: &Matrix6<f64>, other: &Matrix6<f64>) {
        assert!((one - other).norm() < 1e-12 * other.norm().max(1.0));
    }

    #[test]
    fn a_part_of_what_is_assumed_is_that_part_of_the_variances() {
        let [certain, assumed] = curve(Some(1.0), 1.0).covariances();
        for part in [1.0, 0.25, 0.0] {
            let [as_stated, nothing] = curve(None, part).covariances();
            assert_same(&(certain + assumed * part), &as_stated);
            assert_eq!(nothing, Matrix6::zeros());
        }
    }

    /// Where more is known to be there than is assumed, the rest of it is certain; where less is
    /// known to be there, all that is assumed is doubtful.
    #[test]
    fn what_is_known_beyond_the_assumed_noise_is_certain() {
        for (known, sure) in [(3.0, 2.0), (0.5, 0.0)] {
            let [certain, assumed] = curve(Some(1.0), known).covariances();
            assert_same(&certain, &curve(None, sure).covariances()[0]);
            assert_same(
                &(certain + assumed),
                &curve(None, sure + 1.0).covariances()[0],
            );
        }
    }

    #[test]
    fn sums_go_on_by_sums() {
        let mut by_sums = DoubtfulMotion::default();
        let mut by_steps = DoubtfulMotion::default();
        for _ in 0..2 {
            by_sums.extend(&curve(Some(1.0), 3.0));
            go_on(&mut by_steps, Some(1.0), 3.0);
        }
        for (one, other) in by_sums.covariances().iter().zip(&by_steps.covariances()) {
            assert_same(one, other);
        }
        let apart = by_sums.motion().inv_mul(by_steps.motion());
        assert!(apart.translation.vector.norm() < 1e-12 && apart.rotation.angle() < 1e-12);
    }
}
