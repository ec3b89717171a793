//! A body that moves: its pose, what its odometry gets wrong, and the covariance of both.

use nalgebra::{Isometry3, Matrix3, Matrix6, SMatrix, SVector, UnitQuaternion, Vector3, Vector6};

use super::calibration::{Calibrated, Calibration};
use super::history::History;
use super::outcome::Step;
use super::parameters::Parameters;
use super::tie::{Tie, body_by_tie};
use crate::geometry::{PoseCovariance, se3};
use crate::sample::Motion;

/// Components of a body's error: translation and rotation of the pose (right perturbation), then
/// relative errors of odometry's lengths and angles, then its bias about the body axes \[rad/s\].
pub(super) const BODY_DIM: usize = 11;
/// Components of the pose.
const POSE: usize = 6;
/// Components of odometry's calibration.
const CALIBRATION: usize = BODY_DIM - POSE;

type BodyCovariance = SMatrix<f64, BODY_DIM, BODY_DIM>;
type Tail = SMatrix<f64, POSE, CALIBRATION>;

/// A body that moves.
#[derive(Clone, Debug)]
pub(super) struct Mover {
    /// Pose in the frame of the estimate.
    pub(super) pose: Isometry3<f64>,
    pub(super) calibration: Calibration,
    /// Covariance of the body's error, always up to date.
    pub(super) covariance: BodyCovariance,
    /// How the error of the pose since the last flush depends on that of the calibration then.
    pub(super) tail: Tail,
    /// Motion since the last flush, as corrected.
    pub(super) since_flush: Isometry3<f64>,
    /// Whether there was any.
    pub(super) is_stale: bool,
    /// Where odometry was lately.
    pub(super) history: History,
    /// Whether all motion so far was in the body's x-y plane.
    pub(super) is_planar: bool,
}

impl Mover {
    /// A body at a pose whose error has this covariance.
    pub(super) fn new(
        pose: Isometry3<f64>,
        covariance: &Matrix6<f64>,
        parameters: &Parameters,
    ) -> Self {
        let mut mover = Self {
            pose,
            calibration: Calibration::default(),
            covariance: BodyCovariance::zeros(),
            tail: Tail::zeros(),
            since_flush: Isometry3::identity(),
            is_stale: false,
            history: History::default(),
            is_planar: true,
        };
        mover
            .covariance
            .fixed_view_mut::<6, 6>(0, 0)
            .copy_from(covariance);
        let sd = parameters.calibration_sd();
        for (k, sd) in sd.iter().enumerate() {
            mover.covariance[(POSE + k, POSE + k)] = sd * sd;
        }
        mover
    }

    /// The same body at another pose, whose error is correlated with nothing.
    pub(super) fn placed(mut self, pose: Isometry3<f64>, covariance: &Matrix6<f64>) -> Self {
        self.pose = pose;
        let calibration: SMatrix<f64, 5, 5> = self.covariance.fixed_view::<5, 5>(6, 6).into_owned();
        self.covariance = BodyCovariance::zeros();
        self.covariance
            .fixed_view_mut::<6, 6>(0, 0)
            .copy_from(covariance);
        self.covariance
            .fixed_view_mut::<5, 5>(6, 6)
            .copy_from(&calibration);
        self.flush();
        self
    }

    /// The body's frame was laid into another one.
    pub(super) fn carry_over(&mut self, tie: &Tie) {
        let by_tie = body_by_tie(&self.pose);
        let spread = by_tie * tie.covariance * by_tie.transpose();
        let mut pose = self.covariance.fixed_view_mut::<6, 6>(0, 0);
        pose += (spread + spread.transpose()) * 0.5;
        self.pose = tie.pose * self.pose;
    }

    /// Covariance of the pose.
    pub(super) fn pose_covariance(&self) -> PoseCovariance {
        PoseCovariance::from_matrix(&self.covariance.fixed_view::<6, 6>(0, 0).into_owned())
    }

    /// Moves the body by what odometry read, over `duration_s`.
    ///
    /// With the corrected increment Δ, lengths t and rotation vector r:
    ///
    /// ```text
    /// ξ′ = Ad(Δ⁻¹) ξ + B c + n      B = | −Rᵀ t   0    0  |
    ///                                   |   0    −r   −Δt |
    /// ```
    pub(super) fn step(
        &mut self,
        motion: &Motion,
        duration_s: f64,
        parameters: &Parameters,
    ) -> Step {
        let read = motion.increment();
        let lengths = read.translation.vector;
        let angles = rotation_vector(&read.rotation);
        let is_rest = lengths == Vector3::zeros() && angles == Vector3::zeros();
        // A robot in the plane has no bias out of it.
        let is_planar = lengths.z == 0.0 && angles.x == 0.0 && angles.y == 0.0;
        self.is_planar &= is_planar;
        let free = if is_rest {
            Vector3::zeros()
        } else if is_planar {
            Vector3::z()
        } else {
            Vector3::repeat(1.0)
        };
        let time = free * duration_s;
        let correction =
            -(angles * self.calibration.angle + time.component_mul(&self.calibration.bias_rad_s));
        let rotation = read.rotation * UnitQuaternion::from_scaled_axis(correction);
        let corrected = lengths * (1.0 - self.calibration.length);
        let increment = Isometry3::from_parts(corrected.into(), rotation);

        let matrix = rotation.to_rotation_matrix().into_inner();
        let inverse = matrix.transpose();
        let mut by_calibration = Tail::zeros();
        by_calibration
            .fixed_view_mut::<3, 1>(0, 0)
            .copy_from(&-(inverse * lengths));
        by_calibration
            .fixed_view_mut::<3, 1>(3, 1)
            .copy_from(&-angles);
        for axis in 0..3 {
            by_calibration[(3 + axis, 2 + axis)] = -time[axis];
        }

        let noise_sd = parameters.motion_noise_sd(motion);
        let variance = noise_sd.component_mul(&noise_sd);
        let path_m = lengths.norm();
        let angle_rad = angles.norm();
        self.propagate(&increment, &by_calibration, &variance);
        let wander = parameters.calibration_wander(
            path_m,
            angle_rad,
            if is_rest { 0.0 } else { duration_s },
        );
        for (k, variance) in wander.iter().enumerate() {
            // Out of the plane a planar robot learns nothing, and so forgets nothing.
            if k < 2 || free[k - 2] > 0.0 {
                self.covariance[(POSE + k, POSE + k)] += variance;
            }
        }
        let displacement = self.pose.rotation * increment.translation.vector;
        self.pose.translation.vector += displacement;
        self.pose.rotation *= increment.rotation;
        self.pose.rotation.renormalize_fast();
        self.since_flush *= increment;
        self.since_flush.rotation.renormalize_fast();
        self.is_stale = true;
        Step {
            displacement,
            increment,
            variance,
            calibrated: Calibrated {
                calibration: self.calibration,
                variance: SVector::from_fn(|k, _| self.covariance[(POSE + k, POSE + k)]),
                wander,
                moving_s: if is_rest { 0.0 } else { duration_s },
            },
        }
    }

    /// Moves the covariance and the tail.
    fn propagate(
        &mut self,
        increment: &Isometry3<f64>,
        by_calibration: &Tail,
        variance: &Vector6<f64>,
    ) {
        let pose: Matrix6<f64> = self.covariance.fixed_view::<6, 6>(0, 0).into_owned();
        let cross: Tail = self.covariance.fixed_view::<6, 5>(0, 6).into_owned();
        let own: SMatrix<f64, 5, 5> = self.covariance.fixed_view::<5, 5>(6, 6).into_owned();
        let back = Shift::of_inverse(increment);
        let moved_cross_only = back.times(&cross);
        let spread = by_calibration * own;
        let mixed = moved_cross_only * by_calibration.transpose();
        let moved_rows = back.times(&pose);
        let mut moved = back.times(&moved_rows.transpose());
        moved += mixed + mixed.transpose() + spread * by_calibration.transpose();
        for k in 0..6 {
            moved[(k, k)] += variance[k];
        }
        let moved_cross = moved_cross_only + spread;
        for row in 0..6 {
            for column in row..6 {
                let entry = moved[(row, column)];
                self.covariance[(row, column)] = entry;
                self.covariance[(column, row)] = entry;
            }
            for column in 0..CALIBRATION {
                let entry = moved_cross[(row, column)];
                self.covariance[(row, POSE + column)] = entry;
                self.covariance[(POSE + column, row)] = entry;
            }
        }
        self.tail = back.times(&self.tail) + by_calibration;
    }

    /// The transition of the error since the last flush, which forgets it.
    pub(super) fn flush(&mut self) -> BodyCovariance {
        let mut transition = BodyCovariance::identity();
        let back = se3::adjoint(&self.since_flush.inverse());
        transition.fixed_view_mut::<6, 6>(0, 0).copy_from(&back);
        transition
            .fixed_view_mut::<6, 5>(0, 6)
            .copy_from(&self.tail);
        self.tail = Tail::zeros();
        self.since_flush = Isometry3::identity();
        self.is_stale = false;
        transition
    }

    /// Corrects the body by an estimated error.
    pub(super) fn correct(&mut self, error: &SVector<f64, BODY_DIM>) {
        let linear = error.fixed_rows::<3>(0).into_owned();
        let angular = error.fixed_rows::<3>(3).into_owned();
        self.pose *= se3::exp(&linear, &angular);
        self.pose.rotation.renormalize_fast();
        self.calibration.length += error[6];
        self.calibration.angle += error[7];
        self.calibration.bias_rad_s += error.fixed_rows::<3>(8);
    }
}

/// Ad(Δ⁻¹) in blocks: | Rᵀ  −Rᵀ t× ; 0  Rᵀ |.
struct Shift {
    inverse: Matrix3<f64>,
    lever: Matrix3<f64>,
}

impl Shift {
    fn of_inverse(increment: &Isometry3<f64>) -> Self {
        let inverse = increment
            .rotation
            .to_rotation_matrix()
            .into_inner()
            .transpose();
        let lever = -(inverse * increment.translation.vector.cross_matrix());
        Self { inverse, lever }
    }

    fn times<const C: usize>(&self, matrix: &SMatrix<f64, 6, C>) -> SMatrix<f64, 6, C> {
        let upper: SMatrix<f64, 3, C> = matrix.fixed_view::<3, C>(0, 0).into_owned();
        let lower: SMatrix<f64, 3, C> = matrix.fixed_view::<3, C>(3, 0).into_owned();
        let mut product = SMatrix::<f64, 6, C>::zeros();
        product
            .fixed_view_mut::<3, C>(0, 0)
            .copy_from(&(self.inverse * upper + self.lever * lower));
        product
            .fixed_view_mut::<3, C>(3, 0)
            .copy_from(&(self.inverse * lower));
        product
    }
}

/// Axis times angle, exactly zero for no rotation and exactly along z for one about z.
fn rotation_vector(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    se3::log(&Isometry3::from_parts(Vector3::zeros().into(), *rotation)).1
}
