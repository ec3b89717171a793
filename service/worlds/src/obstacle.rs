//! Cubes in a room, what is free between them, and what can be seen past them.

use nalgebra::{Unit, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Edge of the cubic room with obstacles, which spans `[0, SIDE_M]` on each axis \[m\].
pub const SIDE_M: f64 = 15.0;
/// Number of cubes (seed paper, Section 4.2).
const N_CUBES: usize = 50;
/// Shortest and longest edge of a cube \[m\]; the paper gives none.
const EDGE_M: std::ops::RangeInclusive<f64> = 0.5..=2.0;
/// Room around the centre that is kept free for the first robot \[m\].
const CENTRE_CLEARANCE_M: f64 = 1.0;
/// Number of beacons.
const N_BEACONS: usize = 16;
/// Shortest stretch inside a cube that hides what lies behind \[m\]: rounding must not let a cube
/// hide a beacon on its own corner.
const HIDING_M: f64 = 1e-9;

/// An axis-aligned cube.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cube {
    /// Its centre \[m\].
    pub centre_m: Vector3<f64>,
    /// Its edge \[m\].
    pub edge_m: f64,
}

impl Cube {
    /// Whether a position lies in the interior of the cube grown by `margin_m` on every side.
    pub fn contains(&self, position_m: &Vector3<f64>, margin_m: f64) -> bool {
        (position_m - self.centre_m).amax() < self.edge_m / 2.0 + margin_m
    }

    /// The stretch of the line `origin + t · direction` inside the cube grown by `margin_m`, as
    /// the first and last `t`; `None` where the line stays out of the interior.
    fn crossing(
        &self,
        origin_m: &Vector3<f64>,
        direction: &Vector3<f64>,
        margin_m: f64,
    ) -> Option<(f64, f64)> {
        let half = self.edge_m / 2.0 + margin_m;
        let (mut first, mut last) = (f64::NEG_INFINITY, f64::INFINITY);
        for axis in 0..3 {
            let offset = self.centre_m[axis] - origin_m[axis];
            if direction[axis] == 0.0 {
                if offset.abs() >= half {
                    return None;
                }
                continue;
            }
            let a = (offset - half) / direction[axis];
            let b = (offset + half) / direction[axis];
            first = first.max(a.min(b));
            last = last.min(a.max(b));
        }
        (first < last).then_some((first, last))
    }
}

/// A landmark that never moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Beacon {
    /// Its label, `beacon-01` and so on.
    pub label: String,
    /// Where it is \[m\].
    pub position_m: Vector3<f64>,
}

/// A cubic room with its cubes and beacons.
#[derive(Clone, Debug, PartialEq)]
pub struct ObstacleWorld {
    side_m: f64,
    cubes: Vec<Cube>,
    beacons: Vec<Beacon>,
}

impl ObstacleWorld {
    /// The world of a seed. Equal seeds give equal worlds.
    pub fn new(seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let centre = Vector3::repeat(SIDE_M / 2.0);
        let mut cubes = Vec::with_capacity(N_CUBES);
        while cubes.len() < N_CUBES {
            let edge_m = random.random_range(EDGE_M);
            let span = edge_m / 2.0..=SIDE_M - edge_m / 2.0;
            let centre_m = Vector3::from_fn(|_, _| random.random_range(span.clone()));
            let cube = Cube { centre_m, edge_m };
            if !cube.contains(&centre, CENTRE_CLEARANCE_M) {
                cubes.push(cube);
            }
        }
        let mut beacons = Vec::with_capacity(N_BEACONS);
        while beacons.len() < N_BEACONS {
            let cube = cubes[random.random_range(0..cubes.len())];
            let half = cube.edge_m / 2.0;
            let sign = |_, _| if random.random::<bool>() { half } else { -half };
            let position_m = cube.centre_m + Vector3::from_fn(sign);
            // A corner buried in another cube is never seen.
            let buried = cubes
                .iter()
                .any(|cube| cube.contains(&position_m, -HIDING_M));
            let taken = beacons
                .iter()
                .any(|beacon: &Beacon| beacon.position_m == position_m);
            if !buried && !taken {
                beacons.push(Beacon {
                    label: format!("beacon-{:02}", beacons.len() + 1),
                    position_m,
                });
            }
        }
        Self {
            side_m: SIDE_M,
            cubes,
            beacons,
        }
    }

    /// A room that spans `[0, side_m]` on each axis and holds nothing (seed paper, Section 4.1).
    pub fn empty(side_m: f64) -> Self {
        Self {
            side_m,
            cubes: Vec::new(),
            beacons: Vec::new(),
        }
    }

    /// Edge of the room \[m\].
    pub fn side_m(&self) -> f64 {
        self.side_m
    }

    /// The centre of the room \[m\].
    pub fn centre_m(&self) -> Vector3<f64> {
        Vector3::repeat(self.side_m / 2.0)
    }

    /// The cubes.
    pub fn cubes(&self) -> &[Cube] {
        &self.cubes
    }

    /// The beacons, by label.
    pub fn beacons(&self) -> &[Beacon] {
        &self.beacons
    }

    /// Whether a body which reaches `clearance_m` to every side fits at a position.
    pub fn is_free(&self, position_m: &Vector3<f64>, clearance_m: f64) -> bool {
        let inside = clearance_m..=self.side_m - clearance_m;
        position_m.iter().all(|x| inside.contains(x))
            && !self
                .cubes
                .iter()
                .any(|cube| cube.contains(position_m, clearance_m))
    }

    /// How far a body can go straight from a free position, at most `limit_m` \[m\]; zero from a
    /// position that is not free. A short limit is quick: cubes beyond it are not looked at.
    pub fn free_distance_m(
        &self,
        origin_m: &Vector3<f64>,
        direction: &Unit<Vector3<f64>>,
        clearance_m: f64,
        limit_m: f64,
    ) -> f64 {
        if !self.is_free(origin_m, clearance_m) {
            return 0.0;
        }
        // Along a wall the body never reaches it.
        let to_walls = (0..3).filter(|&axis| direction[axis] != 0.0).map(|axis| {
            let wall = if direction[axis] > 0.0 {
                self.side_m - clearance_m
            } else {
                clearance_m
            };
            (wall - origin_m[axis]) / direction[axis]
        });
        let reach_m = clearance_m + limit_m;
        let near = self
            .cubes
            .iter()
            .filter(|cube| cube.contains(origin_m, reach_m));
        let to_cubes = near.filter_map(|cube| {
            let (first, last) = cube.crossing(origin_m, direction, clearance_m)?;
            (last > 0.0).then_some(first.max(0.0))
        });
        to_walls.chain(to_cubes).fold(limit_m, f64::min).max(0.0)
    }

    /// Whether no cube stands between two positions. A line along a cube's face is not hidden.
    pub fn sees(&self, from_m: &Vector3<f64>, to_m: &Vector3<f64>) -> bool {
        let line = to_m - from_m;
        let length = line.norm();
        !self.cubes.iter().any(|cube| {
            cube.crossing(from_m, &line, 0.0)
                .is_some_and(|(first, last)| (last.min(1.0) - first.max(0.0)) * length > HIDING_M)
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn worlds_are_as_described_and_differ_by_seed() {
        for seed in 0..50 {
            let world = ObstacleWorld::new(seed);
            assert_eq!(world, ObstacleWorld::new(seed));
            assert_ne!(world, ObstacleWorld::new(seed + 1));
            assert_eq!(world.cubes().len(), 50);
            assert!(world.is_free(&world.centre_m(), CENTRE_CLEARANCE_M));
            for cube in world.cubes() {
                assert!(EDGE_M.contains(&cube.edge_m));
                let reach = (cube.centre_m - world.centre_m()).amax() + cube.edge_m / 2.0;
                assert!(reach <= SIDE_M / 2.0 + 1e-12);
            }
            for beacon in world.beacons() {
                let on_corner = world.cubes().iter().any(|cube| {
                    let offset = (beacon.position_m - cube.centre_m).abs();
                    offset.iter().all(|x| (x - cube.edge_m / 2.0).abs() < 1e-12)
                });
                assert!(on_corner, "{beacon:?}");
            }
        }
    }

    #[test]
    fn a_beacon_is_seen_from_outside_its_cube_only() {
        let cube = Cube {
            centre_m: Vector3::repeat(5.0),
            edge_m: 2.0,
        };
        let world = ObstacleWorld {
            side_m: SIDE_M,
            cubes: vec![cube],
            beacons: Vec::new(),
        };
        let corner = Vector3::repeat(6.0);
        assert!(world.sees(&Vector3::new(8.0, 7.0, 9.0), &corner));
        assert!(!world.sees(&Vector3::new(2.0, 3.0, 1.0), &corner));
        // Along an edge and along a face nothing is hidden.
        assert!(world.sees(&Vector3::new(0.0, 6.0, 6.0), &corner));
        assert!(world.sees(&Vector3::new(3.0, 4.0, 6.0), &corner));
        assert!(!world.sees(&Vector3::new(3.0, 5.0, 5.0), &Vector3::new(7.0, 5.0, 5.0)));
        assert!(world.sees(&corner, &corner));
    }

    fn position() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(0.0..SIDE_M).prop_map(Vector3::from)
    }

    proptest! {
        /// The independent oracle: walk along the line and ask every point.
        #[test]
        fn sight_agrees_with_sampling(seed in 0..20_u64, (a, b) in (position(), position())) {
            let world = ObstacleWorld::new(seed);
            let samples = (0..=1000).map(|k| a + (b - a) * (f64::from(k) / 1000.0));
            let deep = samples.clone().any(|p| world.cubes().iter().any(|c| c.contains(&p, 0.0)));
            // Sampling may miss a grazed edge, so it decides only beyond a margin of its step.
            let is_in_cube = |p| world.cubes().iter().any(|c| c.contains(&p, 0.03));
            let near = samples.into_iter().any(is_in_cube);
            let sees = world.sees(&a, &b);
            prop_assert!(!deep || !sees);
            prop_assert!(near || sees);
            prop_assert_eq!(sees, world.sees(&b, &a));
        }

        #[test]
        fn free_distance_agrees_with_sampling(
            seed in 0..20_u64,
            origin in position(),
            direction in prop::array::uniform3(-1.0..1.0_f64),
            clearance in 0.0..0.3_f64,
            limit in 0.0..30.0_f64,
        ) {
            let world = ObstacleWorld::new(seed);
            let Some(direction) = Unit::try_new(Vector3::from(direction), 1e-3) else {
                return Ok(());
            };
            let free = world.free_distance_m(&origin, &direction, clearance, limit);
            let at = |distance: f64| origin + direction.into_inner() * distance;
            if world.is_free(&origin, clearance) {
                for k in 0..500 {
                    let distance = free * (f64::from(k) / 500.0);
                    prop_assert!(world.is_free(&at(distance), clearance - 1e-9));
                }
                prop_assert!(free >= limit || !world.is_free(&at(free + 1e-9), clearance + 1e-6));
                prop_assert!(free <= limit);
            } else {
                prop_assert!(free <= 0.0);
            }
        }

        #[test]
        fn along_an_axis_sight_and_distance_hold(
            seed in 0..20_u64,
            origin in position(),
            axis in 0..3_usize,
        ) {
            let world = ObstacleWorld::new(seed);
            let mut direction = Vector3::zeros();
            direction[axis] = -1.0;
            let free = world.free_distance_m(&origin, &Unit::new_unchecked(direction), 0.0, 99.0);
            if world.is_free(&origin, 0.0) {
                prop_assert!(world.sees(&origin, &(origin + direction * (free - 1e-6))));
                prop_assert!(!world.is_free(&(origin + direction * (free + 1e-6)), 1e-5));
            }
        }
    }
}
