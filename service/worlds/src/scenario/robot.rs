//! A robot of the scenario: it flies rounds and says what it reads.

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;

use super::script::RATE_HZ;
use super::{AgentTick, start_pose};
use crate::eye::Eye;
use crate::obstacle::ObstacleWorld;
use crate::odometry::Odometer;
use crate::patroller::Patroller;
use crate::reading::{Reading, ReadingBody, ReadingTarget};
use crate::sensor::Sensor;
use trajectory::StampedPose;

/// A view is taken at each tick whose number divides by this: 5 Hz.
const VIEW_EVERY: u64 = 2;
const VIEW_CHANNEL: &str = "view";
/// What sees tags and other robots: it looks to every side, and finds half of what it could see.
const CAMERA: Sensor = Sensor {
    range_max_m: 6.0,
    report_probability: 0.5,
    range_sd_m: 0.05,
    bearing_sd_rad: 0.02,
};

/// One robot.
#[derive(Clone, Debug)]
pub(super) struct Robot {
    pub(super) name: String,
    pub(super) patroller: Patroller,
    pub(super) odometer: Odometer,
    /// Noise of what it sees.
    pub(super) random: ChaCha8Rng,
    pub(super) eye: Eye,
    pub(super) is_on: bool,
    /// Whether its next tick is the first one: no motion leads to it.
    pub(super) is_new: bool,
    /// Whether it is told where it starts, and sees tags and robots; it has only its eye otherwise.
    pub(super) is_told: bool,
}

impl Robot {
    /// Where it truly is \[m\].
    pub(super) fn position_m(&self) -> Vector3<f64> {
        self.patroller.pose().translation.vector
    }

    /// Makes a step and looks round, with the others where they are.
    pub(super) fn tick(
        &mut self,
        world: &ObstacleWorld,
        others: &[(String, Vector3<f64>)],
        n_ticks: u64,
        stamp_ns: i64,
    ) -> AgentTick {
        let mut readings = Vec::new();
        let is_first = std::mem::take(&mut self.is_new);
        if !is_first {
            let step = self.patroller.step(world);
            let duration_s = 1.0 / RATE_HZ as f64;
            readings.push(self.odometer.read(&step, stamp_ns, duration_s));
        }
        let pose = *self.patroller.pose();
        let mut bodies = Vec::new();
        if is_first && self.is_told {
            bodies.push(start_pose(&pose));
        }
        if self.is_told {
            for beacon in world.beacons() {
                let target = || ReadingTarget::Landmark(beacon.label.clone());
                let random = &mut self.random;
                bodies.extend(CAMERA.look(world, &pose, target, &beacon.position_m, random));
            }
            for (name, position_m) in others.iter().filter(|(name, _)| *name != self.name) {
                let target = || ReadingTarget::Robot(name.clone());
                bodies.extend(CAMERA.look(world, &pose, target, position_m, &mut self.random));
            }
        }
        if n_ticks.is_multiple_of(VIEW_EVERY) {
            let vector = self.eye.look(&pose.translation.vector);
            let channel = VIEW_CHANNEL.to_owned();
            bodies.push(ReadingBody::Descriptor { channel, vector });
        }
        readings.extend(bodies.into_iter().map(|body| Reading { stamp_ns, body }));
        AgentTick {
            name: self.name.clone(),
            truth: StampedPose { stamp_ns, pose },
            readings,
        }
    }
}
