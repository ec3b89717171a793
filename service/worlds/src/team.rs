//! A team of robots that walk through one world and tell what they read.

use nalgebra::Vector3;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::obstacle::ObstacleWorld;
use super::odometry::{InvalidNoise, Odometer, OdometryNoise};
use super::sensor::{InvalidSensor, Sensor};
use super::walker::Walker;
use crate::reading::{Reading, ReadingBody, ReadingTarget, robot_name};
use trajectory::StampedPose;

/// Least distance between two robots at the start \[m\].
const START_APART_M: f64 = 1.0;
/// Slowest and fastest ticking \[Hz\].
const RATE_HZ: std::ops::RangeInclusive<f64> = 0.01..=1000.0;

/// Whether robots are told where they start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum StartKnowledge {
    /// Each robot's first reading is its true start pose.
    #[default]
    Told,
    /// Nothing is told: the map has to find out how the robots' frames lie.
    Untold,
}

/// What a team is made of.
#[derive(Clone, Debug, PartialEq)]
pub struct TeamSettings {
    /// Seed of the walks and of all noise. Each robot draws from streams of its own, so one more
    /// robot changes nothing for the others, and neither does other noise for the walks.
    pub seed: u64,
    /// Number of robots.
    pub n_robots: u32,
    /// Ticks, and so steps of 0.1 m, per second: the default of 10 Hz makes 1 m/s.
    pub rate_hz: f64,
    /// Stamp of the first tick \[ns\].
    pub epoch_ns: i64,
    /// Whether robots are told where they start.
    pub start: StartKnowledge,
    /// How bad the odometry is.
    pub odometry: OdometryNoise,
    /// What sees beacons.
    pub beacon_sensor: Sensor,
    /// What sees other robots, if anything does.
    pub robot_sensor: Option<Sensor>,
}

impl Default for TeamSettings {
    fn default() -> Self {
        Self {
            seed: 0,
            n_robots: 1,
            rate_hz: 10.0,
            epoch_ns: 0,
            start: StartKnowledge::default(),
            odometry: OdometryNoise::default(),
            beacon_sensor: Sensor::default(),
            robot_sensor: None,
        }
    }
}

/// Why there is no such team.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidTeam {
    /// The rate is not a number from 0.01 to 1000 Hz.
    #[error("the rate must be from 0.01 to 1000 Hz")]
    Rate,
    /// The odometry noise makes no sense.
    #[error(transparent)]
    Noise(#[from] InvalidNoise),
    /// A sensor makes no sense.
    #[error(transparent)]
    Sensor(#[from] InvalidSensor),
    /// No free place was found for another robot.
    #[error("no room for robot {robot}")]
    NoRoom {
        /// Number of the robot that found none.
        robot: u32,
    },
}

/// What one robot did and read in one tick.
#[derive(Clone, Debug, PartialEq)]
pub struct RobotTick {
    /// Number of the robot, from 1; its name is [`robot_name`] of it.
    pub robot: u32,
    /// Its true pose at the end of the tick, in the frame of the room.
    pub truth: StampedPose,
    /// What it read, all stamped at the end of the tick: start pose or motion, then sightings.
    pub readings: Vec<Reading>,
}

/// One robot of a team.
#[derive(Clone, Debug)]
struct Robot {
    walker: Walker,
    odometer: Odometer,
    eyes: ChaCha8Rng,
}

/// Robots that walk through one world, tick by tick. Equal worlds and settings give equal streams.
#[derive(Clone, Debug)]
pub struct Team {
    world: ObstacleWorld,
    settings: TeamSettings,
    robots: Vec<Robot>,
    n_ticks: u64,
}

impl Team {
    /// The first robot starts at the centre of the room, the others at random free places.
    ///
    /// # Errors
    /// The settings make no sense, or there is no room for so many robots.
    pub fn new(world: ObstacleWorld, settings: TeamSettings) -> Result<Self, InvalidTeam> {
        if !RATE_HZ.contains(&settings.rate_hz) {
            return Err(InvalidTeam::Rate);
        }
        settings.beacon_sensor.check()?;
        settings
            .robot_sensor
            .map_or(Ok(()), |sensor| sensor.check())?;
        let mut robots: Vec<Robot> = Vec::new();
        let mut taken_m = Vec::new();
        for robot in 1..=settings.n_robots {
            let [walk, noise, eyes] = [0, 1, 2].map(|part| {
                let mut random = ChaCha8Rng::seed_from_u64(settings.seed);
                random.set_stream(u64::from(robot) * 3 + part);
                random
            });
            let walker = if robot == 1 {
                Walker::new(&world, world.centre_m(), walk)
            } else {
                Walker::at_random(&world, &taken_m, START_APART_M, walk)
            };
            let walker = walker.ok_or(InvalidTeam::NoRoom { robot })?;
            taken_m.push(walker.pose().translation.vector);
            let odometer = Odometer::new(settings.odometry, noise)?;
            robots.push(Robot {
                walker,
                odometer,
                eyes,
            });
        }
        Ok(Self {
            world,
            settings,
            robots,
            n_ticks: 0,
        })
    }

    /// The world.
    pub fn world(&self) -> &ObstacleWorld {
        &self.world
    }

    /// The settings.
    pub fn settings(&self) -> &TeamSettings {
        &self.settings
    }

    /// The next tick, robots in order of their numbers. The first one, at the epoch, is before any
    /// step: start poses, if they are told, and sightings. Every later one is a step and sightings.
    pub fn tick(&mut self) -> Vec<RobotTick> {
        let stamp_ns = self.stamp_ns(self.n_ticks);
        let motions: Vec<Option<Reading>> = if self.n_ticks == 0 {
            self.robots
                .iter()
                .map(|robot| self.start_reading(robot))
                .collect()
        } else {
            // The stamps are whole nanoseconds, so the duration is what really lies between them.
            let duration_ns = stamp_ns.saturating_sub(self.stamp_ns(self.n_ticks - 1));
            let duration_s = duration_ns as f64 * 1e-9;
            let world = &self.world;
            let step = |robot: &mut Robot| {
                let step = robot.walker.step(world);
                Some(robot.odometer.read(&step, stamp_ns, duration_s))
            };
            self.robots.iter_mut().map(step).collect()
        };
        self.n_ticks += 1;
        let positions_m: Vec<Vector3<f64>> = self
            .robots
            .iter()
            .map(|robot| robot.walker.pose().translation.vector)
            .collect();
        let mut ticks = Vec::with_capacity(self.robots.len());
        for ((number, robot), motion) in (1..).zip(&mut self.robots).zip(motions) {
            let sightings = sightings(&self.world, &self.settings, number, robot, &positions_m);
            let readings = motion
                .into_iter()
                .chain(sightings.into_iter().map(|body| Reading { stamp_ns, body }))
                .collect();
            let truth = StampedPose {
                stamp_ns,
                pose: *robot.walker.pose(),
            };
            ticks.push(RobotTick {
                robot: number,
                truth,
                readings,
            });
        }
        ticks
    }

    /// The stamp of a tick \[ns\].
    fn stamp_ns(&self, tick: u64) -> i64 {
        #[expect(
            clippy::cast_possible_truncation,
            reason = "`as` saturates after 292 years"
        )]
        let since_epoch_ns = (tick as f64 * 1e9 / self.settings.rate_hz).round() as i64;
        self.settings.epoch_ns.saturating_add(since_epoch_ns)
    }

    /// What a robot is told before its first step.
    fn start_reading(&self, robot: &Robot) -> Option<Reading> {
        let pose = robot.walker.pose();
        let body = ReadingBody::StartPose {
            translation_m: pose.translation.vector.into(),
            rotation_xyzw: pose.rotation.coords.into(),
        };
        let told = self.settings.start == StartKnowledge::Told;
        told.then_some(Reading {
            stamp_ns: self.settings.epoch_ns,
            body,
        })
    }
}

/// What one robot sees: beacons by label, then other robots by number.
fn sightings(
    world: &ObstacleWorld,
    settings: &TeamSettings,
    number: u32,
    robot: &mut Robot,
    positions_m: &[Vector3<f64>],
) -> Vec<ReadingBody> {
    let pose = *robot.walker.pose();
    let eyes = &mut robot.eyes;
    let mut seen = Vec::new();
    for beacon in world.beacons() {
        let target = || ReadingTarget::Landmark(beacon.label.clone());
        let sensor = &settings.beacon_sensor;
        seen.extend(sensor.look(world, &pose, target, &beacon.position_m, eyes));
    }
    if let Some(sensor) = &settings.robot_sensor {
        for (other, position_m) in (1..).zip(positions_m) {
            if other != number {
                let target = || ReadingTarget::Robot(robot_name(other));
                seen.extend(sensor.look(world, &pose, target, position_m, eyes));
            }
        }
    }
    seen
}
