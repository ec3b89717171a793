//! Agents that wake up in a large hall where transmitters are heard, as Wi-Fi is.

use cognitive_map::{CognitiveMap, EventKind};
use nalgebra::Vector2;
use random::Seeded;

use crate::journal::{Robot, descriptor, settings, start_pose};

/// Size of the hall \[m\].
const HALL_M: [f64; 2] = [110.0, 70.0];
const TRANSMITTERS: usize = 64;
/// Distance over which a transmitter is heard e times less \[m\].
const REACH_M: f64 = 9.0;
/// Way between two views \[m\], and views of a session.
const STEP_M: f64 = 2.5;
const VIEWS: usize = 24;
const TAUGHT: usize = 60;
/// Views after which a robot that explores is told again where it is.
const TOLD_VIEWS: usize = 6;

/// What is heard.
#[derive(Clone, Copy, PartialEq)]
enum Heard {
    /// Transmitters all over the hall.
    Hall,
    /// In each half of the hall the same.
    Halves,
    /// Noise.
    Noise,
}

struct World {
    heard: Heard,
    transmitters: Vec<Vector2<f64>>,
    random: Seeded,
    map: CognitiveMap,
}

/// Where a robot is that walks about.
struct Walk {
    robot: Robot,
    at: Vector2<f64>,
    yaw_rad: f64,
}

impl World {
    /// A hall that robots have explored one after the other.
    fn new(heard: Heard) -> Self {
        let mut world = Self::unexplored(heard);
        for _ in 0..TAUGHT {
            let mut walk = world.wake();
            world.explore(&mut walk, VIEWS);
        }
        world
    }

    /// A hall that so many robots have explored all at once, told every few steps where they are.
    fn explored_by(robots: usize) -> Self {
        let mut world = Self::unexplored(Heard::Hall);
        let mut walks: Vec<Walk> = (0..robots).map(|_| world.wake()).collect();
        for _ in 0..TAUGHT * VIEWS / (robots * TOLD_VIEWS) {
            for walk in &mut walks {
                world.explore(walk, TOLD_VIEWS);
            }
        }
        world
    }

    /// A robot is told where it is, and walks about for so many views.
    fn explore(&mut self, walk: &mut Walk, views: usize) {
        let start = start_pose([walk.at.x, walk.at.y, 0.0], [0.0, 0.0, walk.yaw_rad]);
        walk.robot.sample(&mut self.map, start);
        for _ in 0..views {
            self.go(walk);
        }
    }

    fn unexplored(heard: Heard) -> Self {
        let mut random = Seeded(7);
        let transmitter = |_| {
            let [x, y] = HALL_M.map(|size| size * random.uniform());
            Vector2::new(x, y)
        };
        let transmitters = (0..TRANSMITTERS).map(transmitter).collect();
        let map = CognitiveMap::new(settings(|values| {
            values.keyframe_spacing_m = 5.0;
            values.keyframe_spacing_rad = 3.0;
        }));
        Self {
            heard,
            transmitters,
            random,
            map,
        }
    }

    /// A new robot somewhere in the hall, which does not know where.
    fn wake(&mut self) -> Walk {
        let robot = Robot::enrol(&mut self.map);
        let [x, y] = HALL_M.map(|size| size * (0.1 + 0.8 * self.random.uniform()));
        Walk {
            robot,
            at: Vector2::new(x, y),
            yaw_rad: std::f64::consts::TAU * self.random.uniform(),
        }
    }

    /// Goes a step, turns at walls, and listens.
    fn go(&mut self, walk: &mut Walk) -> Vec<EventKind> {
        let towards = |yaw_rad: f64| Vector2::new(yaw_rad.cos(), yaw_rad.sin());
        let mut turn_rad = 0.3 * self.random.normal();
        let is_inside = |at: &Vector2<f64>| (0..2).all(|k| at[k] > 0.0 && at[k] < HALL_M[k]);
        for _ in 0..8 {
            let next = walk.at + STEP_M * towards(walk.yaw_rad + turn_rad);
            if is_inside(&next) {
                break;
            }
            turn_rad += 0.8;
        }
        walk.yaw_rad += turn_rad;
        walk.at += STEP_M * towards(walk.yaw_rad);
        let map = &mut self.map;
        walk.robot.go(map, [0.0; 3], [0.0, 0.0, turn_rad]);
        let length_m = STEP_M * (1.0 + 0.03 * self.random.normal());
        walk.robot.go(map, [length_m, 0.0, 0.0], [0.0; 3]);
        let view = self.view(&walk.at);
        walk.robot.sample(&mut self.map, descriptor("wifi", &view))
    }

    fn view(&mut self, at: &Vector2<f64>) -> Vec<f32> {
        let at = match self.heard {
            Heard::Halves => Vector2::new(at.x % (0.5 * HALL_M[0]), at.y),
            _ => *at,
        };
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a strength of at most a few"
        )]
        let strength = |from: &Vector2<f64>| {
            let loss = (0.3 * self.random.normal()).exp();
            let strength = match self.heard {
                Heard::Noise => self.random.normal(),
                _ => (-(from - at).norm() / REACH_M).exp() * loss,
            };
            strength as f32
        };
        let mut view: Vec<f32> = self.transmitters.iter().map(strength).collect();
        let length = view.iter().map(|x| x * x).sum::<f32>().sqrt();
        for number in &mut view {
            *number /= length;
        }
        view
    }

    /// Lets robots wake up; answers the errors of the first claims \[m\].
    fn first_claims(&mut self, robots: usize) -> Vec<f64> {
        let mut errors = Vec::new();
        for _ in 0..robots {
            let mut walk = self.wake();
            for _ in 0..VIEWS {
                let events = self.go(&mut walk);
                let placed = events.iter().find_map(|event| match event {
                    EventKind::AgentPlaced { position } => Some(*position),
                    _ => None,
                });
                if let Some(position) = placed {
                    errors.push((position.coords.xy() - walk.at).norm());
                    break;
                }
            }
        }
        errors
    }
}

/// They are found to a few metres, hardly any in a wrong place; a restart in the middle changes
/// nothing.
#[test]
fn robots_that_wake_up_in_a_large_hall_are_found() {
    let mut world = World::new(Heard::Hall);
    let pages: Vec<_> = world.map.checkpoint(0).collect();
    let mut again = CognitiveMap::restore(world.map.settings().clone(), pages).unwrap();
    assert_eq!(again.digest(), world.map.digest());
    let random = world.random.clone();
    let errors = world.first_claims(10);
    let wrong = errors.iter().filter(|error| **error > 15.0).count();
    assert!(errors.len() >= 7 && wrong <= 1, "{errors:?}");
    // Halfway through the search of another robot.
    (world.random, again) = (random, again);
    std::mem::swap(&mut world.map, &mut again);
    assert_eq!(world.first_claims(10), errors);
    assert_eq!(world.map.digest(), again.digest());
    let mut walk = world.wake();
    for _ in 0..3 {
        world.go(&mut walk);
    }
    let pages: Vec<_> = world.map.checkpoint(0).collect();
    let restored = CognitiveMap::restore(world.map.settings().clone(), pages).unwrap();
    let mut twin = World {
        heard: world.heard,
        transmitters: world.transmitters.clone(),
        random: world.random.clone(),
        map: restored,
    };
    let mut double = Walk {
        robot: Robot { ..walk.robot },
        ..walk
    };
    for _ in 0..6 {
        assert_eq!(world.go(&mut walk), twin.go(&mut double));
    }
    assert_eq!(world.map.digest(), twin.map.digest());
}

/// One robot shows how often a claim is right, and so does a team that goes about at once.
#[test]
fn robots_are_found_in_a_hall_that_one_explored_or_a_team_at_once() {
    for robots in [1, 6] {
        let errors = World::explored_by(robots).first_claims(10);
        let wrong = errors.iter().filter(|error| **error > 15.0).count();
        assert!(errors.len() >= 7 && wrong <= 1, "{robots}: {errors:?}");
    }
}

/// What is heard here is heard in the other half as well.
#[test]
fn where_two_halves_sound_alike_nobody_is_placed() {
    let mut world = World::new(Heard::Halves);
    let errors = world.first_claims(8);
    assert!(errors.len() <= 1, "{errors:?}");
}

/// Views that say nothing place nobody, and take little memory.
#[test]
fn noise_places_nobody() {
    let mut world = World::new(Heard::Noise);
    assert_eq!(world.first_claims(4), [] as [f64; 0]);
}
