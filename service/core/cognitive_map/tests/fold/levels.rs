//! Robots that find out where they are by what they feel.

use std::f64::consts::{PI, TAU};

use cognitive_map::{CognitiveMap, Motion, PoseNoise, SampleBody, Settings, Status};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use random::Seeded;

use crate::journal::{Robot, level, start_pose};

/// Step of a robot \[m\]; edge of the room, and distance between the lanes in which it is explored.
const STEP_M: f64 = 0.1;
const EDGE_M: f64 = 8.0;
const LANE_M: f64 = 0.4;

/// What is felt in a room: smooth fields, a channel each, with a tenth of noise.
#[derive(Clone)]
struct Room {
    channels: Vec<Vec<(Vector3<f64>, f64)>>,
}

/// What one robot's sensors do to it.
type Sensors = fn(usize, f64, &mut Seeded) -> f64;

/// A robot in a room: where it is, and what it reports.
struct Walker {
    robot: Robot,
    truth: Isometry3<f64>,
    reckoned: Isometry3<f64>,
    sensors: Sensors,
    random: Seeded,
}

impl Room {
    /// Fields that change over `length_m` along each axis.
    fn new(seed: u64, length_m: Vector3<f64>) -> Self {
        let mut random = Seeded(seed);
        let mut wave = || {
            let wave = Vector3::new(random.normal(), random.normal(), random.normal());
            (wave.component_div(&length_m), random.uniform() * TAU)
        };
        let channels = (0..4).map(|_| (0..40).map(|_| wave()).collect());
        Self {
            channels: channels.collect(),
        }
    }

    fn level(&self, channel: usize, at: &Vector3<f64>) -> f64 {
        let waves = &self.channels[channel];
        let sum: f64 = waves
            .iter()
            .map(|(wave, shift)| (wave.dot(at) + shift).cos())
            .sum();
        sum * (2.0 / waves.len() as f64).sqrt()
    }
}

impl Walker {
    /// A robot that nobody tells where it stands.
    fn untold(map: &mut CognitiveMap, at: [f64; 2], heading_rad: f64, seed: u64) -> Self {
        let turn = Vector3::z() * heading_rad;
        let truth = Isometry3::new(Vector3::new(at[0], at[1], 0.0), turn);
        Self {
            robot: Robot::enrol(map),
            truth,
            reckoned: truth,
            sensors: |_, level, random| level + 0.1 * random.normal(),
            random: Seeded(seed),
        }
    }

    /// A robot that is told where it stands.
    fn told(map: &mut CognitiveMap, at: [f64; 2], heading_rad: f64, seed: u64) -> Self {
        let mut walker = Self::untold(map, at, heading_rad, seed);
        let start = start_pose([at[0], at[1], 0.0], [0.0, 0.0, heading_rad]);
        walker.robot.sample(map, start);
        walker
    }

    /// Goes a step and turns, with odometry that errs as it says.
    fn go(&mut self, map: &mut CognitiveMap, turn_rad: f64, (sd_m, sd_rad): (f64, f64)) {
        self.truth *= Isometry3::new(Vector3::x() * STEP_M, Vector3::z() * turn_rad);
        let mut off = |sd: f64| sd * self.random.normal();
        let read_m = [STEP_M + off(sd_m), off(sd_m), 0.0];
        let read_rad = turn_rad + off(sd_rad);
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), read_rad);
        self.reckoned *= Isometry3::from_parts(Vector3::from(read_m).into(), rotation);
        let noise = PoseNoise::new([sd_m, sd_m, 0.0], [0.0, 0.0, sd_rad]).unwrap();
        let motion = Motion::from_increment(read_m, rotation.coords.into(), Some(noise)).unwrap();
        self.robot.sample(map, SampleBody::Motion(motion));
    }

    /// Feels on all channels.
    fn feel(&mut self, map: &mut CognitiveMap, room: &Room) {
        for channel in 0..room.channels.len() {
            let felt = room.level(channel, &self.truth.translation.vector);
            let felt = (self.sensors)(channel, felt, &mut self.random);
            let sample = level(&format!("field-{channel}"), felt, [0.0; 3]);
            self.robot.sample(map, sample);
        }
    }

    /// Goes so many steps within the room; answers how far off it was after each.
    fn roam(&mut self, map: &mut CognitiveMap, room: &Room, steps: u32) -> Vec<f64> {
        let mut off_m = Vec::new();
        for _ in 0..steps {
            let middle = Vector3::new(EDGE_M / 2.0, EDGE_M / 2.0, 0.0);
            let from = self.truth.translation.vector;
            let to_middle = self.truth.inverse_transform_vector(&(middle - from));
            let turn_rad = if to_middle.norm() > 0.4 * EDGE_M {
                to_middle.y.atan2(to_middle.x).clamp(-0.3, 0.3)
            } else {
                0.1 * self.random.normal()
            };
            self.go(map, turn_rad, (0.01, 0.01));
            self.feel(map, room);
            off_m.push(self.off_m(map));
        }
        off_m
    }

    fn off_m(&self, map: &CognitiveMap) -> f64 {
        (self.robot.pose(map).translation.vector - self.truth.translation.vector).norm()
    }

    fn is_placed(&self, map: &CognitiveMap) -> bool {
        map.agent(self.robot.id).unwrap().placed()
    }

    fn drift_m(&self) -> f64 {
        (self.reckoned.translation.vector - self.truth.translation.vector).norm()
    }
}

/// Fields that change over a metre and a half.
fn room(seed: u64) -> Room {
    Room::new(seed, Vector3::repeat(1.5))
}

/// A map in which somebody felt a room lane by lane, put at the beginning of each.
fn explored(room: &Room) -> CognitiveMap {
    let mut map = CognitiveMap::new(Settings::default());
    let mut explorer = Walker::told(&mut map, [0.0, 0.0], 0.0, 7);
    let lanes = (0..).map(|lane| LANE_M * f64::from(lane));
    for (number, lane_m) in lanes.take_while(|lane_m| *lane_m <= EDGE_M).enumerate() {
        let is_back = number % 2 == 1;
        let (from_m, heading_rad) = if is_back { (EDGE_M, PI) } else { (0.0, 0.0) };
        explorer.truth = Isometry3::new(
            Vector3::new(from_m, lane_m, 0.0),
            Vector3::z() * heading_rad,
        );
        let start = start_pose([from_m, lane_m, 0.0], [0.0, 0.0, heading_rad]);
        explorer.robot.sample(&mut map, start);
        for _ in 0..80 {
            explorer.go(&mut map, 0.0, (0.001, 0.001));
            explorer.feel(&mut map, room);
        }
    }
    map
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
fn a_robot_that_drifts_is_held_by_what_it_feels() {
    let room = room(1);
    let map = explored(&room);
    for seed in 1..=3 {
        let mut map = map.clone();
        let mut walker = Walker::told(&mut map, [3.0, 3.0], 0.4, seed);
        let off_m = walker.roam(&mut map, &room, 1500);
        let late = median(off_m[1000..].to_vec());
        assert!(late < 0.15, "{seed}: {late} m");
        assert!(
            walker.drift_m() > 4.0 * late,
            "{seed}: {}",
            walker.drift_m()
        );
        let sd_m = map.covariance(walker.robot.id).unwrap().position_sd_m();
        assert!(sd_m < 0.3 && sd_m > 0.2 * late, "{seed}: {sd_m}");
    }
}

#[test]
fn a_robot_that_wakes_up_is_found_in_its_room_and_in_no_other() {
    let here = room(2);
    let map = explored(&here);
    for (seed, at) in [(1, [2.0, 2.5]), (2, [5.5, 3.0]), (3, [4.0, 6.0])] {
        let mut map = map.clone();
        let mut walker = Walker::untold(&mut map, at, 2.0 * seed as f64, seed);
        walker.roam(&mut map, &here, 60);
        assert!(walker.is_placed(&map), "{seed}");
        assert!(walker.off_m(&map) < 0.3, "{seed}: {}", walker.off_m(&map));
        let mut stranger = Walker::untold(&mut map, at, 1.0, seed);
        stranger.roam(&mut map, &room(50 + seed), 400);
        assert!(
            !stranger.is_placed(&map),
            "{seed}: in a room that nobody knows"
        );
    }
}

#[test]
fn sentinels_and_another_unit_of_one_robot_leave_the_others_found() {
    let room = room(2);
    let map = explored(&room);
    let wrong: [Sensors; 3] = [
        |_, level, random| {
            if random.uniform() < 0.3 {
                -9999.0
            } else {
                level
            }
        },
        |_, level, _| 1000.0 * level,
        |_, _, random| if random.uniform() < 0.5 { 1e29 } else { -1e29 },
    ];
    for sensors in wrong {
        let mut map = map.clone();
        let mut bad = Walker::told(&mut map, [3.0, 3.0], 0.4, 9);
        bad.sensors = sensors;
        bad.roam(&mut map, &room, 1500);
        for (seed, at) in [(1, [2.0, 2.5]), (2, [5.5, 3.0]), (3, [4.0, 6.0])] {
            let mut walker = Walker::untold(&mut map, at, 2.0 * seed as f64, seed);
            walker.roam(&mut map, &room, 80);
            assert!(walker.is_placed(&map), "{seed}");
            assert!(walker.off_m(&map) < 0.3, "{seed}: {}", walker.off_m(&map));
        }
    }
}

#[test]
fn a_robot_that_comes_from_where_nobody_was_is_found_inside() {
    let here = room(2);
    let map = explored(&here);
    for seed in 1..8 {
        let mut map = map.clone();
        let at = [40.0, 1.5 * seed as f64 - 2.0];
        let mut walker = Walker::untold(&mut map, at, 2.0 * seed as f64, seed);
        while walker.truth.translation.x > EDGE_M {
            walker.roam(&mut map, &here, 1);
            assert!(!walker.is_placed(&map), "{seed}");
        }
        walker.roam(&mut map, &here, 50);
        assert!(walker.is_placed(&map), "{seed}");
        assert!(walker.off_m(&map) < 0.3, "{seed}: {}", walker.off_m(&map));
    }
}

#[test]
fn nearly_every_robot_that_wakes_up_is_found_within_five_metres() {
    let here = room(9);
    let map = explored(&here);
    let mut found = 0;
    for seed in 0..20 {
        let mut map = map.clone();
        let mut draws = Seeded(100 + seed);
        let at = [1.0 + 6.0 * draws.uniform(), 1.0 + 6.0 * draws.uniform()];
        let mut walker = Walker::untold(&mut map, at, TAU * draws.uniform(), seed);
        for _ in 0..50 {
            walker.roam(&mut map, &here, 1);
            let is_wrong = walker.is_placed(&map) && walker.off_m(&map) > 0.6;
            assert!(!is_wrong, "{seed}: {} m off", walker.off_m(&map));
        }
        found += u32::from(walker.is_placed(&map) && walker.off_m(&map) < 0.3);
    }
    assert!(found >= 19, "{found} of 20");
}

#[test]
fn a_field_that_is_the_same_all_along_a_wall_tells_nobody_where_along_it() {
    let corridor = Room::new(3, Vector3::new(1.5, 1e6, 1e6));
    let map = explored(&corridor);
    for (seed, heading_rad) in [(5, 0.7), (6, 2.0), (7, -1.0)] {
        let mut map = map.clone();
        let mut walker = Walker::untold(&mut map, [3.0, 3.0], heading_rad, seed);
        walker.roam(&mut map, &corridor, 400);
        assert!(!walker.is_placed(&map), "{seed}");
    }
}

#[test]
fn a_channel_of_noise_changes_nothing() {
    let sensors: Sensors = |_, _, random| random.normal();
    let mut with = CognitiveMap::new(Settings::default());
    let mut walker = Walker::told(&mut with, [3.0, 3.0], 0.4, 1);
    walker.sensors = sensors;
    let mut without = CognitiveMap::new(Settings::default());
    let mut silent = Walker::told(&mut without, [3.0, 3.0], 0.4, 1);
    let room = room(4);
    let mut draws = Seeded(9);
    for step in 0..1500 {
        // Round and round, so that it comes to where it was.
        let turn_rad = 0.08 + if step % 50 == 0 { 0.1 } else { 0.0 };
        (walker.random, silent.random) = (Seeded(step), Seeded(step));
        walker.go(&mut with, turn_rad, (0.01, 0.01));
        silent.go(&mut without, turn_rad, (0.01, 0.01));
        walker.random = draws;
        walker.feel(&mut with, &room);
        draws = walker.random;
        assert_eq!(walker.robot.pose(&with), silent.robot.pose(&without));
    }
}

#[test]
fn one_sensor_of_four_that_lies_neither_misleads_nor_loses_a_robot() {
    let room = room(5);
    let map = explored(&room);
    let liars: [Sensors; 2] = [
        |channel, level, random| match channel {
            0 => random.normal(),
            _ => level + 0.1 * random.normal(),
        },
        |channel, level, random| {
            let offset = if channel == 0 { 1.5 } else { 0.0 };
            level + offset + 0.1 * random.normal()
        },
    ];
    for (seed, sensors) in (1..).zip(liars) {
        let mut map = map.clone();
        let mut walker = Walker::told(&mut map, [3.0, 3.0], 0.4, seed);
        walker.sensors = sensors;
        let mut off_m = Vec::new();
        for _ in 0..100 {
            off_m.extend(walker.roam(&mut map, &room, 10));
            assert_ne!(map.status(walker.robot.id), Some(Status::Lost), "{seed}");
        }
        let off_m = median(off_m);
        assert!(off_m < 0.25, "{seed}: {off_m} m");
    }
}

#[test]
fn a_robot_that_stands_still_gets_no_surer() {
    let room = room(6);
    let mut map = explored(&room);
    let mut walker = Walker::told(&mut map, [3.0, 3.0], 0.4, 3);
    walker.roam(&mut map, &room, 200);
    // Two more, so that no node is under way.
    walker.feel(&mut map, &room);
    let before = map.covariance(walker.robot.id).unwrap();
    let pose = walker.robot.pose(&map);
    for _ in 0..200 {
        walker.feel(&mut map, &room);
    }
    assert_eq!(map.covariance(walker.robot.id).unwrap(), before);
    assert_eq!(walker.robot.pose(&map), pose);
}

#[test]
fn a_robot_that_is_carried_off_notices_and_is_found() {
    let room = room(7);
    let map = explored(&room);
    for (seed, to) in [(1, [6.0, 5.5]), (2, [2.0, 6.0])] {
        let mut map = map.clone();
        let mut walker = Walker::told(&mut map, [4.0, 2.5], 0.0, seed);
        walker.roam(&mut map, &room, 100);
        assert!(walker.off_m(&map) < 0.3);
        walker.truth = Isometry3::new(Vector3::new(to[0], to[1], 0.0), Vector3::z() * 2.5);
        let mut lost = false;
        for _ in 0..25 {
            walker.roam(&mut map, &room, 10);
            lost |= map.status(walker.robot.id) == Some(Status::Lost);
        }
        assert!(lost, "{seed}");
        assert!(walker.off_m(&map) < 0.3, "{seed}: {}", walker.off_m(&map));
    }
}

/// A map that is restored at any moment of a search goes on like the one that was not.
#[test]
fn a_restored_map_goes_on_feeling_as_the_map_does() {
    let room = room(8);
    let mut map = explored(&room);
    let mut walker = Walker::untold(&mut map, [3.0, 4.0], 1.0, 4);
    // Before its search, and a step on each time.
    walker.roam(&mut map, &room, 12);
    let mut restored = map.clone();
    let mut restarts = 0;
    while !walker.is_placed(&map) && restarts < 60 {
        let pages: Vec<_> = restored.checkpoint(0).collect();
        restored = CognitiveMap::restore(Settings::default(), pages).unwrap();
        assert_eq!(restored.digest(), map.digest());
        let (truth, reckoned, seq) = (walker.truth, walker.reckoned, Robot { ..walker.robot });
        walker.random = Seeded(restarts);
        walker.roam(&mut map, &room, 1);
        (walker.truth, walker.reckoned, walker.robot) = (truth, reckoned, seq);
        walker.random = Seeded(restarts);
        walker.roam(&mut restored, &room, 1);
        restarts += 1;
    }
    assert!(walker.is_placed(&restored) && restarts > 3, "{restarts}");
    assert_eq!(restored.digest(), map.digest());
}
