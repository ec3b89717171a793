//! A hand of three fingers on an arm, that feels things on a table.

use std::f64::consts::TAU;

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, UnitVector3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::reading::{Reading, ReadingBody, ReadingNoise};
use super::thing::Thing;

/// Fingers of the hand.
const FINGERS: u32 = 3;
/// How far the fingers open \[m\].
const OPEN_M: f64 = 0.15;
/// How far beside the thing's axis the hand closes, along each horizontal axis \[m\].
const ASIDE_M: f64 = 0.02;
/// Steepest slope from above or below at which a finger closes \[rad\].
const SLOPE_RAD: f64 = 0.9;
/// The channel of the fingertips: roughness from 0 to 1.
const CHANNEL: &str = "roughness";
/// Standard deviations of a fingertip's position by the arm's encoders, of the normal that it feels
/// and of the roughness: good tactile sensors, no perfect ones.
pub(super) const NOISE: ReadingNoise = ReadingNoise {
    position_sd_m: 0.001,
    normal_sd_rad: 0.05,
    level_sd: 0.08,
};
/// Standard deviation of where the arm has its hand, by its encoders \[m\]. It does not add up.
const ENCODER_SD_M: f64 = 0.0003;
/// Standard deviation of a turn of the hand that the arm states \[rad\]: it does not turn.
const TURN_SD_RAD: f64 = 1e-5;

/// A hand over a table. It keeps its orientation, that of the room.
#[derive(Clone, Debug)]
pub(super) struct Hand {
    position_m: Vector3<f64>,
    /// Where the arm's encoders have it.
    encoded_m: Vector3<f64>,
    random: ChaCha8Rng,
}

impl Hand {
    pub(super) fn new(position_m: Vector3<f64>, random: ChaCha8Rng) -> Self {
        Self {
            position_m,
            encoded_m: position_m,
            random,
        }
    }

    /// The true pose in the room.
    pub(super) fn pose(&self) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::from(self.position_m),
            UnitQuaternion::identity(),
        )
    }

    /// Moves to a position in the room, and says so.
    pub(super) fn go(&mut self, to_m: Vector3<f64>, stamp_ns: i64, duration_s: f64) -> Reading {
        let encoded_m = to_m + self.normal(ENCODER_SD_M);
        let moved_m = encoded_m - self.encoded_m;
        (self.position_m, self.encoded_m) = (to_m, encoded_m);
        let body = ReadingBody::Velocity {
            linear_m_s: (moved_m / duration_s).into(),
            angular_rad_s: [0.0; 3],
            duration_s,
            noise: Some(([ENCODER_SD_M; 3], [TURN_SD_RAD; 3])),
        };
        Reading { stamp_ns, body }
    }

    /// Moves to a random place about a thing that stands in the room at a pose, closes its fingers,
    /// and says where it went and what each finger feels.
    pub(super) fn grasp(
        &mut self,
        thing: Thing,
        at: &Isometry3<f64>,
        stamp_ns: i64,
        duration_s: f64,
    ) -> Vec<Reading> {
        let random = &mut self.random;
        let mut aside = || random.random_range(-ASIDE_M..ASIDE_M);
        let (x, y) = (aside(), aside());
        let z = random.random_range(0.0..thing.height_m());
        let turn_rad = random.random_range(0.0..TAU);
        let slope_rad = random.random_range(-0.2..SLOPE_RAD);
        let closed = at * Point3::new(x, y, z);
        let mut readings = vec![self.go(closed.coords, stamp_ns, duration_s)];
        for finger in 0..FINGERS {
            let towards_rad = turn_rad + TAU * f64::from(finger) / f64::from(FINGERS);
            let (sin, cos) = towards_rad.sin_cos();
            let (rise, level) = slope_rad.sin_cos();
            let out = Vector3::new(cos * level, sin * level, rise);
            let from = at.inverse_transform_point(&(closed + out * OPEN_M));
            let inwards = UnitVector3::new_unchecked(at.inverse_transform_vector(&-out));
            let Some(met) = thing.meet(&from, &inwards, 2.0 * OPEN_M) else {
                continue;
            };
            let offset_m = at * met.position - closed + self.normal(NOISE.position_sd_m);
            let felt = at.rotation * met.normal.into_inner() + self.normal(NOISE.normal_sd_rad);
            let value = met.roughness + self.normal(NOISE.level_sd).x;
            let body = ReadingBody::Contact {
                channel: CHANNEL.to_owned(),
                value,
                offset_m: offset_m.into(),
                normal: felt.normalize().into(),
            };
            readings.push(Reading { stamp_ns, body });
        }
        readings
    }

    fn normal(&mut self, sd: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| sd * self.random.sample::<f64, _>(StandardNormal))
    }
}
