//! An explorer, and robots that wake up.

use std::num::NonZeroUsize;
use std::time::Instant;

use cognitive_map::{AgentId, CognitiveMap, Label, Record, Sample, Settings, SettingsValues};
use nalgebra::{Isometry3, Translation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::building::Building;
use super::protocol::{InvalidWaking, WakingProtocol};
use super::report::{WakingReport, WakingTrial};
use crate::eval::object::in_parallel;
use cogmap_worlds::{LevelField, ObstacleWorld, Odometer, OdometryNoise, STEP_M, Sensor, Walker};
use cogmap_worlds::{Reading, ReadingBody, ReadingTarget};

/// Time of a step: 10 Hz, which makes 1 m/s.
const STEP_NS: i64 = 100_000_000;
/// A robot wakes up so near to where the explorer was, along each axis \[m\].
const BESIDE_M: f64 = 0.3;
/// The explorer sights the centres of obstacles within this range \[m\] at every step whose number
/// divides by that, with these deviations of distance (as a share) and direction \[rad\].
const SURVEY_RANGE_M: f64 = 8.0;
const SURVEY_EVERY: u32 = 5;
const SURVEY_RANGE_SHARE: f64 = 0.05;
const SURVEY_BEARING_SD_RAD: f64 = std::f64::consts::PI / 180.0;
const CHANNEL: &str = "view";
/// Channels of levels.
const LEVELS: u64 = 4;
/// Below this share of the height a robot wakes up where several rooms look alike.
const WAKES_BELOW: f64 = 0.55;
/// Odometry of the robots: that of the obstacle-rich room's accuracy tables.
const ODOMETRY: OdometryNoise = OdometryNoise {
    translation_share: 0.05,
    scale_bias: 0.01,
    rotation_sd_rad: 0.5 * std::f64::consts::PI / 180.0,
    gyro_bias_rad: 0.02 * std::f64::consts::PI / 180.0,
};

/// Follows a protocol, on so many threads. The same protocol gives the same report on any number of
/// them.
///
/// # Errors
/// The protocol makes no sense.
pub fn run_waking(
    protocol: &WakingProtocol,
    threads: NonZeroUsize,
    done: &(impl Fn() + Sync),
) -> Result<WakingReport, InvalidWaking> {
    protocol.check()?;
    let trials = in_buildings(protocol, threads, done, &|site, number| {
        site.wake(protocol, number, &mut Vec::new())
    });
    Ok(WakingReport::of(protocol, &trials))
}

/// Explores the buildings of a protocol, and makes its trials in them.
pub(super) fn in_buildings<Trial: Send>(
    protocol: &WakingProtocol,
    threads: NonZeroUsize,
    done: &(impl Fn() + Sync),
    trial: &(impl Fn(&Site, u32) -> Trial + Sync),
) -> Vec<Trial> {
    let buildings = protocol.trials.div_ceil(protocol.trials_per_building);
    let trials = in_parallel(buildings as usize, threads, &|building| {
        let before = u32::try_from(building).map_or(protocol.trials, |building| {
            building.saturating_mul(protocol.trials_per_building)
        });
        let count = protocol
            .trials_per_building
            .min(protocol.trials.saturating_sub(before));
        let site = Site::explored(protocol, protocol.seed.wrapping_add(building as u64));
        let trials = (0..count).map(|number| {
            let trial = trial(&site, number);
            done();
            trial
        });
        trials.collect::<Vec<_>>()
    });
    trials.into_iter().flatten().collect()
}

/// How long each view of the robots of a protocol takes to be taken in \[ms\], those after which it
/// is asked where they are included: on one thread, and all of one building.
///
/// # Errors
/// The protocol makes no sense.
pub fn time_waking(protocol: &WakingProtocol) -> Result<Vec<f64>, InvalidWaking> {
    protocol.check()?;
    let site = Site::explored(protocol, protocol.seed);
    let mut took_ms = Vec::new();
    for number in 0..protocol.trials {
        site.wake(protocol, number, &mut took_ms);
    }
    took_ms.sort_by(f64::total_cmp);
    Ok(took_ms)
}

/// A building that has been explored.
pub(super) struct Site {
    seed: u64,
    world: ObstacleWorld,
    building: Building,
    /// What is felt, if it is.
    fields: Vec<LevelField>,
    pub(super) map: CognitiveMap,
    /// Where the explorer was in each room.
    way: Vec<Vec<Vector3<f64>>>,
}

/// A robot in a room.
pub(super) struct Robot<'a> {
    site: &'a Site,
    pub(super) room: usize,
    pub(super) walker: Walker,
    odometer: Odometer,
    eyes: ChaCha8Rng,
    pub(super) steps: u32,
}

impl Site {
    pub(super) fn explored(protocol: &WakingProtocol, seed: u64) -> Self {
        let world = ObstacleWorld::new(seed);
        let building = Building::new(seed, protocol.rooms, world.side_m());
        let settings = Settings::new(SettingsValues::default())
            .expect("the settings that a space has by default are valid");
        let mut site = Self {
            seed,
            world,
            building,
            fields: protocol.felt.map_or_else(Vec::new, |felt| {
                let field =
                    |channel| LevelField::new(seed, channel, felt.length_m).along(felt.axes);
                (0..LEVELS).map(field).collect()
            }),
            map: CognitiveMap::new(settings),
            way: Vec::new(),
        };
        let mut map = site.map.clone();
        let agent = enrol(&mut map, "explorer");
        let (mut seq, mut way) = (0, Vec::new());
        for room in 0..protocol.rooms as usize {
            // The same way in every room, so that none is known better than another.
            let walker = Walker::new(&site.world, site.world.centre_m(), site.random(1))
                .expect("the middle of a room is free");
            let mut robot = site.robot(room, walker, ODOMETRY, 100 + room as u64);
            let mut positions = Vec::new();
            let mut readings = vec![robot.start_pose()];
            robot.survey(&mut readings);
            for _ in 0..protocol.explorer_steps {
                readings.extend(robot.step(protocol));
                robot.survey(&mut readings);
                for reading in readings.drain(..) {
                    apply(&mut map, agent, seq, &reading);
                    seq += 1;
                }
                positions.push(robot.walker.pose().translation.vector);
            }
            way.push(positions);
        }
        (site.map, site.way) = (map, way);
        site
    }

    pub(super) fn random(&self, stream: u64) -> ChaCha8Rng {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(stream);
        random
    }

    fn robot(&self, room: usize, walker: Walker, noise: OdometryNoise, stream: u64) -> Robot<'_> {
        Robot {
            site: self,
            room,
            walker,
            odometer: Odometer::new(noise, self.random(2 * stream)).expect("the noise is valid"),
            eyes: self.random(2 * stream + 1),
            steps: 0,
        }
    }

    /// A robot that wakes up somewhere.
    pub(super) fn woken(&self, protocol: &WakingProtocol, number: u32) -> Robot<'_> {
        let stream = 1000 + 10 * u64::from(number);
        let mut random = self.random(stream);
        let room = random.random_range(0..protocol.rooms as usize);
        let is_anywhere = protocol.rooms == 1;
        let walker = self.somewhere(room, is_anywhere, &mut random);
        self.robot(room, walker, ODOMETRY, stream + 1)
    }

    /// Somebody near to where the explorer was in a room, anywhere or where several rooms look
    /// alike.
    pub(super) fn somewhere(
        &self,
        room: usize,
        is_anywhere: bool,
        random: &mut ChaCha8Rng,
    ) -> Walker {
        let found = (0..10_000).find_map(|_| {
            let positions = &self.way[room];
            let beside = Vector3::from_fn(|_, _| random.random_range(-BESIDE_M..BESIDE_M));
            let position_m = positions[random.random_range(0..positions.len())] + beside;
            let walker = Walker::new(&self.world, position_m, self.random(random.random()))?;
            let height_m = walker.pose().translation.vector.z;
            let is_low = height_m <= WAKES_BELOW * self.world.side_m();
            (is_anywhere || is_low).then_some(walker)
        });
        found.expect("most of a room is free")
    }

    /// A robot wakes up and walks. Adds how long each of its views took.
    fn wake(&self, protocol: &WakingProtocol, number: u32, took_ms: &mut Vec<f64>) -> WakingTrial {
        let mut robot = self.woken(protocol, number);
        let mut map = self.map.clone();
        let agent = enrol(&mut map, "woken");
        let mut trial = WakingTrial::default();
        let mut seq = 0;
        let mut travelled_m = 0.0;
        while travelled_m < protocol.travel_m - 1e-9 {
            for reading in robot.step(protocol) {
                let before = Instant::now();
                apply(&mut map, agent, seq, &reading);
                seq += 1;
                let is_percept = matches!(
                    reading.body,
                    ReadingBody::Descriptor { .. } | ReadingBody::Level { .. }
                );
                if is_percept {
                    took_ms.push(before.elapsed().as_secs_f64() * 1e3);
                }
            }
            travelled_m = f64::from(robot.steps) * STEP_M;
            let woken = map.agent(agent).expect("it was enrolled");
            if !woken.placed() {
                continue;
            }
            let truth = robot.in_map();
            let off = truth.inv_mul(woken.pose());
            let is_told = robot.walker.pose().translation.vector.z >= self.building.told_from_m();
            trial.note(travelled_m, &off, is_told);
        }
        trial
    }
}

impl Robot<'_> {
    pub(super) fn in_map(&self) -> Isometry3<f64> {
        Translation3::from(self.site.building.corner_m(self.room)) * self.walker.pose()
    }

    fn stamp_ns(&self) -> i64 {
        i64::from(self.steps) * STEP_NS
    }

    fn start_pose(&self) -> Reading {
        let pose = self.in_map();
        Reading {
            stamp_ns: self.stamp_ns(),
            body: ReadingBody::StartPose {
                translation_m: pose.translation.vector.into(),
                rotation_xyzw: pose.rotation.coords.into(),
            },
        }
    }

    /// Sights the obstacles about, as an explorer does.
    fn survey(&mut self, readings: &mut Vec<Reading>) {
        if !self.steps.is_multiple_of(SURVEY_EVERY) {
            return;
        }
        let site = self.site;
        let (pose, stamp_ns) = (*self.walker.pose(), self.stamp_ns());
        for (number, cube) in (1..).zip(site.world.cubes()) {
            let range_m = (cube.centre_m - pose.translation.vector).norm();
            if range_m > SURVEY_RANGE_M {
                continue;
            }
            let sensor = Sensor {
                range_sd_m: SURVEY_RANGE_SHARE * range_m,
                bearing_sd_rad: SURVEY_BEARING_SD_RAD,
                ..Sensor::default()
            };
            let label = format!("room-{}-cube-{number:02}", self.room);
            let target = ReadingTarget::Landmark(label);
            let body = sensor.read(&pose, target, &cube.centre_m, &mut self.eyes);
            readings.push(Reading { stamp_ns, body });
        }
    }

    pub(super) fn step(&mut self, protocol: &WakingProtocol) -> Vec<Reading> {
        let step = self.walker.step(&self.site.world);
        self.steps += 1;
        let stamp_ns = self.stamp_ns();
        let mut readings = vec![self.odometer.read(&step, stamp_ns, STEP_NS as f64 * 1e-9)];
        let from_m = self.walker.pose().translation.vector;
        if let Some(felt) = &protocol.felt {
            for (number, field) in self.site.fields.iter().enumerate() {
                let error: f64 = self.eyes.sample(StandardNormal);
                let body = ReadingBody::Level {
                    channel: format!("field-{number}"),
                    value: field.level(&from_m) + felt.noise * error,
                };
                readings.push(Reading { stamp_ns, body });
            }
        } else if self.steps.is_multiple_of(protocol.view_every) {
            let vector = self.site.building.view(
                self.room,
                &from_m,
                protocol.view_noise,
                protocol.view_wrong,
                &mut self.eyes,
            );
            readings.push(Reading {
                stamp_ns,
                body: ReadingBody::Descriptor {
                    channel: CHANNEL.to_owned(),
                    vector,
                },
            });
        }
        readings
    }
}

pub(super) fn enrol(map: &mut CognitiveMap, name: &str) -> AgentId {
    let number = u32::try_from(map.agent_count()).expect("there are two agents at most");
    let agent = AgentId(number);
    let name = Label::new(name).expect("it is a label");
    map.apply(&Record::Enrol { agent, name }, &mut Vec::new());
    agent
}

pub(super) fn apply(map: &mut CognitiveMap, agent: AgentId, seq: u64, reading: &Reading) {
    let sample = Sample::try_from(reading).expect("a walk's readings are valid");
    let record = Record::Sample {
        agent,
        session: 1,
        seq,
        sample,
    };
    map.apply(&record, &mut Vec::new());
}
