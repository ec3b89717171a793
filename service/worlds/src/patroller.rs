//! A robot that flies rounds.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, UnitVector3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::obstacle::ObstacleWorld;
use super::round::{Round, Waypoint};
use super::steering::turn_towards;
use super::walker::{BODY_RADIUS_M, STEP_M, Step, screw};

/// Largest turn of a step \[rad\]: a circle of 0.4 m radius.
const TURN_RAD_MAX: f64 = 0.25;
/// How far ahead on its round the robot steers \[m\].
const CARROT_M: f64 = 0.6;
/// How finely the point is sought for which it steers \[m\].
const CARROT_STEP_M: f64 = 0.02;
/// Standard deviation along each axis by which the robot keeps beside its round \[m\], and the
/// correlation of a step's with that of the step before: it changes over some 5 m.
const BESIDE_SD_M: f64 = 0.08;
const BESIDE_PERSISTENCE: f64 = 0.98;

/// A robot on its round.
#[derive(Clone, Debug)]
pub(super) struct Patroller {
    round: Round,
    /// The point for which it steers, as way from the round's first corner \[m\].
    carrot_m: f64,
    beside_m: Vector3<f64>,
    pose: Isometry3<f64>,
    random: ChaCha8Rng,
}

impl Patroller {
    /// A robot on a round, so far from its first corner \[m\], that looks along it.
    pub(super) fn new(round: Round, way_m: f64, random: ChaCha8Rng) -> Self {
        let mut patroller = Self {
            round,
            carrot_m: 0.0,
            beside_m: Vector3::zeros(),
            pose: Isometry3::identity(),
            random,
        };
        patroller.put(way_m);
        patroller
    }

    /// Carries the robot to a round, so far from its first corner \[m\].
    pub(super) fn carry(&mut self, round: Round, way_m: f64) {
        self.round = round;
        self.put(way_m);
    }

    fn put(&mut self, way_m: f64) {
        let Waypoint {
            position_m, ahead, ..
        } = self.round.at(way_m);
        // Level about its own x axis, but for a leg straight up or down.
        let up = if ahead.z.abs() < 0.99 {
            Vector3::z()
        } else {
            Vector3::x()
        };
        let y = UnitVector3::new_normalize(up.cross(&ahead));
        let z = ahead.cross(&y);
        let axes = nalgebra::Matrix3::from_columns(&[ahead.into_inner(), y.into_inner(), z]);
        let rotation = UnitQuaternion::from_matrix(&axes);
        self.pose = Isometry3::from_parts(Translation3::from(position_m), rotation);
        self.carrot_m = way_m;
    }

    /// The true pose in the room.
    pub(super) fn pose(&self) -> &Isometry3<f64> {
        &self.pose
    }

    /// The round.
    pub(super) fn round(&self) -> &Round {
        &self.round
    }

    /// Where it is on its round, as way from the first corner \[m\].
    pub(super) fn way_m(&self) -> f64 {
        self.carrot_m - CARROT_M
    }

    /// Makes one step and says which.
    pub(super) fn step(&mut self, world: &ObstacleWorld) -> Step {
        let position_m = self.pose.translation.vector;
        let fresh = (1.0 - BESIDE_PERSISTENCE * BESIDE_PERSISTENCE).sqrt() * BESIDE_SD_M;
        let random = &mut self.random;
        let beside = Vector3::from_fn(|_, _| fresh * random.sample::<f64, _>(StandardNormal));
        self.beside_m = self.beside_m * BESIDE_PERSISTENCE + beside;
        let mut carrot = self.round.at(self.carrot_m).position_m + self.beside_m;
        // A lap is enough: no point of the round may be so far away.
        for _ in 0..1000 {
            if (carrot - position_m).norm() >= CARROT_M {
                break;
            }
            self.carrot_m += CARROT_STEP_M;
            carrot = self.round.at(self.carrot_m).position_m + self.beside_m;
        }
        let towards = UnitVector3::new_normalize(carrot - position_m);
        let rotation_rad = turn_towards(&self.pose.rotation, &towards, TURN_RAD_MAX);
        let ahead =
            self.pose.rotation * UnitQuaternion::from_scaled_axis(rotation_rad) * Vector3::x_axis();
        let free_m = world.free_distance_m(&position_m, &ahead, BODY_RADIUS_M, 2.0 * STEP_M);
        let length_m = if free_m >= 1.5 * STEP_M { STEP_M } else { 0.0 };
        let step = Step {
            translation_m: Vector3::x() * length_m,
            rotation_rad,
        };
        self.pose *= screw(&step);
        self.pose.rotation.renormalize();
        step
    }
}
