//! Landmarks that a robot calls by names of its own.

use cognitive_map::{CognitiveMap, EventKind, Settings};
use nalgebra::{Isometry3, Point3, Vector3};

use crate::journal::{Robot, sighting};

/// Posts in no order on a floor.
const POSTS: [[f64; 2]; 12] = [
    [4.1, 1.3],
    [-3.2, 2.2],
    [1.4, -4.6],
    [2.3, 5.1],
    [-4.7, -3.4],
    [6.2, -2.1],
    [-6.6, 4.4],
    [0.2, 1.9],
    [7.4, 4.9],
    [-1.8, -1.1],
    [-7.9, -0.6],
    [3.3, -1.7],
];

/// A robot on the floor, and where it truly is in the frame of the posts.
struct Driver {
    robot: Robot,
    truth: Isometry3<f64>,
    name: &'static str,
    step: u32,
}

impl Driver {
    fn new(map: &mut CognitiveMap, truth: Isometry3<f64>, name: &'static str) -> Self {
        Self {
            robot: Robot::enrol(map),
            truth,
            name,
            step: 0,
        }
    }

    /// Moves, and sees one of the posts.
    fn step(&mut self, map: &mut CognitiveMap) -> Vec<EventKind> {
        let turn = 0.05 + 0.02 * (0.03 * f64::from(self.step)).sin();
        let mut events = self.robot.go(map, [0.2, 0.0, 0.0], [0.0, 0.0, turn]);
        self.truth *= Isometry3::new(Vector3::new(0.2, 0.0, 0.0), Vector3::z() * turn);
        let post = self.step as usize % POSTS.len();
        self.step += 1;
        let [x, y] = POSTS[post];
        let seen = self.truth.inverse_transform_point(&Point3::new(x, y, 0.0));
        let name = format!("{}-{post}", self.name);
        events.extend(
            self.robot
                .sample(map, sighting(&name, seen.coords.into(), 0.05)),
        );
        events
    }
}

fn team() -> (CognitiveMap, Driver, Driver) {
    let mut map = CognitiveMap::new(Settings::default());
    let one = Driver::new(&mut map, Isometry3::identity(), "a");
    let elsewhere = Isometry3::new(Vector3::new(2.0, -1.0, 0.0), Vector3::z() * 2.5);
    let other = Driver::new(&mut map, elsewhere, "b");
    (map, one, other)
}

#[test]
fn a_robot_with_names_of_its_own_finds_its_place_by_where_its_landmarks_lie() {
    let (mut map, mut one, mut other) = team();
    let mut placed = 0;
    for _ in 0..400 {
        one.step(&mut map);
        let events = other.step(&mut map);
        let is_placed = |event: &EventKind| matches!(event, EventKind::AgentPlaced { .. });
        placed += events.iter().filter(|event| is_placed(event)).count();
    }
    assert_eq!(placed, 1);
    for driver in [&one, &other] {
        let off = driver.truth.inv_mul(&driver.robot.pose(&map));
        assert!(
            off.translation.vector.norm() < 0.2,
            "{}: {off}",
            driver.name
        );
    }
    // Both names lead to one landmark, which counts once.
    assert_eq!(map.landmark_count(), POSTS.len());
    assert_eq!(map.landmarks().count(), POSTS.len());
    assert_eq!(map.landmarks_after(None).count(), POSTS.len());
    for (post, [x, y]) in POSTS.iter().enumerate() {
        let [a, b] =
            ["a", "b"].map(|name| map.landmark_by_label(&format!("{name}-{post}")).unwrap());
        assert_eq!(a.0, b.0);
        let off = a.1.position() - Point3::new(*x, *y, 0.0);
        assert!(off.norm() < 0.2, "{post}: {off}");
        assert!(a.1.sightings() > 30, "those of both robots");
    }
    // So it is when the past is smoothed.
    let refined = map.refined();
    assert_eq!(refined.landmarks.len(), POSTS.len());
    assert!(refined.agents.iter().all(|agent| agent.is_in_map));
    for landmark in &refined.landmarks {
        let (_, known) = map.landmark_by_label(landmark.label.as_str()).unwrap();
        assert_eq!(known.label(), &landmark.label);
        assert!((known.position() - landmark.position).norm() < 0.2);
    }
}

#[test]
fn a_restored_map_finds_the_same_names() {
    let [whole, restored] = [None, Some(17)].map(|every: Option<u32>| {
        let (mut map, mut one, mut other) = team();
        for step in 1..=300 {
            one.step(&mut map);
            other.step(&mut map);
            if every.is_some_and(|every| step % every == 0) {
                let pages: Vec<_> = map.checkpoint(0).collect();
                let restored = CognitiveMap::restore(Settings::default(), pages).unwrap();
                assert_eq!(restored.digest(), map.digest(), "step {step}");
                map = restored;
            }
        }
        assert_eq!(map.landmark_count(), POSTS.len(), "the names are found");
        map.digest()
    });
    assert_eq!(whole, restored);
}
