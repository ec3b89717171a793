//! Robots whose levels tell their heading.

use std::f64::consts::{PI, TAU};

use cognitive_map::{CognitiveMap, Motion, PoseNoise, SampleBody, Settings};
use nalgebra::{UnitQuaternion, Vector3};
use random::Seeded;

use crate::journal::{Robot, level, start_pose};

/// Step of a robot \[m\].
const STEP_M: f64 = 0.25;

/// A robot that goes about a hall.
struct Walker {
    robot: Robot,
    heading_rad: f64,
    random: Seeded,
    /// Error of its compass that lasts \[rad\].
    lasting_rad: f64,
}

impl Walker {
    /// One that is told where it stands.
    fn new(map: &mut CognitiveMap, heading_rad: f64, seed: u64) -> Self {
        let mut walker = Self::untold(map, heading_rad, seed);
        let start = start_pose([0.0; 3], [0.0, 0.0, heading_rad]);
        walker.robot.sample(map, start);
        walker
    }

    fn untold(map: &mut CognitiveMap, heading_rad: f64, seed: u64) -> Self {
        let mut random = Seeded(seed);
        Self {
            robot: Robot::enrol(map),
            heading_rad,
            lasting_rad: 0.1 * random.normal(),
            random,
        }
    }

    /// Goes so many steps, with odometry whose turns err by a deviation with each; a level is that
    /// of the heading.
    fn roam(&mut self, map: &mut CognitiveMap, steps: u32, sd_rad: f64, level_of: Level) {
        for step in 0..steps {
            let turn_rad = 0.05 * (0.02 * f64::from(step)).sin();
            self.heading_rad += turn_rad;
            let read_rad = turn_rad + sd_rad * self.random.normal();
            let noise = PoseNoise::new([0.01, 0.01, 0.0], [0.0, 0.0, sd_rad]).unwrap();
            let read = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), read_rad);
            let motion =
                Motion::from_increment([STEP_M, 0.0, 0.0], read.coords.into(), Some(noise));
            self.robot.sample(map, SampleBody::Motion(motion.unwrap()));
            let noise_rad = self.lasting_rad + 0.1 * self.random.normal();
            let mut random = Seeded(self.random.0);
            if let Some(told) = level_of(self.heading_rad, noise_rad, &mut random) {
                self.robot.sample(map, level("compass", told, [0.0; 3]));
            }
        }
    }

    fn off_rad(&self, map: &CognitiveMap) -> f64 {
        let (_, _, yaw) = self.robot.pose(map).rotation.euler_angles();
        (yaw - self.heading_rad + PI).rem_euclid(TAU) - PI
    }
}

/// A level of a heading, with an error of that, if there is one.
type Level = fn(f64, f64, &mut Seeded) -> Option<f64>;

/// A map in which forty robots with good odometry have gone about with a sensor.
fn taught(level_of: Level) -> CognitiveMap {
    let mut map = CognitiveMap::new(Settings::default());
    for number in 0_u32..40 {
        let heading_rad = 2.4 * f64::from(number);
        let mut walker = Walker::new(&mut map, heading_rad, 100 + u64::from(number));
        walker.roam(&mut map, 60, 1e-3, level_of);
    }
    map
}

/// How far off the headings of robots with poor odometry are in the end \[rad\].
fn off_rad(map: &CognitiveMap, level_of: Level) -> Vec<f64> {
    let off = (1..=12_u64).map(|seed| {
        let mut map = map.clone();
        let mut walker = Walker::new(&mut map, 1.0, seed);
        walker.roam(&mut map, 400, 0.05, level_of);
        walker.off_rad(&map)
    });
    off.collect()
}

fn rms(values: &[f64]) -> f64 {
    let squared: f64 = values.iter().map(|value| value * value).sum();
    (squared / values.len() as f64).sqrt()
}

/// A compass in a phone: degrees, clockwise from north, which lies somewhere in the map.
#[expect(clippy::unnecessary_wraps, reason = "a level that is always there")]
fn degrees(heading_rad: f64, error_rad: f64, _: &mut Seeded) -> Option<f64> {
    Some((73.0 - (heading_rad + error_rad).to_degrees()).rem_euclid(360.0))
}

#[test]
fn a_robot_is_held_by_its_compass() {
    let radians: Level = |heading_rad, error_rad, _| Some(heading_rad + error_rad);
    for (name, level_of) in [("radians", radians), ("degrees", degrees as Level)] {
        let off_rad = rms(&off_rad(&taught(level_of), level_of));
        assert!(off_rad < 0.4, "{name}: {off_rad}");
    }
    let alone = rms(&off_rad(&taught(degrees), |_, _, _| None));
    assert!(alone > 0.8, "{alone}");
}

#[test]
fn what_a_compass_tells_is_known() {
    let compass = |map: &CognitiveMap| map.channels().find_map(|(_, one)| one.compass());
    let learned = compass(&taught(degrees)).expect("a compass");
    assert_eq!(learned.agent, None);
    let model = &learned.model;
    assert!(
        (model.rad_per_unit() + PI / 180.0).abs() < 1e-12,
        "{learned:?}"
    );
    let off_rad = model.heading_rad(73.0 - 1.0_f64.to_degrees()) - 1.0;
    assert!(
        ((off_rad + PI).rem_euclid(TAU) - PI).abs() < 0.1,
        "{learned:?}"
    );
    for variance_rad2 in [model.lasting_rad2(), model.noise_rad2()] {
        let sd_rad = variance_rad2.sqrt();
        assert!((0.07..0.15).contains(&sd_rad), "{learned:?}");
    }
    let field: Level = |_, _, random| Some(40.0 + 5.0 * random.normal());
    assert_eq!(compass(&taught(field)), None);

    // What one robot has taught is true of that one.
    let mut map = CognitiveMap::new(Settings::default());
    let mut walker = Walker::untold(&mut map, 0.0, 1);
    for session in 1..=40_u32 {
        (walker.robot.session, walker.robot.seq) = (session.into(), 0);
        walker.heading_rad = 2.4 * f64::from(session);
        let start = start_pose([0.0; 3], [0.0, 0.0, walker.heading_rad]);
        walker.robot.sample(&mut map, start);
        walker.roam(&mut map, 60, 1e-3, degrees);
    }
    let alone = compass(&map).expect("a compass");
    assert_eq!(alone.agent, Some(walker.robot.id.0));
}

#[test]
fn levels_that_tell_no_heading_change_none() {
    let without = off_rad(&taught(|_, _, _| None), |_, _, _| None);
    let constant: Level = |_, _, _| Some(1e20);
    let field: Level = |_, _, random| Some(40.0 + 5.0 * random.normal());
    let error_alone: Level = |_, error_rad, _| Some(error_rad);
    for level_of in [constant, field, error_alone] {
        let with = off_rad(&taught(level_of), level_of);
        let changed: Vec<f64> = with.iter().zip(&without).map(|(a, b)| a - b).collect();
        assert!(rms(&changed) < 0.02, "{changed:?}");
    }
}

#[test]
fn robots_without_a_start_pose_teach_no_compass() {
    let roamed = |level_of: Level| {
        let mut map = CognitiveMap::new(Settings::default());
        for number in 0_u32..40 {
            let mut walker = Walker::untold(&mut map, f64::from(number), number.into());
            walker.roam(&mut map, 60, 1e-3, level_of);
        }
        off_rad(&map, level_of)
    };
    let (with, without) = (roamed(degrees), roamed(|_, _, _| None));
    let changed: Vec<f64> = with.iter().zip(&without).map(|(a, b)| a - b).collect();
    assert!(rms(&changed) < 0.02, "{changed:?}");
}

#[test]
fn a_restart_while_a_compass_is_learned_and_used_makes_no_difference() {
    let fold = |restarts: bool| {
        let mut map = taught(degrees);
        let mut walker = Walker::new(&mut map, 1.0, 9);
        for _ in 0..40 {
            walker.roam(&mut map, 10, 0.05, degrees);
            if restarts {
                map = CognitiveMap::restore(Settings::default(), map.checkpoint(0)).unwrap();
            }
        }
        map.digest()
    };
    assert!(fold(true) == fold(false));
}
