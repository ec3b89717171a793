//! A robot in the plane, with odometry that errs and beacons on the ceiling.

use cogmap_proto::{Increment, MotionNoise, Relation, Sample, SampleBody, Sighting, Target};
use nalgebra::{Isometry2, Point2, Vector2};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::Floor;

/// Length of a step \[m\].
const STEP_M: f64 = 0.1;
/// Noise of a step: along each axis \[m\], and about the vertical \[rad\].
const NOISE: [f64; 2] = [0.005, 0.004];
/// Distance of neighbouring beacons, and of what is seen \[m\].
const BEACON_M: f64 = 2.0;
/// Standard deviation of a beacon's seen position along each axis \[m\].
const SEEN_SD_M: f64 = 0.05;
/// Steps between two sightings.
const LOOK_EVERY: u64 = 5;
/// Duration of a step \[ns\].
const TICK_NS: i64 = 100_000_000;

/// Stamp of its start \[ns\].
const START_NS: i64 = 1_800_000_000_000_000_000;

/// The robot.
#[derive(Debug)]
pub struct PlanarRobot {
    /// Where it truly is.
    pose: Isometry2<f64>,
    random: ChaCha8Rng,
    ticks: u64,
    stamp_ns: i64,
    started_at: Point2<f64>,
    /// Where it truly was after each step; none where nobody will ask.
    trail: Option<Vec<Point2<f64>>>,
    /// What it has sensed and nobody has taken.
    samples: Vec<Sample>,
}

impl PlanarRobot {
    /// A robot at a position.
    pub fn new(at: Point2<f64>, seed: u64) -> Self {
        Self {
            pose: Isometry2::translation(at.x, at.y),
            random: ChaCha8Rng::seed_from_u64(seed),
            ticks: 0,
            stamp_ns: START_NS,
            started_at: at,
            trail: Some(vec![at]),
            samples: Vec::new(),
        }
    }

    /// Where it is.
    pub fn position(&self) -> Point2<f64> {
        self.pose.translation.vector.into()
    }

    /// Where it truly started.
    pub fn started_at(&self) -> Point2<f64> {
        self.started_at
    }

    /// Keeps no trail from now on, so that its memory does not grow with its steps.
    pub fn forget_trail(&mut self) {
        self.trail = None;
    }

    /// Where it truly was at a stamp, as long as it keeps a trail.
    pub fn was_at(&self, stamp_ns: i64) -> Option<Point2<f64>> {
        let step = usize::try_from((stamp_ns - START_NS) / TICK_NS).ok()?;
        self.trail.as_ref()?.get(step).copied()
    }

    /// Which way it faces \[rad\].
    pub fn heading_rad(&self) -> f64 {
        self.pose.rotation.angle()
    }

    /// Number of steps so far.
    pub fn steps(&self) -> u64 {
        self.ticks
    }

    /// Takes what it has sensed.
    pub fn take(&mut self) -> Vec<Sample> {
        std::mem::take(&mut self.samples)
    }

    /// Whether its feelers touch nothing in a direction of its frame, up to a distance.
    pub fn feels_free(&self, floor: &Floor, heading_rad: f64, reach_m: f64) -> bool {
        let feeler = Point2::new(heading_rad.cos(), heading_rad.sin()) * reach_m;
        floor.is_free(&self.pose.transform_point(&feeler))
    }

    /// Stamp of its latest step \[ns\].
    pub fn stamp_ns(&self) -> i64 {
        self.stamp_ns
    }

    /// Turns and goes a step, as far as the floor is free; answers whether it got there.
    pub fn step(&mut self, floor: &Floor, turn_rad: f64, length_m: f64) -> bool {
        let length_m = length_m.min(STEP_M);
        let go = Isometry2::new(Vector2::zeros(), turn_rad) * Isometry2::translation(length_m, 0.0);
        let there = self.pose * go;
        let is_free = floor.is_free(&there.translation.vector.into());
        let go = if is_free {
            go
        } else {
            Isometry2::new(Vector2::zeros(), turn_rad)
        };
        self.pose *= go;
        let position = self.position();
        if let Some(trail) = &mut self.trail {
            trail.push(position);
        }
        self.ticks += 1;
        self.stamp_ns += TICK_NS;
        let [x, y, yaw] = [NOISE[0], NOISE[0], NOISE[1]].map(|sd| sd * self.normal());
        let half = 0.5 * (go.rotation.angle() + yaw);
        let body = SampleBody::Increment(Increment {
            translation_m: [go.translation.x + x, go.translation.y + y, 0.0],
            rotation_xyzw: [0.0, 0.0, half.sin(), half.cos()],
            noise: Some(MotionNoise {
                translation_sd_m: [NOISE[0], NOISE[0], 1e-6],
                rotation_sd_rad: [1e-6, 1e-6, NOISE[1]],
            }),
        });
        self.sense(body);
        if self.ticks.is_multiple_of(LOOK_EVERY) {
            self.look();
        }
        is_free
    }

    /// Sees the nearest beacon above.
    fn look(&mut self) {
        let at = self.position() / BEACON_M;
        let beacon = at.map(f64::round);
        let there = Point2::from(beacon * BEACON_M);
        let seen = self.pose.inverse_transform_point(&there);
        let [x, y] = [seen.x, seen.y].map(|x| x + SEEN_SD_M * self.normal());
        let sighting = Sighting {
            target: Target::Landmark(format!("beacon {} {}", beacon.x, beacon.y)),
            relation: Relation::Position {
                translation_m: [x, y, 0.0],
                sd_m: [SEEN_SD_M, SEEN_SD_M, 0.01],
            },
        };
        self.sense(SampleBody::Sighting(sighting));
    }

    fn sense(&mut self, body: SampleBody) {
        let stamp_ns = self.stamp_ns;
        self.samples.push(Sample { stamp_ns, body });
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.random)
    }
}
