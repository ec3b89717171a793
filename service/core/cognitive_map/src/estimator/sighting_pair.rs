//! Two sightings of one landmark from one robot, and what it moved in between.

use nalgebra::{Isometry3, Matrix3, Matrix3x6, Matrix6, SMatrix, Vector3, Vector4};

use super::calibration::{LASTING_DIM, LastingErrors, VEER};
use super::innovation::{PointInnovation, seen_at};
use crate::input::{Label, Relation};
use geometry::{MotionSum, se3, seen_by_pose};

/// A motion with its noise: of lengths and of angles as assumed, and all that odometry states.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct NoisyMotion {
    pub(super) by_lengths: MotionSum,
    pub(super) by_angles: MotionSum,
    pub(super) as_stated: MotionSum,
}

/// A sighting that later ones of the same landmark are compared with.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Anchor {
    pub(super) label: Label,
    pub(super) stamp_ns: i64,
    /// How often the landmark was seen since.
    pub(super) seen: u32,
    /// Where it was seen, in the body's frame.
    pub(super) point: Vector3<f64>,
    /// Deviations of that point by those of what was seen, a column for each component.
    pub(super) spread: Matrix3<f64>,
    pub(super) is_polar: bool,
    /// Motion until then.
    pub(super) motion: Isometry3<f64>,
    /// Covariances of its noise: of lengths, of angles, as stated.
    pub(super) noise: [Matrix6<f64>; 3],
}

/// A residual of a pair.
#[derive(Clone, Copy, Debug)]
pub(super) struct Residual {
    pub(super) square: f64,
    /// Variances: of lengths and of angles of odometry as assumed, of distances and of directions
    /// as stated.
    pub(super) parts: Vector4<f64>,
    /// Variance that is not learned.
    pub(super) rest: f64,
    /// Whether it is an angle.
    pub(super) is_angle: bool,
}

impl NoisyMotion {
    /// The motion.
    pub(super) fn motion(&self) -> &Isometry3<f64> {
        self.by_lengths.motion()
    }

    fn noise(&self) -> [Matrix6<f64>; 3] {
        [&self.by_lengths, &self.by_angles, &self.as_stated].map(MotionSum::at_the_beginning)
    }
}

impl Anchor {
    /// Of a sighting after a motion; `None` where it has no direction.
    pub(super) fn new(
        label: &Label,
        stamp_ns: i64,
        relation: &Relation,
        motion: &NoisyMotion,
    ) -> Option<Self> {
        let (point, _) = seen_at(relation)?;
        let innovation = PointInnovation::new(relation, &point)?;
        let sd = innovation.variance.map(f64::sqrt);
        Some(Self {
            label: label.clone(),
            stamp_ns,
            seen: 0,
            point,
            spread: innovation.by_point.try_inverse()? * Matrix3::from_diagonal(&sd),
            is_polar: innovation.is_polar,
            motion: *motion.motion(),
            noise: motion.noise(),
        })
    }

    /// The residuals of a later sighting after a motion from the same beginning, with these
    /// variances of odometry's lasting errors; none where it has no direction.
    pub(super) fn residuals(
        &self,
        stamp_ns: i64,
        relation: &Relation,
        motion: &NoisyMotion,
        lasting: &LastingErrors,
    ) -> Vec<Residual> {
        let now = motion.motion();
        let moved = self.motion.inv_mul(now);
        let expected = moved.inverse_transform_point(&self.point.into()).coords;
        let Some(innovation) = PointInnovation::new(relation, &expected) else {
            return Vec::new();
        };
        let to_body = moved.rotation.to_rotation_matrix().into_inner().transpose();
        let by_motion: Matrix3x6<f64> = innovation.by_point * seen_by_pose(&expected);
        let by_beginning = by_motion * se3::adjoint(&now.inverse());
        let by_anchor = innovation.by_point * to_body * self.spread;
        let [lengths, angles, stated] = {
            let [now, then] = [motion.noise(), self.noise];
            [0, 1, 2].map(|k| by_beginning * (now[k] - then[k]))
        };
        let duration_s = (stamp_ns - self.stamp_ns) as f64 * 1e-9;
        let lasting = by_motion * lasting_errors(&moved, duration_s, lasting);
        // A planar robot's elevations are no measurements.
        let is_planar =
            self.point.z == 0.0 && seen_at(relation).is_some_and(|(seen, _)| seen.z == 0.0);
        let components = (0..3).filter(|&k| k < 2 || !is_planar);
        let residual = |k: usize| {
            let noise = |of: &Matrix3x6<f64>| of.row(k).dot(&by_beginning.row(k)).max(0.0);
            let mut parts = Vector4::new(noise(&lengths), noise(&angles), 0.0, 0.0);
            for component in 0..3 {
                parts[sensor_part(self.is_polar, component)] += by_anchor[(k, component)].powi(2);
            }
            parts[sensor_part(innovation.is_polar, k)] += innovation.variance[k];
            Residual {
                square: innovation.residual[k].powi(2),
                parts,
                rest: lasting.row(k).norm_squared() + noise(&stated),
                is_angle: innovation.is_polar && k > 0,
            }
        };
        components.map(residual).collect()
    }
}

/// Which of the parts a component of a sighting belongs to.
pub(super) fn sensor_part(is_polar: bool, component: usize) -> usize {
    if is_polar && component > 0 { 3 } else { 2 }
}

/// Deviations of a motion's error, on its right, by each of odometry's lasting errors. What turns
/// evenly along the way moves its end by half as much as if it had turned at the beginning.
fn lasting_errors(
    motion: &Isometry3<f64>,
    duration_s: f64,
    variance: &LastingErrors,
) -> SMatrix<f64, 6, LASTING_DIM> {
    let (_, angles) = se3::log(motion);
    let sd = variance.map(|variance| variance.max(0.0).sqrt());
    let lengths = motion.rotation.inverse() * motion.translation.vector;
    let mut errors = SMatrix::<f64, 6, LASTING_DIM>::zeros();
    errors
        .fixed_view_mut::<3, 1>(0, 0)
        .copy_from(&(lengths * sd[0]));
    let mut turn = |column: usize, turn: Vector3<f64>| {
        let aside = turn.cross(&lengths) * 0.5;
        errors.fixed_view_mut::<3, 1>(0, column).copy_from(&aside);
        errors.fixed_view_mut::<3, 1>(3, column).copy_from(&turn);
    };
    turn(1, angles * sd[1]);
    for axis in 0..3 {
        let mut bias = Vector3::zeros();
        bias[axis] = sd[2 + axis] * duration_s;
        turn(2 + axis, bias);
    }
    turn(VEER, Vector3::z() * (sd[VEER] * lengths.norm()));
    errors
}
