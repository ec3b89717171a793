//! The agent of one run: its walk, and what it reads on the way.

use nalgebra::Isometry3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::protocol::{Explored, Percept, Protocol, SightingSettings, ViewSettings, Walk};
use cogmap_worlds::{
    LevelField, ObstacleWorld, Odometer, PureWalker, Scenery, Sensor, Step, Walker,
};
use cogmap_worlds::{Reading, ReadingBody, ReadingTarget};

/// Time of a step: 10 Hz, which makes 1 m/s.
const STEP_NS: i64 = 100_000_000;
/// Standard deviation of azimuth and elevation as a multiple of the range's share: one degree at
/// five percent \[rad\].
const BEARING_PER_NOISE_RAD: f64 = std::f64::consts::PI / 180.0 / 0.05;
/// Channel of views.
const CHANNEL: &str = "view";
/// Channels of levels.
const LEVELS: u64 = 4;
/// Streams of an explorer, beyond those of the agent that walks after it.
const EXPLORER: u64 = 10;
/// Numbers of a view.
const VIEW_NUMBERS: usize = 64;

/// Stamp of a step \[ns\].
pub(super) fn stamp_ns(step: u64) -> i64 {
    i64::try_from(step)
        .unwrap_or(i64::MAX)
        .saturating_mul(STEP_NS)
}

/// A body that walks in either way.
#[derive(Clone, Debug)]
enum Body {
    Pure(PureWalker),
    Persistent(Walker),
}

/// An agent in its room. Walk, odometry and eyes draw from streams of their own, so that other
/// noise or other percepts leave the walk as it is.
#[derive(Clone, Debug)]
pub(super) struct Agent {
    world: ObstacleWorld,
    scenery: Scenery,
    body: Body,
    odometer: Odometer,
    percept: Percept,
    /// What is felt, with the deviation of its noise.
    fields: Vec<LevelField>,
    level_noise: f64,
    eyes: ChaCha8Rng,
    steps: u64,
}

impl Agent {
    /// An agent in the middle of its room. `None` where the protocol is not valid.
    pub(super) fn new(protocol: &Protocol, seed: u64) -> Option<Self> {
        let Some(explored) = &protocol.explored else {
            return Self::with(protocol, seed, 0, protocol.percept, None);
        };
        let percept = if explored.correct.sights() {
            Percept::Sightings(SightingSettings::default())
        } else {
            Percept::None
        };
        let felt = explored.correct.feels().then_some(explored);
        Self::with(protocol, seed, 0, percept, felt)
    }

    /// An agent that explores the room before, and both sights obstacles and feels.
    pub(super) fn explorer(protocol: &Protocol, seed: u64) -> Option<Self> {
        let sightings = Percept::Sightings(SightingSettings::default());
        let felt = protocol.explored.as_ref();
        Self::with(protocol, seed, EXPLORER, sightings, felt)
    }

    fn with(
        protocol: &Protocol,
        seed: u64,
        streams: u64,
        percept: Percept,
        felt: Option<&Explored>,
    ) -> Option<Self> {
        let world = protocol.environment.world(seed);
        let stream = |number| {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            random.set_stream(streams + number);
            random
        };
        let centre_m = world.centre_m();
        let body = match protocol.walk {
            Walk::Pure => Body::Pure(PureWalker::new(&world, centre_m, stream(1))?),
            Walk::Persistent => Body::Persistent(Walker::new(&world, centre_m, stream(1))?),
        };
        Some(Self {
            world,
            scenery: Scenery::new(seed, VIEW_NUMBERS),
            body,
            odometer: Odometer::new(protocol.odometry, stream(2)).ok()?,
            percept,
            fields: felt.map_or_else(Vec::new, |felt| {
                let field = |channel| LevelField::new(seed, channel, felt.length_m);
                (0..LEVELS).map(field).collect()
            }),
            level_noise: felt.map_or(0.0, |felt| felt.noise),
            eyes: stream(3),
            steps: 0,
        })
    }

    /// The room.
    pub(super) fn world(&self) -> &ObstacleWorld {
        &self.world
    }

    /// The true pose in the room.
    pub(super) fn pose(&self) -> Isometry3<f64> {
        match &self.body {
            Body::Pure(walker) => walker.pose(),
            Body::Persistent(walker) => *walker.pose(),
        }
    }

    /// Stamp of the latest step \[ns\].
    pub(super) fn stamp_ns(&self) -> i64 {
        stamp_ns(self.steps)
    }

    /// Where the agent stands, told before its first step, and what it sees from there: the frame
    /// of the room is that of the map, and the start is the step of number 0.
    pub(super) fn start(&mut self) -> Vec<Reading> {
        let pose = self.pose();
        let mut readings = vec![Reading {
            stamp_ns: self.stamp_ns(),
            body: ReadingBody::StartPose {
                translation_m: pose.translation.vector.into(),
                rotation_xyzw: pose.rotation.coords.into(),
            },
        }];
        self.perceive(&mut readings);
        readings
    }

    /// Makes one step: what was read of the motion, then what was seen at its end.
    pub(super) fn step(&mut self) -> Vec<Reading> {
        let step: Step = match &mut self.body {
            Body::Pure(walker) => walker.step(&self.world),
            Body::Persistent(walker) => walker.step(&self.world),
        };
        self.steps += 1;
        let stamp_ns = self.stamp_ns();
        let mut readings = vec![self.odometer.read(&step, stamp_ns, STEP_NS as f64 * 1e-9)];
        self.perceive(&mut readings);
        readings
    }

    /// Perceives, if it is time to.
    fn perceive(&mut self, readings: &mut Vec<Reading>) {
        match self.percept {
            Percept::Descriptor(views) if self.steps.is_multiple_of(views.every) => {
                readings.push(self.view(&views));
            }
            Percept::Sightings(sightings) if self.steps.is_multiple_of(sightings.every) => {
                self.look(&sightings, readings);
            }
            _ => {}
        }
        let (at_m, stamp_ns) = (self.pose().translation.vector, self.stamp_ns());
        for (number, field) in self.fields.iter().enumerate() {
            let error: f64 = self.eyes.sample(StandardNormal);
            let body = ReadingBody::Level {
                channel: format!("field-{number}"),
                value: field.level(&at_m) + self.level_noise * error,
            };
            readings.push(Reading { stamp_ns, body });
        }
    }

    /// Sees the room.
    fn view(&mut self, settings: &ViewSettings) -> Reading {
        let from_m = self.pose().translation.vector;
        let vector = self.scenery.view(&from_m, settings.noise, &mut self.eyes);
        Reading {
            stamp_ns: self.stamp_ns(),
            body: ReadingBody::Descriptor {
                channel: CHANNEL.to_owned(),
                vector,
            },
        }
    }

    /// Sights every obstacle within range.
    fn look(&mut self, settings: &SightingSettings, readings: &mut Vec<Reading>) {
        let pose = self.pose();
        let stamp_ns = self.stamp_ns();
        for (number, cube) in (1..).zip(self.world.cubes()) {
            let range_m = (cube.centre_m - pose.translation.vector).norm();
            if range_m > settings.range_max_m {
                continue;
            }
            let sensor = Sensor {
                range_sd_m: settings.noise * range_m,
                bearing_sd_rad: settings.noise * BEARING_PER_NOISE_RAD,
                ..Sensor::default()
            };
            let target = ReadingTarget::Landmark(format!("cube-{number:02}"));
            let body = sensor.read(&pose, target, &cube.centre_m, &mut self.eyes);
            readings.push(Reading { stamp_ns, body });
        }
    }
}
