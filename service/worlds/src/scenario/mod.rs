//! The demo's scenario: robots patrol a room of obstacles, one of them wakes up lost, another one
//! is carried off, and an arm feels a cup and a bottle.

mod arm;
mod robot;
mod script;

use nalgebra::{Isometry3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use self::arm::Arm;
use self::robot::Robot;
use self::script::{CARRY_ROOM_S, CARRY_S, Moment, RATE_HZ, SWITCH_OFF_S, WAKE_ROOM_S, WAKE_S};
use super::eye::Eye;
use super::obstacle::ObstacleWorld;
use super::odometry::{InvalidNoise, Odometer, OdometryNoise};
use super::patroller::Patroller;
use super::round::Round;
use super::scenery::Scenery;
use super::thing::Thing;
use crate::reading::{Reading, ReadingBody, robot_name};
use trajectory::StampedPose;

pub use self::script::ScenarioSettings;

/// The arm's name.
pub const ARM: &str = "arm";
/// Numbers of a view, and the length of its noise as a share of the view's own.
const VIEW_NUMBERS: usize = 64;
const VIEW_NOISE: f64 = 0.1;
/// What is free about the arm, also of rounds \[m\].
const TABLE_M: f64 = 1.0;
/// A robot is carried off from a straight stretch to another one, each at least so long \[m\].
const STRAIGHT_M: f64 = 2.5;
/// How far it is carried, at least, and how far from every robot \[m\].
const CARRIED_M_MIN: f64 = 4.0;
const APART_M: f64 = 1.0;
/// Places that are tried before a carry waits for the next tick, or a table is given up.
const CARRY_TRIALS: u32 = 50;
const TABLE_TRIALS: u32 = 10_000;

/// What happens in the room, by the world and not by anybody's estimate.
#[derive(Clone, Debug, PartialEq)]
pub enum Act {
    /// A robot is switched off and taken away.
    SwitchedOff {
        /// Its name.
        robot: String,
    },
    /// A robot is switched on somewhere. It is not told where.
    WokenUp {
        /// Its name.
        robot: String,
    },
    /// A robot is carried off while it drives. Its odometry does not notice it.
    CarriedOff {
        /// Its name.
        robot: String,
        /// From where \[m\].
        from_m: Vector3<f64>,
    },
    /// The arm begins to learn a thing.
    Learning(Thing),
    /// The arm begins to touch a thing, which stands elsewhere and is turned.
    Touching(Thing),
    /// The arm lets go.
    LetGo,
}

/// What one agent did and read in one tick.
#[derive(Clone, Debug, PartialEq)]
pub struct AgentTick {
    /// Its name.
    pub name: String,
    /// Its true pose at the end of the tick, in the frame of the room.
    pub truth: StampedPose,
    /// What it read, all stamped at the end of the tick.
    pub readings: Vec<Reading>,
}

/// One tick.
#[derive(Clone, Debug, PartialEq)]
pub struct ScenarioTick {
    /// What happened before the agents moved.
    pub acts: Vec<Act>,
    /// The agents that are switched on.
    pub agents: Vec<AgentTick>,
}

/// Why there is no such scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum InvalidScenario {
    /// The odometry noise makes no sense.
    #[error(transparent)]
    Noise(#[from] InvalidNoise),
    /// No free round was found for another robot.
    #[error("no free round for robot {robot}")]
    NoRoom {
        /// Number of the robot that found none.
        robot: u32,
    },
    /// No free place was found for the arm.
    #[error("no free place for the arm")]
    NoTable,
}

/// The scenario, tick by tick. Equal settings give equal streams.
#[derive(Clone, Debug)]
pub struct Scenario {
    world: ObstacleWorld,
    robots: Vec<Robot>,
    arm: Arm,
    /// Chance of the script: where a robot is carried to.
    random: ChaCha8Rng,
    moment: Moment,
    carried_cycle: Option<u64>,
}

impl Scenario {
    /// Ticks a second.
    pub const RATE_HZ: f64 = RATE_HZ as f64;

    /// The scenario of some settings, before its first tick.
    ///
    /// # Errors
    /// The room is too full for so many robots or the arm.
    pub fn new(settings: ScenarioSettings) -> Result<Self, InvalidScenario> {
        let ScenarioSettings { seed, n_robots, .. } = settings;
        let world = ObstacleWorld::new(seed);
        // The world has stream 0 of the seed, and the scenery the last one.
        let random = |stream: u64| {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            random.set_stream(stream);
            random
        };
        let mut places = random(1);
        let table_m = (0..TABLE_TRIALS)
            .map(|_| Vector3::from_fn(|_, _| places.random_range(1.0..world.side_m() - 1.0)))
            .find(|table_m| world.is_free(table_m, TABLE_M / 2.0))
            .ok_or(InvalidScenario::NoTable)?;
        let scenery = Scenery::new(seed, VIEW_NUMBERS);
        let mut robots: Vec<Robot> = Vec::new();
        for number in 1..=n_robots {
            let [mut walk, noise, eyes] =
                [0, 1, 2].map(|part| random(10 + u64::from(number) * 3 + part));
            let round = Round::draw(&world, &table_m, TABLE_M, &mut walk)
                .ok_or(InvalidScenario::NoRoom { robot: number })?;
            let is_woken = settings.woken() == Some(number);
            robots.push(Robot {
                name: robot_name(number),
                patroller: Patroller::new(round, 0.0, walk),
                odometer: Odometer::new(OdometryNoise::default(), noise)?,
                random: eyes,
                eye: Eye::new(
                    scenery.clone(),
                    VIEW_NOISE,
                    seed ^ (u64::from(number) << 32),
                ),
                is_on: !is_woken,
                is_new: true,
                is_told: !is_woken,
            });
        }
        Ok(Self {
            world,
            robots,
            arm: Arm::new(table_m, random(2), random(3)),
            random: random(4),
            moment: Moment {
                settings,
                n_ticks: 0,
            },
            carried_cycle: None,
        })
    }

    /// The world.
    pub fn world(&self) -> &ObstacleWorld {
        &self.world
    }

    /// Names of the robots that are told where they start.
    pub fn told_robots(&self) -> impl Iterator<Item = &str> {
        let told = self.robots.iter().filter(|robot| robot.is_told);
        told.map(|robot| robot.name.as_str())
    }

    /// Whether the next tick is still within the duration.
    pub fn has_more(&self) -> bool {
        self.elapsed_s() < self.moment.settings.duration_s
    }

    /// Time of the next tick since the first one \[s\].
    pub fn elapsed_s(&self) -> f64 {
        self.moment.n_ticks as f64 / Self::RATE_HZ
    }

    /// Stamp of the next tick \[ns\].
    pub fn stamp_ns(&self) -> i64 {
        self.moment.stamp_ns()
    }

    /// The next tick. Robots see one another where they were after the last one.
    pub fn tick(&mut self) -> ScenarioTick {
        let (n_ticks, stamp_ns) = (self.moment.n_ticks, self.stamp_ns());
        let mut acts = Vec::new();
        acts.extend(self.wake_up());
        acts.extend(self.carry_off());
        let on = self.robots.iter_mut().filter(|robot| robot.is_on);
        let mut on: Vec<_> = on.collect();
        let seen: Vec<_> = on
            .iter()
            .map(|robot| (robot.name.clone(), robot.position_m()))
            .collect();
        let mut agents: Vec<_> = on
            .iter_mut()
            .map(|robot| robot.tick(&self.world, &seen, n_ticks, stamp_ns))
            .collect();
        let (of_arm, act) = self.arm.tick(&self.moment);
        acts.extend(act);
        agents.push(of_arm);
        self.moment.n_ticks += 1;
        ScenarioTick { acts, agents }
    }

    /// Switches the robot off and on whose turn it is.
    fn wake_up(&mut self) -> Option<Act> {
        let moment = self.moment;
        let index = moment.settings.woken()? as usize - 1;
        if !moment.has_room(WAKE_S + WAKE_ROOM_S) {
            return None;
        }
        let robot = self.robots[index].name.clone();
        let is_on = self.robots[index].is_on;
        if is_on && moment.is_now(SWITCH_OFF_S) {
            self.robots[index].is_on = false;
            return Some(Act::SwitchedOff { robot });
        }
        if is_on || !moment.is_now(WAKE_S) {
            return None;
        }
        // On a round that another one has flown all of, half a lap away from it.
        let other = usize::try_from(moment.cycle()).unwrap_or_default() % index;
        let other = &self.robots[other].patroller;
        let (round, way_m) = (other.round().clone(), other.way_m());
        let way_m = way_m + round.length_m() / 2.0;
        let woken = &mut self.robots[index];
        woken.patroller.carry(round, way_m);
        (woken.is_on, woken.is_new) = (true, true);
        Some(Act::WokenUp { robot })
    }

    /// Carries the last robot off, when it flies straight on.
    fn carry_off(&mut self) -> Option<Act> {
        let moment = self.moment;
        let is_time = moment.of_cycle_s() >= CARRY_S
            && self.carried_cycle != Some(moment.cycle())
            && moment.has_room(moment.of_cycle_s() + CARRY_ROOM_S);
        if self.robots.len() < 2 || !is_time {
            return None;
        }
        let carried = self.robots.len() - 1;
        let patroller = &self.robots[carried].patroller;
        if patroller.round().at(patroller.way_m()).straight_m < STRAIGHT_M {
            return None;
        }
        let from_m = self.robots[carried].position_m();
        // To a round of a robot that is neither carried off nor woken up.
        let others = carried.saturating_sub(1).max(1);
        for _ in 0..CARRY_TRIALS {
            let other = self.random.random_range(0..others);
            let round = self.robots[other].patroller.round().clone();
            let way_m = self.random.random_range(0.0..round.length_m());
            let there = round.at(way_m);
            let is_apart = self.robots.iter().all(|robot| {
                !robot.is_on || (robot.position_m() - there.position_m).norm() >= APART_M
            });
            let is_far = (there.position_m - from_m).norm() >= CARRIED_M_MIN;
            if there.straight_m >= STRAIGHT_M && is_far && is_apart {
                let robot = &mut self.robots[carried];
                robot.patroller.carry(round, way_m);
                self.carried_cycle = Some(moment.cycle());
                let robot = robot.name.clone();
                return Some(Act::CarriedOff { robot, from_m });
            }
        }
        None
    }
}

fn start_pose(pose: &Isometry3<f64>) -> ReadingBody {
    ReadingBody::StartPose {
        translation_m: pose.translation.vector.into(),
        rotation_xyzw: pose.rotation.coords.into(),
    }
}

#[cfg(test)]
mod tests;
