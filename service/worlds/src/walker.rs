//! A persistent random walk between the cubes.

use cognitive_map::Motion;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, UnitVector3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::obstacle::ObstacleWorld;
use super::steering::{turn_towards, way_out};

/// Length of a step \[m\].
pub const STEP_M: f64 = 0.1;
/// Radius of the ball that is the robot's body \[m\].
pub const BODY_RADIUS_M: f64 = 0.15;
/// Largest turn of a step \[rad\]: a circle of 0.33 m radius.
const TURN_RAD_MAX: f64 = 0.3;
/// Standard deviation of the turn of a step about each of the body's y and z axes \[rad\].
const TURN_SD_RAD: f64 = 0.06;
/// Correlation of a step's turn with that of the step before.
const PERSISTENCE: f64 = 0.9;
/// How far ahead the way must be free for the walk to go on as it likes \[m\].
const LOOK_AHEAD_M: f64 = 0.8;
/// How much nearer to an obstacle than its chord the arc of a step may come: at most
/// `STEP_M · TURN_RAD_MAX / 8` = 3.75 mm \[m\].
const ARC_BULGE_M: f64 = 0.004;
/// What a step must leave free beyond its end, lest rounding puts the body into a cube \[m\].
const ROUNDING_M: f64 = 1e-9;
/// Positions that are tried before a start is given up.
const START_TRIALS: u32 = 1000;

/// One step in the body frame: a screw motion `exp(translation, rotation)`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Along the body's axes at the start of the step: `[STEP_M, 0, 0]`, or nothing for a turn on
    /// the spot \[m\].
    pub translation_m: Vector3<f64>,
    /// About the body's y and z axes \[rad\]. There is no roll of its own.
    pub rotation_rad: Vector3<f64>,
}

/// A robot that walks.
///
/// Turns follow `ω ← ρ ω + √(1 − ρ²) σ n`, with `n` standard normal. When the way ahead is blocked
/// within 0.8 m, the robot instead turns to a free side as sharply as it can (0.3 rad a step), and
/// where even the next step would touch something, it turns on the spot.
#[derive(Clone, Debug)]
pub struct Walker {
    pose: Isometry3<f64>,
    turn_rad: Vector3<f64>,
    random: ChaCha8Rng,
}

impl Walker {
    /// A walker at a position, looking in a random direction. `None` where its body does not fit.
    pub fn new(
        world: &ObstacleWorld,
        position_m: Vector3<f64>,
        mut random: ChaCha8Rng,
    ) -> Option<Self> {
        if !world.is_free(&position_m, BODY_RADIUS_M + ARC_BULGE_M) {
            return None;
        }
        let heading = random.random_range(-std::f64::consts::PI..std::f64::consts::PI);
        let rotation = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
        let pose = Isometry3::from_parts(Translation3::from(position_m), rotation);
        Some(Self {
            pose,
            turn_rad: Vector3::zeros(),
            random,
        })
    }

    /// A walker at a random free position at least `apart_m` from every one of `others_m`; `None`
    /// when none was found.
    pub fn at_random(
        world: &ObstacleWorld,
        others_m: &[Vector3<f64>],
        apart_m: f64,
        mut random: ChaCha8Rng,
    ) -> Option<Self> {
        for _ in 0..START_TRIALS {
            let position = Vector3::from_fn(|_, _| random.random_range(0.0..world.side_m()));
            if others_m
                .iter()
                .all(|other| (other - position).norm() >= apart_m)
                && let Some(walker) = Self::new(world, position, random.clone())
            {
                return Some(walker);
            }
        }
        None
    }

    /// The true pose in the room.
    pub fn pose(&self) -> &Isometry3<f64> {
        &self.pose
    }

    /// Makes one step and says which.
    pub fn step(&mut self, world: &ObstacleWorld) -> Step {
        self.turn_rad = self.wander();
        let clearance_m = BODY_RADIUS_M + ARC_BULGE_M;
        let position = self.pose.translation.vector;
        let ahead = self.direction_after(&self.turn_rad);
        if world.free_distance_m(&position, &ahead, clearance_m, LOOK_AHEAD_M) < LOOK_AHEAD_M {
            let out = way_out(world, &position, &ahead, clearance_m);
            self.turn_rad = turn_towards(&self.pose.rotation, &out, TURN_RAD_MAX);
        }
        let forward = Step {
            translation_m: Vector3::x() * STEP_M,
            rotation_rad: self.turn_rad,
        };
        let increment = screw(&forward);
        let chord = self.pose.rotation * increment.translation.vector;
        let (towards, length) = UnitVector3::new_and_get(chord);
        let free_m = world.free_distance_m(&position, &towards, clearance_m, LOOK_AHEAD_M);
        let step = if free_m >= length + ROUNDING_M {
            forward
        } else {
            Step {
                translation_m: Vector3::zeros(),
                rotation_rad: self.turn_rad,
            }
        };
        self.pose *= screw(&step);
        self.pose.rotation.renormalize();
        step
    }

    /// The next turn of the free walk \[rad\].
    fn wander(&mut self) -> Vector3<f64> {
        let fresh = (1.0 - PERSISTENCE * PERSISTENCE).sqrt() * TURN_SD_RAD;
        let mut turn = self.turn_rad * PERSISTENCE;
        turn.y += fresh * self.random.sample::<f64, _>(StandardNormal);
        turn.z += fresh * self.random.sample::<f64, _>(StandardNormal);
        turn.cap_magnitude(TURN_RAD_MAX)
    }

    /// Where the body's x axis points after a turn, in the room.
    fn direction_after(&self, turn_rad: &Vector3<f64>) -> UnitVector3<f64> {
        let rotation = self.pose.rotation * UnitQuaternion::from_scaled_axis(*turn_rad);
        rotation * Vector3::x_axis()
    }
}

/// The pose at the end of a step relative to its start.
pub(super) fn screw(step: &Step) -> Isometry3<f64> {
    let (linear, angular) = (step.translation_m.into(), step.rotation_rad.into());
    *Motion::from_velocity(linear, angular, 1.0, None)
        .expect("a step of 0.1 m and 0.3 rad is within every limit")
        .increment()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    fn walker(world: &ObstacleWorld, seed: u64) -> Walker {
        Walker::new(world, world.centre_m(), ChaCha8Rng::seed_from_u64(seed)).unwrap()
    }

    fn walks_without_touching(seed: u64, n_steps: u32) {
        let world = ObstacleWorld::new(seed);
        let mut walker = walker(&world, seed + 100);
        let (mut n_on_the_spot, mut in_a_row) = (0, 0);
        for _ in 0..n_steps {
            let before = walker.pose.translation.vector;
            let step = walker.step(&world);
            let after = walker.pose.translation.vector;
            assert!(world.is_free(&after, BODY_RADIUS_M), "seed {seed}: {after}");
            let middle = (before + after) / 2.0;
            assert!(world.is_free(&middle, BODY_RADIUS_M - ARC_BULGE_M));
            assert!(step.rotation_rad.norm() <= TURN_RAD_MAX + 1e-12);
            if step.translation_m.x == 0.0 {
                n_on_the_spot += 1;
                in_a_row += 1;
            } else {
                in_a_row = 0;
                assert!((step.translation_m.x - STEP_M).abs() < 1e-15);
            }
            assert!(in_a_row <= 20, "seed {seed}: stuck at {after}");
        }
        assert!(
            n_on_the_spot <= n_steps / 20,
            "seed {seed}: {n_on_the_spot} on the spot"
        );
    }

    #[test]
    fn a_long_walk_never_touches_anything() {
        walks_without_touching(0, 100_000);
    }

    #[test]
    fn many_walks_never_touch_anything() {
        for seed in 1..=40 {
            walks_without_touching(seed, 2500);
        }
    }

    #[test]
    fn a_walk_covers_the_room_and_turns_either_way() {
        let world = ObstacleWorld::new(1);
        let mut walker = walker(&world, 1);
        let mut visited = std::collections::BTreeSet::new();
        let (mut n_left, mut n_up) = (0, 0);
        for _ in 0..50_000 {
            let step = walker.step(&world);
            n_left += i32::from(step.rotation_rad.z > 0.0);
            n_up += i32::from(step.rotation_rad.y < 0.0);
            let cell = (walker.pose.translation.vector / 3.0).map(f64::floor);
            visited.insert(format!("{cell}"));
        }
        assert!(
            visited.len() >= 115,
            "{} of 125 cells of 3 m were visited",
            visited.len()
        );
        assert!((20_000..30_000).contains(&n_left), "{n_left}");
        assert!((20_000..30_000).contains(&n_up), "{n_up}");
    }

    #[test]
    fn one_seed_one_walk() {
        let world = ObstacleWorld::new(7);
        let (mut a, mut b, mut c) = (walker(&world, 1), walker(&world, 1), walker(&world, 2));
        for _ in 0..1000 {
            assert_eq!(a.step(&world), b.step(&world));
            c.step(&world);
        }
        assert_eq!(a.pose(), b.pose());
        assert_ne!(a.pose(), c.pose());
    }

    #[test]
    fn no_start_inside_a_cube_or_near_another_robot() {
        let world = ObstacleWorld::new(2);
        let random = ChaCha8Rng::seed_from_u64(2);
        let inside = world.cubes()[0].centre_m;
        assert!(Walker::new(&world, inside, random.clone()).is_none());
        let centre = world.centre_m();
        let apart = Walker::at_random(&world, &[centre], 6.0, random.clone()).unwrap();
        assert!((apart.pose().translation.vector - centre).norm() >= 6.0);
        assert!(Walker::at_random(&world, &[centre], 15.0, random).is_none());
    }
}
