//! What sightings do to the agents: poses are corrected, and newcomers find their place.

use cognitive_map::{
    CognitiveMap, EventKind, PlaceId, PoseNoise, RangeBearing, Relation, RelativePose, SampleBody,
    Settings, Sighting, Status, Target,
};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use crate::journal::{Robot, label, motion, start_pose};

/// Corners of a room of 8 m, and something hanging from its ceiling.
const MARKS: [(&str, [f64; 3]); 5] = [
    ("north-west", [-4.0, 4.0, 0.5]),
    ("north-east", [4.0, 4.0, 0.2]),
    ("south-west", [-4.0, -4.0, 0.9]),
    ("south-east", [4.0, -4.0, 0.4]),
    ("lamp", [0.5, 1.0, 2.5]),
];

/// A robot that drives through the room and knows what its odometry does not: where it is.
struct Driver {
    robot: Robot,
    truth: Isometry3<f64>,
    /// What odometry reads for a metre.
    scale: f64,
}

impl Driver {
    fn new(map: &mut CognitiveMap, truth: Isometry3<f64>, scale: f64) -> Self {
        let robot = Robot::enrol(map);
        Self {
            robot,
            truth,
            scale,
        }
    }

    /// Tells where it starts.
    fn start(&mut self, map: &mut CognitiveMap) {
        let turn = self.truth.rotation.scaled_axis();
        let start = start_pose(self.truth.translation.vector.into(), turn.into());
        self.robot.sample(map, start);
    }

    /// A step along a circle of 2 m.
    fn step(&mut self, map: &mut CognitiveMap) -> Vec<EventKind> {
        let (ahead, turn) = (Vector3::new(0.1, 0.0, 0.0), Vector3::new(0.0, 0.0, 0.05));
        self.truth *= Isometry3::new(ahead, turn);
        let read = ahead * self.scale;
        self.robot.sample(map, motion(read.into(), turn.into()))
    }

    /// Sees a target where it is.
    fn see(&mut self, map: &mut CognitiveMap, target: Target, at: &Point3<f64>) -> Vec<EventKind> {
        let seen = self.truth.inverse_transform_point(at);
        let level = seen.x.hypot(seen.y);
        let range_m = seen.coords.norm();
        let (azimuth, elevation) = (seen.y.atan2(seen.x), seen.z.atan2(level));
        let relation = RangeBearing::new(range_m, azimuth, elevation, 0.02, 0.005).unwrap();
        let relation = Relation::RangeBearing(relation);
        let sighting = Sighting { target, relation };
        self.robot.sample(map, SampleBody::Sighting(sighting))
    }

    fn look_around(&mut self, map: &mut CognitiveMap) -> Vec<EventKind> {
        let see = |(name, at): &(&str, [f64; 3])| {
            self.see(map, Target::Landmark(label(name)), &Point3::from(*at))
        };
        MARKS.iter().flat_map(see).collect()
    }

    fn error_m(&self, map: &CognitiveMap) -> f64 {
        (self.robot.position(map).coords - self.truth.translation.vector).norm()
    }
}

fn new_map() -> CognitiveMap {
    CognitiveMap::new(Settings::default())
}

fn at_start() -> Isometry3<f64> {
    Isometry3::new(Vector3::new(2.0, 0.0, 0.0), Vector3::new(0.0, 0.0, 1.6))
}

/// Drives ten rounds and a half with odometry that reads 3 % too much, and answers the error at the
/// end.
fn drive(looks: bool) -> f64 {
    let mut map = new_map();
    let mut driver = Driver::new(&mut map, at_start(), 1.03);
    driver.start(&mut map);
    for step in 0..1_320 {
        if looks && step % 5 == 0 {
            driver.look_around(&mut map);
        }
        driver.step(&mut map);
    }
    let agent = map.agent(driver.robot.id).unwrap();
    let decoded = agent.grid().decode(map.modules());
    assert!(
        (decoded - driver.robot.position(&map)).norm() < 1e-9,
        "the grid goes where the agent goes"
    );
    driver.error_m(&map)
}

#[test]
fn sightings_take_the_drift_away() {
    let (blind, seeing) = (drive(false), drive(true));
    assert!(seeing < 0.01 && blind > 0.05, "{seeing} m, blind {blind} m");
}

#[test]
fn a_newcomer_that_sees_what_the_map_knows_finds_its_place() {
    let mut map = new_map();
    let mut first = Driver::new(&mut map, at_start(), 1.0);
    first.start(&mut map);
    first.look_around(&mut map);
    let behind = Isometry3::new(Vector3::new(-1.0, 0.5, 0.0), Vector3::new(0.0, 0.0, -2.0));
    let mut late = Driver::new(&mut map, behind, 1.0);
    let mut placed = Vec::new();
    for _ in 0..40 {
        let mut events = late.step(&mut map);
        if placed.is_empty() {
            assert_eq!(map.status(late.robot.id).unwrap(), Status::Lost);
            events.extend(late.look_around(&mut map));
        }
        let place = |event: &EventKind| match event {
            EventKind::AgentPlaced { position } => Some(*position),
            _ => None,
        };
        let truth = Point3::from(late.truth.translation.vector);
        placed.extend(
            events
                .iter()
                .filter_map(place)
                .map(|at| (at - truth).norm()),
        );
    }
    assert!(
        matches!(placed[..], [error_m] if error_m < 0.2),
        "{placed:?}"
    );
    late.look_around(&mut map);
    assert!(late.error_m(&map) < 0.05, "{}", late.error_m(&map));
    assert_eq!(map.status(late.robot.id), Some(Status::Localized));
    let of_late = map
        .places()
        .filter(|(_, place)| place.founder() == late.robot.id);
    assert!(of_late.count() > 0, "now it teaches the map");
    assert_eq!(map.landmark_count(), MARKS.len(), "one room, not two");
}

#[test]
fn a_robot_that_is_seen_is_corrected() {
    let mut map = new_map();
    let mut watcher = Driver::new(&mut map, Isometry3::identity(), 1.0);
    let mut driver = Driver::new(&mut map, at_start(), 1.03);
    watcher.start(&mut map);
    driver.start(&mut map);
    for step in 0..1_260 {
        driver.step(&mut map);
        watcher.robot.stamp_ns = driver.robot.stamp_ns - 100_000_000;
        if step % 5 == 0 {
            let target = Target::Agent(label("robot-1"));
            let at = driver.truth.translation.vector.into();
            watcher.see(&mut map, target, &at);
        }
    }
    driver.step(&mut map);
    assert!(driver.error_m(&map) < 0.04, "{}", driver.error_m(&map));
    let evidence = map.agent(watcher.robot.id).unwrap().evidence();
    assert!(
        evidence.accepted > 200 && evidence.refused < 10,
        "{evidence:?}"
    );
}

#[test]
fn an_agent_whose_sightings_contradict_the_map_says_so_and_finds_back() {
    let mut map = new_map();
    let mut driver = Driver::new(&mut map, at_start(), 1.0);
    driver.start(&mut map);
    for _ in 0..50 {
        driver.look_around(&mut map);
        driver.step(&mut map);
    }
    assert_eq!(map.status(driver.robot.id).unwrap(), Status::Localized);
    // Someone carries it away.
    driver.truth.translation.vector += Vector3::new(-2.0, 1.0, 0.0);
    let mut was_uncertain = false;
    for (name, at) in MARKS {
        driver.see(&mut map, Target::Landmark(label(name)), &Point3::from(at));
        let refused = map.agent(driver.robot.id).unwrap().evidence().refused;
        let is_uncertain = map.status(driver.robot.id) == Some(Status::Uncertain);
        was_uncertain |= is_uncertain;
        // From the fourth refused sighting on it is uncertain, or where it is said to be.
        let is_right = driver.error_m(&map) < 0.2;
        assert!(refused < 4 || is_uncertain || is_right, "{name}: {refused}");
    }
    assert!(was_uncertain);
    for _ in 0..30 {
        driver.step(&mut map);
        driver.look_around(&mut map);
    }
    assert!(driver.error_m(&map) < 0.1, "{}", driver.error_m(&map));
    assert_eq!(map.status(driver.robot.id).unwrap(), Status::Localized);
}

/// A robot is nudged on its way, and sees at the end what it saw at the start: then it is known
/// better where it was on the way.
#[test]
fn what_is_seen_at_the_end_corrects_the_way() {
    let mut map = new_map();
    let mut driver = Driver::new(&mut map, at_start(), 1.0);
    driver.start(&mut map);
    driver.look_around(&mut map);
    let mut way = Vec::new();
    for step in 0..63 {
        if step == 30 {
            driver.truth.rotation *= UnitQuaternion::from_euler_angles(0.0, 0.0, 0.15);
        }
        driver.step(&mut map);
        let causal = driver.robot.pose(&map).translation.vector;
        let truth = driver.truth.translation.vector;
        way.push((driver.robot.stamp_ns, truth, causal));
    }
    driver.look_around(&mut map);
    let refined = map.refined();
    let poses = &refined.agents[0].poses;
    assert!(refined.agents[0].is_in_map && poses.len() > 20);
    let (mut causal_m, mut refined_m) = (0.0f64, 0.0f64);
    for (stamp_ns, truth, causal) in way {
        let Some(pose) = poses.iter().find(|pose| pose.stamp_ns == stamp_ns) else {
            continue;
        };
        causal_m = causal_m.max((causal - truth).norm());
        refined_m = refined_m.max((pose.pose.translation.vector - truth).norm());
    }
    assert!(
        causal_m > 0.2 && refined_m < causal_m / 3.0,
        "{causal_m} m, refined {refined_m} m"
    );
    let lamp = refined
        .landmarks
        .iter()
        .find(|landmark| landmark.label.as_str() == "lamp");
    let off = lamp.unwrap().position - Point3::from(MARKS[4].1);
    assert!(off.norm() < 0.05, "{off}");
}

/// A robot on a circle whose odometry turns 2 % too much, which is told again and again that it is
/// where it was a round ago, sometimes wrongly.
struct Circling {
    driver: Driver,
    /// By odometry alone.
    blind: Isometry3<f64>,
    /// Where it was at each step, and the sample that says so.
    way: Vec<(Isometry3<f64>, u64)>,
    /// The places that it founded, with where it was then and how far that was from where it
    /// thought to be \[m\].
    founded: Vec<(PlaceId, Point3<f64>, f64)>,
}

impl Circling {
    fn new(map: &mut CognitiveMap) -> Self {
        let mut driver = Driver::new(map, at_start(), 1.0);
        driver.start(map);
        Self {
            blind: driver.truth,
            way: vec![(driver.truth, driver.robot.seq)],
            driver,
            founded: Vec::new(),
        }
    }

    fn step(&mut self, map: &mut CognitiveMap) {
        let (ahead, turn) = (Vector3::new(0.1, 0.0, 0.0), Vector3::new(0.0, 0.0, 0.05));
        self.driver.truth *= Isometry3::new(ahead, turn);
        self.blind *= Isometry3::new(ahead, turn * 1.02);
        let (truth, seq) = (self.driver.truth, self.driver.robot.seq);
        let read = motion(ahead.into(), (turn * 1.02).into());
        for event in self.driver.robot.sample(map, read) {
            if let EventKind::PlaceRecruited { place, position } = event {
                let at = Point3::from(truth.translation.vector);
                self.founded.push((place, at, (position - at).norm()));
            }
        }
        self.way.push((truth, seq));
    }

    /// Is told where it was a round ago, off by some error.
    fn matched(&mut self, map: &mut CognitiveMap, error: &Isometry3<f64>) {
        let (then, seq) = self.way[self.way.len() - 1 - 127];
        let seen = error * self.driver.truth.inv_mul(&then);
        let noise = PoseNoise::new([0.03; 3], [0.02; 3]).unwrap();
        let at = (seen.translation.vector.into(), seen.rotation.coords.into());
        let relation = Relation::Pose(RelativePose::new(at.0, at.1, noise).unwrap());
        let target = Target::OwnSample(seq);
        let sighting = Sighting { target, relation };
        self.driver
            .robot
            .sample(map, SampleBody::Sighting(sighting));
    }

    fn go_round(&mut self, map: &mut CognitiveMap) {
        for step in 0..400 {
            self.step(map);
            if step >= 130 && step % 5 == 0 {
                let wrong = Isometry3::translation(3.0, -2.0, 0.0);
                let right = Isometry3::identity();
                self.matched(map, if step % 3 == 0 { &wrong } else { &right });
            }
        }
    }
}

#[test]
fn matches_that_agree_close_the_loop_and_wrong_ones_do_not_bend_it() {
    let mut map = new_map();
    let mut circling = Circling::new(&mut map);
    circling.go_round(&mut map);
    let truth = circling.driver.truth.translation.vector;
    let blind_m = (circling.blind.translation.vector - truth).norm();
    let error_m = circling.driver.error_m(&map);
    assert!(
        blind_m > 0.3 && error_m < blind_m / 3.0,
        "{error_m} m, blind {blind_m} m"
    );
}

#[test]
fn places_lie_where_the_past_turns_out_to_lie() {
    let mut map = new_map();
    let mut circling = Circling::new(&mut map);
    circling.go_round(&mut map);
    let (mut before, mut after) = (Vec::new(), Vec::new());
    for &(place, truth, off_m) in &circling.founded {
        let at = *map.place(place).unwrap().position();
        before.push(off_m);
        after.push((at - truth).norm());
        let (nearest, distance_m) = map.nearest_place(&at).unwrap();
        assert!(
            nearest == place || distance_m == 0.0,
            "{place:?} is found where it is, not {nearest:?}"
        );
    }
    let mean = |off: &[f64]| off.iter().sum::<f64>() / off.len() as f64;
    assert!(
        mean(&before) > 0.1 && mean(&after) < 0.5 * mean(&before),
        "{} m when they were founded, {} m now",
        mean(&before),
        mean(&after)
    );
}
