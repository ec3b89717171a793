//! Robots that are carried off, and notice by what they see.

use std::f64::consts::PI;

use cognitive_map::{CognitiveMap, Motion, PoseNoise, SampleBody, Settings, Status};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use crate::journal::{Robot, descriptor, level, start_pose};

use random::Seeded;

/// Numbers of a view; step of a robot \[m\]; edge of the room \[m\], and distance between the lanes
/// in which it is explored.
const NUMBERS: usize = 64;
const STEP_M: f64 = 0.1;
const EDGE_M: f64 = 8.0;
const LANE_M: f64 = 0.4;

/// A room, seen from everywhere.
struct Room {
    features: Vec<(Vector3<f64>, f64)>,
}

/// A robot in it: where it is, and what it reports.
struct Walker {
    robot: Robot,
    truth: Isometry3<f64>,
    random: Seeded,
}

impl Room {
    fn new() -> Self {
        let mut random = Seeded(31);
        let features = (0..NUMBERS).map(|_| {
            let wave = Vector3::new(random.normal(), random.normal(), random.normal());
            (wave, random.uniform() * std::f64::consts::TAU)
        });
        Self {
            features: features.collect(),
        }
    }

    /// What is seen from a point, with a tenth of noise.
    fn view(&self, from: &Vector3<f64>, random: &mut Seeded) -> Vec<f32> {
        let seen = self.features.iter().map(|(wave, shift)| {
            (wave.dot(from) + shift).cos() + 0.1 * std::f64::consts::FRAC_1_SQRT_2 * random.normal()
        });
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a view needs no more digits"
        )]
        seen.map(|number| number as f32).collect()
    }
}

impl Walker {
    /// A robot that is told where it stands.
    fn told(map: &mut CognitiveMap, at: [f64; 2], heading_rad: f64, seed: u64) -> Self {
        let mut walker = Self {
            robot: Robot::enrol(map),
            truth: Isometry3::identity(),
            random: Seeded(seed),
        };
        walker.put(map, at, heading_rad);
        walker
    }

    /// It is put somewhere, and told so.
    fn put(&mut self, map: &mut CognitiveMap, at: [f64; 2], heading_rad: f64) {
        self.carry(at, heading_rad);
        let start = start_pose([at[0], at[1], 0.0], [0.0, 0.0, heading_rad]);
        self.robot.sample(map, start);
    }

    /// It is put somewhere, and nobody tells.
    fn carry(&mut self, at: [f64; 2], heading_rad: f64) {
        let turn = Vector3::z() * heading_rad;
        self.truth = Isometry3::new(Vector3::new(at[0], at[1], 0.0), turn);
    }

    /// Goes a step and turns, with odometry that errs as it says, and sees the room; or something
    /// else, one time in twenty.
    fn step(&mut self, map: &mut CognitiveMap, room: &Room, turn_rad: f64) {
        self.go(map, turn_rad);
        let is_wrong = self.random.uniform() < 0.05;
        let from = if is_wrong {
            Vector3::repeat(1e3 + 1e3 * self.random.uniform())
        } else {
            self.truth.translation.vector
        };
        let view = room.view(&from, &mut self.random);
        self.robot.sample(map, descriptor("camera", &view));
    }

    fn go(&mut self, map: &mut CognitiveMap, turn_rad: f64) {
        self.go_in(map, turn_rad, 1.0);
    }

    /// Goes a step with odometry in so many metres.
    fn go_in(&mut self, map: &mut CognitiveMap, turn_rad: f64, unit: f64) {
        let went = Isometry3::new(Vector3::x() * STEP_M, Vector3::z() * turn_rad);
        self.truth *= went;
        let (sd_m, sd_rad) = (0.001, 0.001);
        let read_m = [
            unit * (STEP_M + sd_m * self.random.normal()),
            unit * sd_m * self.random.normal(),
            0.0,
        ];
        let read_rad = turn_rad + sd_rad * self.random.normal();
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), read_rad);
        let noise = PoseNoise::new([sd_m, sd_m, 0.0], [0.0, 0.0, sd_rad]).unwrap();
        let motion = Motion::from_increment(read_m, rotation.coords.into(), Some(noise)).unwrap();
        self.robot.sample(map, SampleBody::Motion(motion));
    }

    /// The turn of the next step within the room: back towards its middle where it comes too near
    /// to a wall.
    fn roaming_rad(&mut self) -> f64 {
        let middle = Vector3::new(EDGE_M / 2.0, EDGE_M / 2.0, 0.0);
        let to_middle = self
            .truth
            .inverse_transform_vector(&(middle - self.truth.translation.vector));
        if to_middle.norm() > 0.3 * EDGE_M {
            to_middle.y.atan2(to_middle.x).clamp(-0.3, 0.3)
        } else {
            0.1 * self.random.normal()
        }
    }

    /// Goes so many steps within the room; answers how it called itself.
    fn roam(&mut self, map: &mut CognitiveMap, room: &Room, steps: u32) -> Vec<Status> {
        let mut called = Vec::new();
        for _ in 0..steps {
            let turn_rad = self.roaming_rad();
            self.step(map, room, turn_rad);
            called.push(map.status(self.robot.id).unwrap());
        }
        called
    }

    /// Goes so many steps round in a circle of a metre.
    fn turn(&mut self, map: &mut CognitiveMap, room: &Room, steps: u32) -> Vec<Status> {
        let step = |_| {
            self.step(map, room, STEP_M);
            map.status(self.robot.id).unwrap()
        };
        (0..steps).map(step).collect()
    }

    fn off_m(&self, map: &CognitiveMap) -> f64 {
        (self.robot.pose(map).translation.vector - self.truth.translation.vector).norm()
    }
}

/// A room that a robot has seen lane by lane, put at the beginning of each.
fn explored() -> (CognitiveMap, Room) {
    let (mut map, room) = (CognitiveMap::new(Settings::default()), Room::new());
    let mut explorer = Walker::told(&mut map, [0.0, 0.0], 0.0, 7);
    let lanes = (0..).map(|lane| LANE_M * f64::from(lane));
    for (number, lane_m) in lanes.take_while(|lane_m| *lane_m <= EDGE_M).enumerate() {
        let is_back = number % 2 == 1;
        let (from_m, heading_rad) = if is_back { (EDGE_M, PI) } else { (0.0, 0.0) };
        explorer.put(&mut map, [from_m, lane_m], heading_rad);
        for _ in 0..80 {
            explorer.step(&mut map, &room, 0.0);
        }
    }
    (map, room)
}

#[test]
fn a_robot_that_is_carried_off_says_that_it_is_lost_and_is_found() {
    let (map, room) = explored();
    for (seed, to) in [(1, [6.5, 6.0]), (2, [1.5, 6.5]), (3, [6.0, 2.5])] {
        let mut map = map.clone();
        // Round and round, a metre about the middle of the room.
        let mut walker = Walker::told(&mut map, [4.0, 3.0], 0.0, seed);
        let before = walker.turn(&mut map, &room, 30);
        assert!(before.iter().all(|status| *status == Status::Localized));
        walker.carry(to, 2.5);
        let after = walker.turn(&mut map, &room, 40);
        let lost = after.iter().position(|status| *status == Status::Lost);
        assert!(lost.is_some_and(|steps| steps < 35), "{seed}: {after:?}");
        assert_eq!(after.last(), Some(&Status::Localized), "{seed}: {after:?}");
        assert!(walker.off_m(&map) < 0.25, "{seed}: {}", walker.off_m(&map));
        // Afterwards, too, it is known where it went, and where it was put is not where it came by
        // itself.
        let refined = map.refined();
        let own = &refined.agents[walker.robot.id.0 as usize].poses;
        let end = own.last().unwrap().pose.translation.vector;
        assert!((end - walker.truth.translation.vector).norm() < 0.3);
        let explorer = &refined.agents[0].poses[0].pose;
        assert!(explorer.translation.vector.norm() < 0.1);
        // What it saw before it noticed has put nobody else astray.
        let mut other = Walker::told(&mut map, [4.0, 3.0], 0.0, seed + 10);
        let called = other.turn(&mut map, &room, 60);
        assert!(called.iter().all(|status| *status != Status::Lost));
    }
}

#[test]
fn a_robot_that_is_where_it_believes_to_be_is_never_lost() {
    let (map, room) = explored();
    for seed in 1..=3 {
        let mut map = map.clone();
        let mut walker = Walker::told(&mut map, [3.0, 3.0], 0.4, seed);
        // In the room, out of it to where nobody has been, and about there.
        let mut called = walker.roam(&mut map, &room, 300);
        for _ in 0..200 {
            walker.step(&mut map, &room, 0.02);
            called.push(map.status(walker.robot.id).unwrap());
        }
        assert!(called.iter().all(|status| *status != Status::Lost));
        assert!(walker.off_m(&map) < 1.0, "{}", walker.off_m(&map));
    }
}

/// Where it is not known to be, a robot that may be anywhere teaches nobody anything.
#[test]
fn a_robot_that_may_be_anywhere_founds_and_teaches_no_place() {
    let (mut map, room) = explored();
    let mut walker = Walker::told(&mut map, [4.0, 3.0], 0.0, 8);
    let light = |map: &mut CognitiveMap, walker: &mut Walker| {
        walker.turn(map, &room, 1);
        walker.robot.sample(map, level("light", 3.0, [0.0; 3]));
    };
    (0..30).for_each(|_| light(&mut map, &mut walker));
    // Out of the room, to where nobody has been and nothing looks like it.
    walker.carry([80.0, -60.0], 2.5);
    for _ in 0..40 {
        light(&mut map, &mut walker);
        if map.status(walker.robot.id) == Some(Status::Lost) {
            break;
        }
    }
    assert_eq!(map.status(walker.robot.id), Some(Status::Lost));
    let memory = |map: &CognitiveMap| {
        let places = map.places().map(|(id, place)| {
            let taught: u64 = map.remembered(id).map(|own| own.percepts).sum();
            (id, place.visits(), taught)
        });
        (places.collect::<Vec<_>>(), map.trips_recorded())
    };
    let before = memory(&map);
    assert!(before.0.iter().any(|(_, _, taught)| *taught > 0));
    for _ in 0..100 {
        walker.step(&mut map, &room, 0.0);
        walker.robot.sample(&mut map, level("light", 9.0, [0.0; 3]));
        assert_eq!(map.status(walker.robot.id), Some(Status::Lost));
        assert!(map.agent(walker.robot.id).unwrap().place().is_none());
    }
    assert_eq!(memory(&map), before);
}

/// A robot that is told where it stands is not where it was told wrongly.
#[test]
fn what_was_told_wrongly_is_noticed() {
    let (mut map, room) = explored();
    let mut walker = Walker::told(&mut map, [3.0, 3.0], 0.4, 4);
    walker.carry([6.0, 5.0], 2.0);
    let called = walker.roam(&mut map, &room, 60);
    assert!(called.contains(&Status::Lost));
    assert!(walker.off_m(&map) < 0.25, "{}", walker.off_m(&map));
    assert_eq!(called.last(), Some(&Status::Localized));
}

/// Sightings that agree with where a robot is believed to be outweigh views that do not: the light
/// may have changed.
#[test]
fn a_robot_that_sights_landmarks_where_they_are_is_not_lost() {
    let (mut map, room) = explored();
    let mut walker = Walker::told(&mut map, [3.0, 3.0], 0.4, 5);
    let other = Room {
        features: room
            .features
            .iter()
            .map(|(wave, shift)| (*wave, shift + 1.5 * wave.x.signum() + wave.y))
            .collect(),
    };
    let landmark = Vector3::new(4.0, 5.0, 0.0);
    for _ in 0..60 {
        walker.step(&mut map, &other, 0.1);
        let seen = walker.truth.inverse_transform_point(&landmark.into());
        walker.robot.sample(
            &mut map,
            crate::journal::sighting("lamp", [seen.x, seen.y, 0.0], 0.05),
        );
        assert_eq!(map.status(walker.robot.id), Some(Status::Localized));
    }
}

#[test]
fn a_map_restored_in_doubt_goes_on_like_the_original() {
    let (mut map, room) = explored();
    let mut walker = Walker::told(&mut map, [3.0, 3.0], 0.4, 6);
    walker.roam(&mut map, &room, 10);
    walker.carry([6.5, 6.0], 2.5);
    let mut was_lost = false;
    for _ in 0..8 {
        let pages: Vec<_> = map.checkpoint(0).collect();
        let mut restored = CognitiveMap::restore(Settings::default(), pages).unwrap();
        assert_eq!(restored.digest(), map.digest());
        let mut other = Walker {
            robot: Robot { ..walker.robot },
            random: Seeded(walker.random.0),
            truth: walker.truth,
        };
        let called = walker.roam(&mut map, &room, 4);
        assert_eq!(other.roam(&mut restored, &room, 4), called);
        assert_eq!(restored.digest(), map.digest());
        was_lost |= called.contains(&Status::Lost);
    }
    assert!(was_lost);
}

/// Who wakes up is found in a room that a robot with a stuck camera, or with odometry in
/// millimetres, was in too.
#[test]
fn a_faulty_robot_hides_the_room_from_no_other() {
    let (map, room) = explored();
    for (unit, is_stuck) in [(1.0, true), (1000.0, false)] {
        let mut map = map.clone();
        let mut faulty = Walker::told(&mut map, [4.0, 3.0], 0.4, 3);
        let mut view = room.view(&faulty.truth.translation.vector, &mut faulty.random);
        for _ in 0..1000 {
            let turn_rad = faulty.roaming_rad();
            faulty.go_in(&mut map, turn_rad, unit);
            if !is_stuck {
                view = room.view(&faulty.truth.translation.vector, &mut faulty.random);
            }
            faulty.robot.sample(&mut map, descriptor("camera", &view));
        }
        for (seed, at) in [(5, [6.5, 6.0]), (6, [1.5, 6.5]), (7, [6.0, 2.5])] {
            let mut newcomer = Walker {
                robot: Robot::enrol(&mut map),
                truth: Isometry3::identity(),
                random: Seeded(seed),
            };
            newcomer.carry(at, 0.9 * at[1]);
            let called = newcomer.roam(&mut map, &room, 60);
            assert_eq!(called.last(), Some(&Status::Localized), "{unit} {seed}");
            let off_m = newcomer.off_m(&map);
            assert!(off_m < 0.25, "{unit} {seed}: {off_m}");
        }
    }
}
