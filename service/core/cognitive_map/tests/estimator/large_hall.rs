//! Halls with more landmarks than are estimated jointly.

use std::f64::consts::PI;

use cognitive_map::estimator::{Estimator, Parameters};
use cognitive_map::{Motion, RangeBearing, Relation};
use nalgebra::{Isometry3, Point3, Vector3};

use super::hall::{Hall, label, planar};
use random::Seeded;

/// A robot is put several metres aside, among landmarks that others saw long ago. Of two that it
/// sees at a time, four tell where it is.
#[test]
fn a_robot_that_is_carried_among_archived_landmarks_is_found_by_its_next_looks() {
    let carried = 600;
    let looks = (1..6).map(|seed| {
        let hall = Hall {
            seed,
            steps: carried + 40,
            half_m: 10.0,
            posts: 170,
            slip: Some((carried, planar(-6.0, 3.0, 2.0))),
            ..Hall::default()
        };
        let outcome = hall.run();
        let lost = outcome.errors_m[carried..].iter();
        let looks = lost.take_while(|errors| errors[1] > 0.4).count();
        assert!(outcome.rmse_m(1, carried + looks) < 0.3, "{seed}: it stays");
        for robot in [0, 2, 3] {
            assert!(outcome.rmse_m(robot, carried) < 0.15, "{seed}: {robot}");
        }
        looks
    });
    let mut looks: Vec<usize> = looks.collect();
    looks.sort_unstable();
    assert!(looks[2] <= 1 && looks[4] <= 4, "{looks:?}");
}

/// Posts along a way that leads into a ring, seen by one robot that drives into the ring and around
/// in it.
struct Ring {
    random: Seeded,
    posts: Vec<Point3<f64>>,
    truth: Isometry3<f64>,
    estimator: Estimator,
    agent: u32,
    steps: usize,
}

const WAY_M: f64 = 60.0;
const RADIUS_M: f64 = 12.0;
const STEP_M: f64 = 0.3;
/// Once around.
const STEPS_AROUND: usize = 251;
const RING_POSTS: usize = 150;

impl Ring {
    fn new(seed: u64) -> Self {
        let side = |number: usize| if number.is_multiple_of(2) { 1.5 } else { -1.5 };
        let along = (0..20).map(|k| Point3::new(3.0 * k as f64, side(k), 0.0));
        let around = (0..RING_POSTS).map(|k| {
            let angle = PI + 2.0 * PI * k as f64 / RING_POSTS as f64;
            let radius_m = RADIUS_M + side(k);
            let x = WAY_M + RADIUS_M + radius_m * angle.cos();
            Point3::new(x, radius_m * angle.sin(), 0.0)
        });
        let mut estimator = Estimator::new(Parameters::default());
        let agent = estimator.enrol();
        assert!(estimator.found(agent));
        Self {
            random: Seeded(seed),
            posts: along.chain(around).collect(),
            truth: Isometry3::identity(),
            estimator,
            agent,
            steps: 0,
        }
    }

    /// A step with a turn, and a look at two posts within 4 m.
    fn step(&mut self, turn: f64) {
        self.steps += 1;
        let stamp_ns = 500_000_000 * i64::try_from(self.steps).unwrap();
        let random = &mut self.random;
        self.truth *= planar(STEP_M, 0.0, turn);
        let read = planar(0.0, 0.0, turn + 0.01 * random.normal());
        let read_m = STEP_M * (1.0 + 0.05 * random.normal());
        let turned = read.rotation.coords.into();
        let motion = Motion::from_increment([read_m, 0.0, 0.0], turned, None).unwrap();
        let estimator = &mut self.estimator;
        estimator.motion(self.agent, stamp_ns, &motion, &mut Vec::new());
        let seen = |post: &Point3<f64>| self.truth.inverse_transform_point(post).coords;
        let near: Vec<usize> = (0..self.posts.len())
            .filter(|&number| (0.3..4.0).contains(&seen(&self.posts[number]).norm()))
            .collect();
        for turn in 0..near.len().min(2) {
            let number = near[(2 * self.steps + turn) % near.len()];
            let seen = seen(&self.posts[number]);
            let sd_m = 0.05 * seen.norm();
            let range_m = (seen.norm() + sd_m * random.normal()).max(0.01);
            let azimuth_rad = seen.y.atan2(seen.x) + 0.02 * random.normal();
            let seen = RangeBearing::new(range_m, azimuth_rad, 0.0, sd_m, 0.02).unwrap();
            let (label, relation) = (label(number), Relation::RangeBearing(seen));
            estimator.landmark(self.agent, stamp_ns, &label, &relation, &mut Vec::new());
        }
    }

    fn heading(&self) -> f64 {
        self.truth.rotation.euler_angles().2
    }

    fn drive_in(&mut self) {
        while self.truth.translation.vector.x < WAY_M {
            self.step(-0.2 * self.heading() - 0.05 * self.truth.translation.vector.y);
        }
    }

    fn drive_around(&mut self) {
        for _ in 0..STEPS_AROUND {
            let out = self.truth.translation.vector - Vector3::x() * (WAY_M + RADIUS_M);
            let along = out.y.atan2(out.x) + PI / 2.0 - 0.15 * (RADIUS_M - out.norm());
            let turn = (along - self.heading() + PI).rem_euclid(2.0 * PI) - PI;
            self.step(turn.clamp(-0.3, 0.3));
        }
    }

    /// Squared error of the position over what is expected of it.
    fn squared_error(&self) -> f64 {
        let pose = self.estimator.in_frame(self.agent).unwrap();
        let off = pose.translation.vector - self.truth.translation.vector;
        let covariance = self.estimator.covariance(self.agent).unwrap();
        let own = covariance.matrix().fixed_view::<2, 2>(0, 0).into_owned();
        let turn = pose.rotation.to_rotation_matrix().into_inner();
        let turn = turn.fixed_view::<2, 2>(0, 0).into_owned();
        let own = turn * own * turn.transpose();
        let off = off.xy();
        off.dot(&(own.try_inverse().unwrap() * off)) / 2.0
    }
}

const LAPS: usize = 5;

/// What the robot was off by when it came into the ring, everything in it shares. Its posts leave
/// the joint estimate and come back with every lap, and that error is not averaged away.
#[test]
#[allow(clippy::print_stdout, reason = "a figure of the documentation")]
fn laps_past_archived_landmarks_do_not_make_a_robot_sure() {
    let mut means = [0.0; LAPS + 1];
    for seed in 1..7 {
        let mut ring = Ring::new(seed);
        ring.drive_in();
        for mean in &mut means {
            *mean += ring.squared_error() / 6.0;
            ring.drive_around();
        }
    }
    println!("squared error over what is expected, before each lap: {means:.2?}");
    assert!((0.1..4.0).contains(&means[LAPS]));
}
