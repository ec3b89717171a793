//! Distances alone: beacons are found, and what says little changes little.

use cognitive_map::{
    CognitiveMap, Range, RangeBearing, Relation, SampleBody, Settings, Sighting, Target,
};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::journal::{Robot, label, motion, start_pose};

/// Beacons about a yard.
const BEACONS: [(&str, [f64; 3]); 4] = [
    ("north", [2.0, 14.0, 0.5]),
    ("east", [15.0, 3.0, 0.5]),
    ("south", [1.0, -12.0, 0.5]),
    ("west", [-9.0, 2.0, 0.5]),
];

/// Where the antenna is on the robot.
const ANTENNA: [f64; 3] = [0.3, -0.2, 0.5];

/// A robot that measures distances.
struct Ranger {
    map: CognitiveMap,
    robot: Robot,
    truth: Isometry3<f64>,
    steps: u32,
}

impl Ranger {
    fn new() -> Self {
        let mut map = CognitiveMap::new(Settings::default());
        let mut robot = Robot::enrol(&mut map);
        robot.sample(&mut map, start_pose([0.0; 3], [0.0; 3]));
        Self {
            map,
            robot,
            truth: Isometry3::identity(),
            steps: 0,
        }
    }

    /// A step of 0.2 m; odometry reads turns 2 % too small.
    fn step(&mut self, turn_rad: f64) {
        let ahead = Vector3::new(0.2, 0.0, 0.0);
        self.truth *= Isometry3::new(ahead, Vector3::z() * turn_rad);
        let read = motion(ahead.into(), [0.0, 0.0, 0.98 * turn_rad]);
        self.robot.sample(&mut self.map, read);
        self.steps += 1;
    }

    /// An error of a distance with a deviation of about 0.05 m, never the same.
    fn error_m(&self, beacon: usize) -> f64 {
        0.07 * (f64::from(self.steps) * 12.9898 + beacon as f64 * 78.233).sin()
    }

    /// The true distance of a beacon.
    fn range_m(&self, beacon: usize) -> f64 {
        let antenna = self.truth * Point3::from(ANTENNA);
        (Point3::from(BEACONS[beacon].1) - antenna).norm()
    }

    fn see(&mut self, target: Target, relation: Relation) {
        let sighting = SampleBody::Sighting(Sighting { target, relation });
        self.robot.sample(&mut self.map, sighting);
    }

    fn measure(&mut self, beacon: usize, off_m: f64) {
        let range_m = self.range_m(beacon) + self.error_m(beacon) + off_m;
        let range = Range::new(range_m, 0.05, ANTENNA).unwrap();
        let target = Target::Landmark(label(BEACONS[beacon].0));
        self.see(target, Relation::Range(range));
    }

    /// Drives a curve that is nowhere straight, and measures all beacons at each step.
    fn tour(&mut self, steps: u32, off_m: impl Fn(u32, usize) -> f64) {
        for k in 0..steps {
            self.step(0.08 + 0.06 * (f64::from(k) * 0.05).sin());
            for beacon in 0..BEACONS.len() {
                self.measure(beacon, off_m(k, beacon));
            }
        }
    }

    fn pose_error_m(&self) -> f64 {
        (self.robot.position(&self.map).coords - self.truth.translation.vector).norm()
    }

    /// How far a beacon is from where it is estimated in the plane; `None` of one that is not
    /// known.
    fn beacon_error_m(&self, beacon: usize) -> Option<f64> {
        let (name, at) = BEACONS[beacon];
        let (_, landmark) = self.map.landmark_by_label(name)?;
        Some((landmark.position() - Point3::from(at)).xy().norm())
    }

    fn assert_found(&self, most_m: f64) {
        for (beacon, (name, _)) in BEACONS.iter().enumerate() {
            let error_m = self.beacon_error_m(beacon);
            assert!(
                error_m.is_some_and(|error| error < most_m),
                "{name}: {error_m:?}"
            );
        }
        assert!(self.pose_error_m() < most_m, "{}", self.pose_error_m());
    }
}

#[test]
fn distances_alone_tell_where_beacons_and_the_robot_are() {
    let mut ranger = Ranger::new();
    ranger.tour(300, |_, _| 0.0);
    ranger.assert_found(1.5);
    assert_eq!(ranger.map.refined().landmarks.len(), BEACONS.len());
}

/// A reflection is never too short.
#[test]
fn distances_that_are_sometimes_far_too_long_mislead_nobody() {
    let mut ranger = Ranger::new();
    let reflected = |k: u32, beacon: usize| (k as usize * 7 + beacon * 3) % 10 < 3;
    ranger.tour(
        400,
        |k, beacon| if reflected(k, beacon) { 15.0 } else { 0.0 },
    );
    ranger.assert_found(1.5);
}

/// The first distances may be the wrong ones.
#[test]
fn a_beacon_is_found_whose_first_distances_were_reflected() {
    for wrong in 1..4 {
        let mut ranger = Ranger::new();
        let reflected = |k: u32, beacon: usize| (beacon * 11 + k as usize) % 44 < wrong;
        for k in 0..4_usize {
            ranger.measure(0, if k < wrong { 15.0 } else { 0.0 });
        }
        ranger.tour(
            300,
            |k, beacon| {
                if reflected(k, beacon) { 15.0 } else { 0.0 }
            },
        );
        ranger.assert_found(1.5);
    }
}

/// On a straight way nobody can tell a beacon from its mirror image.
#[test]
fn a_beacon_is_not_found_before_the_robot_turns() {
    let mut ranger = Ranger::new();
    for _ in 0..80 {
        ranger.step(0.0);
        ranger.measure(0, 0.0);
    }
    assert_eq!(ranger.beacon_error_m(0), None);
}

/// What a bearing of three radians says of the direction is nothing, whatever the bearing is.
#[test]
fn a_bearing_that_says_nothing_changes_nothing() {
    let poses = [0.0, 2.0, -1.0].map(|azimuth_rad| {
        let mut ranger = Ranger::new();
        for _ in 0..200 {
            ranger.step(0.1);
            for (beacon, (name, _)) in BEACONS.iter().enumerate() {
                let range_m = ranger.range_m(beacon) + ranger.error_m(beacon);
                let seen = RangeBearing::new(range_m, azimuth_rad, 0.0, 0.05, 3.0).unwrap();
                let target = Target::Landmark(label(name));
                ranger.see(target, Relation::RangeBearing(seen));
            }
        }
        assert!(ranger.pose_error_m() < 1.0, "{}", ranger.pose_error_m());
        ranger.robot.pose(&ranger.map)
    });
    assert_eq!(poses[0], poses[1]);
    assert_eq!(poses[0], poses[2]);
}

/// Distances of an agent that nobody knows leave the pose where motion has it.
#[test]
fn an_agent_that_nobody_knows_says_nothing() {
    let (mut ranger, mut alone) = (Ranger::new(), Ranger::new());
    for k in 0..100 {
        for robot in [&mut ranger, &mut alone] {
            robot.step(0.05);
        }
        let range = Range::new(3.0 + f64::from(k % 5), 0.05, [0.0; 3]).unwrap();
        ranger.see(Target::Agent(label("stranger")), Relation::Range(range));
    }
    assert_eq!(ranger.robot.pose(&ranger.map), alone.robot.pose(&alone.map));
}
