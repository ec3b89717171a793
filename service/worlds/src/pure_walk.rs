//! A pure random walk: every step in a direction of its own.

use nalgebra::{Isometry3, UnitVector3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::obstacle::ObstacleWorld;
use super::walker::{BODY_RADIUS_M, STEP_M, Step};

/// Directions that are tried before a step is left out. In the corner of a room an eighth of all
/// directions is free, so that one step in 5000 is.
const TRIALS: u32 = 64;
/// What a step must leave free beyond its end, lest rounding puts the body into a cube \[m\].
const ROUNDING_M: f64 = 1e-9;

/// A body that steps 0.1 m in a direction drawn evenly over the sphere, each time anew.
///
/// It never turns: its axes stay those of the room, as those of a drone that slides to any side. A
/// direction that is blocked is drawn again.
#[derive(Clone, Debug)]
pub struct PureWalker {
    position_m: Vector3<f64>,
    random: ChaCha8Rng,
}

impl PureWalker {
    /// A walker at a position. `None` where its body does not fit.
    pub fn new(
        world: &ObstacleWorld,
        position_m: Vector3<f64>,
        random: ChaCha8Rng,
    ) -> Option<Self> {
        world
            .is_free(&position_m, BODY_RADIUS_M)
            .then_some(Self { position_m, random })
    }

    /// The true pose in the room.
    pub fn pose(&self) -> Isometry3<f64> {
        Isometry3::translation(self.position_m.x, self.position_m.y, self.position_m.z)
    }

    /// Makes one step and says which; a step of no length where no direction was found free.
    pub fn step(&mut self, world: &ObstacleWorld) -> Step {
        let found = (0..TRIALS).find_map(|_| self.free_direction(world));
        let translation_m = found.map_or(Vector3::zeros(), |way| way.into_inner() * STEP_M);
        self.position_m += translation_m;
        Step {
            translation_m,
            rotation_rad: Vector3::zeros(),
        }
    }

    /// A random direction, if the next step may go there.
    fn free_direction(&mut self, world: &ObstacleWorld) -> Option<UnitVector3<f64>> {
        // Three independent normal numbers have no preferred direction.
        let drawn = Vector3::from_fn(|_, _| self.random.sample::<f64, _>(StandardNormal));
        let way = UnitVector3::try_new(drawn, 1e-9)?;
        let reach_m = STEP_M + ROUNDING_M;
        let free_m = world.free_distance_m(&self.position_m, &way, BODY_RADIUS_M, reach_m);
        (free_m >= reach_m).then_some(way)
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    fn walker(world: &ObstacleWorld, seed: u64) -> PureWalker {
        let random = ChaCha8Rng::seed_from_u64(seed);
        PureWalker::new(world, world.centre_m(), random).unwrap()
    }

    #[test]
    fn walls_and_cubes_are_never_touched() {
        // A room of 2 m, so that the walk is at a wall most of the time, and one with cubes.
        for world in [ObstacleWorld::empty(2.0), ObstacleWorld::new(3)] {
            let mut walker = walker(&world, 1);
            let mut n_left_out = 0;
            for _ in 0..50_000 {
                let before = walker.position_m;
                let step = walker.step(&world);
                let length = step.translation_m.norm();
                n_left_out += i32::from(length == 0.0);
                assert!(length == 0.0 || (length - STEP_M).abs() < 1e-15);
                for share in [0.25, 0.5, 0.75, 1.0] {
                    let between = before + step.translation_m * share;
                    assert!(world.is_free(&between, BODY_RADIUS_M), "{between}");
                }
            }
            assert!(n_left_out < 50, "{n_left_out} steps were left out");
        }
    }

    #[test]
    fn in_the_open_the_distance_grows_with_the_root_of_the_steps() {
        // E ‖x‖² = n · STEP_M², and ‖x‖² of a 3-D Gaussian deviates by √(2/3) of its mean.
        let world = ObstacleWorld::empty(1e4);
        let (n_walks, n_steps) = (600, 100);
        let mut sum_m2 = 0.0;
        for seed in 0..n_walks {
            let mut walker = walker(&world, seed);
            for _ in 0..n_steps {
                walker.step(&world);
            }
            sum_m2 += (walker.position_m - world.centre_m()).norm_squared();
        }
        let mean_m2 = sum_m2 / n_walks as f64;
        let expected_m2 = f64::from(n_steps) * STEP_M * STEP_M;
        let tolerance = 5.0 * (2.0_f64 / 3.0 / n_walks as f64).sqrt();
        assert!((mean_m2 / expected_m2 - 1.0).abs() < tolerance, "{mean_m2}");
    }

    #[test]
    fn one_seed_one_walk() {
        let world = ObstacleWorld::new(7);
        let (mut a, mut b, mut c) = (walker(&world, 1), walker(&world, 1), walker(&world, 2));
        for _ in 0..100 {
            assert_eq!(a.step(&world), b.step(&world));
            c.step(&world);
        }
        assert_eq!(a.position_m, b.position_m);
        assert_ne!(a.position_m, c.position_m);
    }
}
