//! Filter of an agent: pose, lasting errors of odometry, and the covariance of both.

use std::ops::SubAssign;

use nalgebra::{Isometry3, Matrix3, Matrix6, SMatrix, SVector, Vector3, Vector6};

use super::calibration::{Calibrated, Calibration, LASTING_DIM, VEER};
use super::frame_alignment::{FrameAlignment, pose_by_alignment};
use super::odometry_history::OdometryHistory;
use super::odometry_noise::OdometryNoise;
use super::odometry_reading::OdometryReading;
use super::outcome::Step;
use super::parameters::Parameters;
use super::standing::Standing;
use super::tuning::{POSITION_SD_MAX_M, ROUNDING, RUN_LENGTH_MAX_M, RUN_STEPS_MAX};
use crate::input::{Label, Motion, Relation};
use geometry::{MotionSum, PoseCovariance, is_somewhere, positive, se3, symmetric};

/// Components of a body's error: translation and rotation of the pose (right perturbation), then
/// odometry's lasting errors.
pub(super) const BODY_DIM: usize = 6 + LASTING_DIM;
/// Components of the pose.
const POSE: usize = 6;
/// Components of odometry's calibration.
const CALIBRATION: usize = LASTING_DIM;

type BodyCovariance = SMatrix<f64, BODY_DIM, BODY_DIM>;
type Tail = SMatrix<f64, POSE, CALIBRATION>;

/// Pose and odometry calibration of an agent, with their covariance.
#[derive(Clone, Debug)]
pub(super) struct AgentFilter {
    /// Pose in the frame of the estimate.
    pub(super) pose: Isometry3<f64>,
    pub(super) calibration: Calibration,
    /// Covariance of the body's error where the run under way began.
    pub(super) at_run_start: BodyCovariance,
    /// How the error of the pose there depends on that of the calibration at the last flush.
    pub(super) tail: Tail,
    /// Motion from the last flush until there, as corrected.
    pub(super) since_flush: Isometry3<f64>,
    /// Whether there was any motion since the last flush, up to there.
    pub(super) is_stale: bool,
    pub(super) run: Run,
    /// Where odometry was lately.
    pub(super) history: OdometryHistory,
    /// Whether all motion so far was in the body's x-y plane.
    pub(super) is_planar: bool,
    /// What its odometry turns out to be worth.
    pub(super) noise: OdometryNoise,
    /// What its odometry reads while it seems to stand.
    pub(super) standing: Standing,
}

/// Motion that is not in the covariance yet, about the axes of the pose where it began.
///
/// To carry a covariance along with every step would be most of a step's work, and hardly any step
/// is asked for it.
#[derive(Clone, Debug, Default)]
pub(super) struct Run {
    pub(super) motion: MotionSum,
    /// How its error depends on that of the calibration.
    pub(super) tail: Tail,
    /// Variances that the calibration gained. They count from the next run on: in one run, next to
    /// nothing.
    pub(super) wander: SVector<f64, CALIBRATION>,
    pub(super) steps: u32,
}

impl AgentFilter {
    /// A body at a pose whose error has this covariance.
    pub(super) fn new(
        pose: Isometry3<f64>,
        covariance: &Matrix6<f64>,
        parameters: &Parameters,
    ) -> Self {
        let mut filter = Self {
            pose,
            calibration: Calibration::default(),
            at_run_start: BodyCovariance::zeros(),
            tail: Tail::zeros(),
            since_flush: Isometry3::identity(),
            is_stale: false,
            run: Run::default(),
            history: OdometryHistory::default(),
            is_planar: true,
            noise: OdometryNoise::default(),
            standing: Standing::default(),
        };
        filter
            .at_run_start
            .fixed_view_mut::<6, 6>(0, 0)
            .copy_from(covariance);
        let mut sd = parameters.calibration_sd();
        sd[VEER] = 0.0; // until a landmark is seen with its direction: see `begin_veer`
        for (k, sd) in sd.iter().enumerate() {
            filter.at_run_start[(POSE + k, POSE + k)] = sd * sd;
        }
        filter
    }

    /// The same body at another pose, whose error is correlated with nothing.
    pub(super) fn placed(mut self, pose: Isometry3<f64>, covariance: &Matrix6<f64>) -> Self {
        self.flush();
        self.noise.forget_trial_noise();
        self.pose = pose;
        let calibration: SMatrix<f64, CALIBRATION, CALIBRATION> = self
            .at_run_start
            .fixed_view::<CALIBRATION, CALIBRATION>(POSE, POSE)
            .into_owned();
        self.at_run_start = BodyCovariance::zeros();
        self.at_run_start
            .fixed_view_mut::<6, 6>(0, 0)
            .copy_from(covariance);
        self.at_run_start
            .fixed_view_mut::<CALIBRATION, CALIBRATION>(POSE, POSE)
            .copy_from(&calibration);
        self
    }

    /// Transforms the body into the frame that its own is merged into.
    pub(super) fn transform_by(&mut self, alignment: &FrameAlignment) {
        let by_alignment = pose_by_alignment(&self.pose);
        let spread = by_alignment * alignment.covariance * by_alignment.transpose();
        let mut pose = self.covariance_mut().fixed_view_mut::<6, 6>(0, 0);
        pose += symmetric(&spread);
        self.pose = alignment.pose * self.pose;
    }

    /// Covariance of the pose.
    pub(super) fn pose_covariance(&self) -> PoseCovariance {
        let covariance = if self.run.steps == 0 {
            self.at_run_start
        } else {
            self.moved().0
        };
        PoseCovariance::from_matrix(&positive(&covariance.fixed_view::<6, 6>(0, 0).into_owned()))
    }

    /// Covariance of the body's error, which nothing waits to be added to.
    pub(super) fn covariance(&self) -> &BodyCovariance {
        debug_assert!(self.run.steps == 0, "the run must be carried over before");
        &self.at_run_start
    }

    /// The same, up to date and to be changed.
    pub(super) fn covariance_mut(&mut self) -> &mut BodyCovariance {
        self.carry_over_run();
        &mut self.at_run_start
    }

    /// Whether there was any motion since the last flush.
    pub(super) fn is_stale(&self) -> bool {
        self.is_stale || self.run.steps > 0
    }

    /// Moves the body by what odometry read, over `duration_s`.
    ///
    /// With the corrected increment Δ, lengths t, and of the rotation vector r the part f that an
    /// error of angles counts for:
    ///
    /// ```text
    /// ξ′ = Ad(Δ⁻¹) ξ + B c + n      B = | −Rᵀ t   0    0     0  |
    ///                                   |   0   −f(r) −Δt  |t|ẑ |
    /// ```
    ///
    /// Gathered about the axes of where the run began, with its motion T until after the step:
    ///
    /// ```text
    /// ξ_run = Ad(T) ξ′      tail += Ad(T) B
    /// ```
    pub(super) fn step(
        &mut self,
        motion: &Motion,
        duration_s: f64,
        parameters: &Parameters,
    ) -> Step {
        let reading = OdometryReading::new(motion, duration_s);
        self.is_planar &= reading.is_planar();
        let measured_bias = self
            .standing
            .take_in(&reading, duration_s, parameters.bias_sd_rad_s);
        let increment = reading.corrected_by(&self.calibration);
        let (variance, assumed_turn) = self.learned_variance(motion, &increment, parameters);
        self.run.append(&reading, &increment, &variance);
        let wander = self.wander(&reading, parameters);
        self.run.wander += wander;
        self.run.steps += 1;
        if self.run.is_long() {
            self.carry_over_run();
        }
        let displacement = self.pose.rotation * increment.translation.vector;
        self.pose.translation.vector += displacement;
        self.pose.rotation *= increment.rotation;
        self.pose.rotation.renormalize_fast();
        Step {
            displacement,
            increment,
            variance,
            assumed_turn,
            calibrated: Calibrated {
                calibration: self.calibration,
                states_noise: motion.noise().is_some(),
                wander,
                moving_s: reading.moving_s(),
                turned_rad: reading.scaled_angles(),
            },
            measured_bias,
        }
    }

    /// Variances of a motion's noise, after what is known of this odometry, and those that are
    /// assumed of its turn if it states none.
    #[inline]
    fn learned_variance(
        &mut self,
        motion: &Motion,
        increment: &Isometry3<f64>,
        parameters: &Parameters,
    ) -> (Vector6<f64>, Option<Vector3<f64>>) {
        let squares = |sd: Vector6<f64>| sd.component_mul(&sd);
        let assumed = squares(parameters.assumed_noise_sd(motion.increment()));
        let stated = motion
            .noise()
            .map(|_| squares(parameters.motion_noise_sd(motion)));
        self.noise.append(increment, &assumed, stated.as_ref());
        let learned = self.noise.variance(&assumed, stated.as_ref());
        let turn = || assumed.fixed_rows::<3>(3).into_owned();
        (learned, stated.is_none().then(turn))
    }

    /// What the variances of the calibration gain with a motion, up to where the settings bound
    /// them.
    #[inline]
    fn wander(
        &self,
        reading: &OdometryReading,
        parameters: &Parameters,
    ) -> SVector<f64, CALIBRATION> {
        let (length_m, angle_rad) = (reading.lengths.norm(), reading.angles.norm());
        let wander = parameters.calibration_wander(length_m, angle_rad, reading.moving_s());
        // Out of the plane a planar robot learns nothing, and so forgets nothing.
        let free = &reading.free;
        let learns = SVector::<f64, CALIBRATION>::from([1.0, 1.0, free.x, free.y, free.z, 1.0]);
        let mut wander = wander.component_mul(&learns);
        if self.at_run_start[(POSE + VEER, POSE + VEER)] == 0.0 {
            wander[VEER] = 0.0;
        }
        let most = parameters.calibration_variance_max();
        for k in 0..CALIBRATION {
            let left = most[k] - self.at_run_start[(POSE + k, POSE + k)] - self.run.wander[k];
            wander[k] = wander[k].min(left.max(0.0));
        }
        wander
    }

    /// The covariance after the run under way, and how the error of the pose then depends on that
    /// of the calibration where the run began.
    fn moved(&self) -> (BodyCovariance, Tail) {
        let run = &self.run;
        let pose: Matrix6<f64> = self.at_run_start.fixed_view::<6, 6>(0, 0).into_owned();
        let cross: Tail = self
            .at_run_start
            .fixed_view::<POSE, CALIBRATION>(0, POSE)
            .into_owned();
        let own: SMatrix<f64, CALIBRATION, CALIBRATION> = self
            .at_run_start
            .fixed_view::<CALIBRATION, CALIBRATION>(POSE, POSE)
            .into_owned();
        let back = Shift::of_inverse(run.motion.motion());
        let spread = run.tail * own;
        let mixed = cross * run.tail.transpose();
        let gathered = pose
            + run.motion.at_the_beginning()
            + mixed
            + mixed.transpose()
            + spread * run.tail.transpose();
        let mut pose = back.times(&back.times(&gathered).transpose());
        back.make_up_for_rounding(&gathered, &mut pose);
        let cross = back.times(&(cross + spread));
        let mut covariance = self.at_run_start;
        for row in 0..POSE {
            for column in row..POSE {
                let entry = pose[(row, column)];
                covariance[(row, column)] = entry;
                covariance[(column, row)] = entry;
            }
            for column in 0..CALIBRATION {
                let entry = cross[(row, column)];
                covariance[(row, POSE + column)] = entry;
                covariance[(POSE + column, row)] = entry;
            }
        }
        for (k, wander) in run.wander.iter().enumerate() {
            covariance[(POSE + k, POSE + k)] += wander;
        }
        (covariance, back.times(&run.tail))
    }

    /// Carries the run under way over to the covariance, and begins another one.
    pub(super) fn carry_over_run(&mut self) {
        if self.run.steps == 0 {
            return;
        }
        let (covariance, tail) = self.moved();
        let run = std::mem::take(&mut self.run);
        self.at_run_start = covariance;
        self.tail = Shift::of_inverse(run.motion.motion()).times(&self.tail) + tail;
        self.since_flush *= run.motion.motion();
        self.since_flush.rotation.renormalize_fast();
        self.is_stale = true;
    }

    /// The transition of the error since the last flush, which forgets it.
    pub(super) fn flush(&mut self) -> BodyCovariance {
        self.carry_over_run();
        let mut transition = BodyCovariance::identity();
        let back = se3::adjoint(&self.since_flush.inverse());
        transition.fixed_view_mut::<6, 6>(0, 0).copy_from(&back);
        transition
            .fixed_view_mut::<POSE, CALIBRATION>(0, POSE)
            .copy_from(&self.tail);
        self.tail = Tail::zeros();
        self.since_flush = Isometry3::identity();
        self.is_stale = false;
        transition
    }

    /// Corrects the body by an estimated error. Lasting errors of odometry stay within what the
    /// settings allow.
    pub(super) fn correct(&mut self, error: &SVector<f64, BODY_DIM>, parameters: &Parameters) {
        self.pose = se3::plus(&self.pose, &error.fixed_rows::<POSE>(0).into_owned());
        let most = parameters.calibration_max();
        let corrected = self.calibration.components() + error.fixed_rows::<CALIBRATION>(POSE);
        let bounded = corrected.zip_map(&most, |error, most| error.clamp(-most, most));
        self.calibration = Calibration::of_components(&bounded);
    }

    /// Sets the lasting errors of odometry, within what the settings allow.
    pub(super) fn set_calibration(&mut self, calibration: &Calibration, parameters: &Parameters) {
        let most = parameters.calibration_max();
        let components = calibration.components();
        let bounded = components.zip_map(&most, |error, most| error.clamp(-most, most));
        self.calibration = Calibration::of_components(&bounded);
    }

    /// A landmark was seen: how does that fit with its last sightings and odometry, if that is not
    /// doubted?
    pub(super) fn learn_noise(
        &mut self,
        label: &Label,
        stamp_ns: i64,
        relation: &Relation,
        is_doubted: bool,
    ) {
        let lasting = SVector::<f64, CALIBRATION>::from_fn(|k, _| {
            let is_out_of_plane = self.is_planar && (k == 2 || k == 3);
            if is_out_of_plane {
                0.0
            } else {
                self.at_run_start[(POSE + k, POSE + k)]
            }
        });
        self.noise
            .note(label, stamp_ns, relation, &lasting, is_doubted);
    }

    /// Whether the position is out of bounds or of unbounded variance, so that the pose says
    /// nothing.
    ///
    /// Cheap, for every motion asks: what the lasting errors of odometry add in the run under way
    /// does not count yet.
    pub(super) fn is_nowhere(&self) -> bool {
        let before_run: f64 = (0..3).map(|k| self.at_run_start[(k, k)]).sum();
        let variance = before_run + self.run.motion.position_variance();
        // A number that is none fails all comparisons.
        !(is_somewhere(&self.pose.translation.vector) && variance <= POSITION_SD_MAX_M.powi(2))
    }
}

impl Run {
    /// Gathers a motion, and how its error depends on that of the calibration.
    #[inline]
    fn append(
        &mut self,
        reading: &OdometryReading,
        increment: &Isometry3<f64>,
        variance: &Vector6<f64>,
    ) {
        let ahead = self.motion.motion().rotation * reading.lengths;
        let axes = self.motion.append(increment, variance);
        let lever = self.motion.motion().translation.vector;
        let mut turn = |column: usize, axis: &Vector3<f64>| {
            let mut tail = self.tail.column_mut(column);
            tail.fixed_rows_mut::<3>(0).sub_assign(&lever.cross(axis));
            tail.fixed_rows_mut::<3>(3).sub_assign(axis);
        };
        turn(1, &(axes * reading.scaled_angles()));
        let length_m = reading.lengths.norm();
        if length_m > 0.0 {
            turn(VEER, &(axes.column(2) * -length_m));
        }
        for axis in 0..3 {
            let time_s = reading.time_s[axis];
            if time_s > 0.0 {
                turn(2 + axis, &(axes.column(axis) * time_s));
            }
        }
        let mut lengths_tail = self.tail.fixed_view_mut::<3, 1>(0, 0);
        lengths_tail -= ahead;
    }

    /// Whether it is so long that it is to be carried over.
    #[inline]
    fn is_long(&self) -> bool {
        let lever = &self.motion.motion().translation.vector;
        self.steps >= RUN_STEPS_MAX || lever.norm_squared() > RUN_LENGTH_MAX_M * RUN_LENGTH_MAX_M
    }
}

/// Adds to the variances of a pose what rounding may have taken away, as parts of the sums of
/// variances that they were made of. What is known without error stays so.
pub(super) fn make_up_for_rounding(covariance: &mut Matrix6<f64>, position: f64, turn: f64) {
    for k in 0..6 {
        if covariance.row(k).iter().any(|&entry| entry != 0.0) {
            covariance[(k, k)] += ROUNDING * if k < 3 { position } else { turn };
        }
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

    /// Adds to the variances of what was moved what rounding may have taken away.
    fn make_up_for_rounding(&self, from: &Matrix6<f64>, to: &mut Matrix6<f64>) {
        let turn: f64 = (3..6).map(|k| from[(k, k)]).sum();
        let lever = self.lever.norm_squared() * turn;
        let position = lever + (0..3).map(|k| from[(k, k)]).sum::<f64>();
        make_up_for_rounding(to, position, turn);
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
