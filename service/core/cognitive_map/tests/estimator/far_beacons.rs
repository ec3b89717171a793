//! A robot in a yard that measures distances of beacons far away, on wheels that may be better than
//! is assumed.

use cognitive_map::estimator::{Estimator, Parameters};
use cognitive_map::{Label, Motion, PoseNoise, Range, Relation, StartPose};
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};

use random::Seeded;

/// Length and width of the yard \[m\].
const SIDE_M: f64 = 80.0;
const BEACONS: [[f64; 3]; 4] = [
    [-5.0, -8.0, 0.0],
    [90.0, 5.0, 0.0],
    [70.0, 88.0, 0.0],
    [-10.0, 75.0, 0.0],
];
const RANGE_SD_M: f64 = 0.3;
const STEP_S: f64 = 0.1;
const STEP_M: f64 = 0.1;
/// Steps from one distance to the next, of another beacon.
const STEPS_PER_RANGE: i64 = 4;
const STEPS: i64 = 6000;
/// Steps from which on errors count.
const STEPS_TO_LEARN: i64 = 3000;
const SEEDS: u32 = 20;

/// Wheels and whether they state their noise.
#[derive(Clone, Copy)]
struct Wheels {
    /// Their noise, in the deviations that the settings assume.
    noise: f64,
    states_noise: bool,
}

/// What became of some drives.
#[derive(Default)]
struct Drives {
    /// Beacons that were found.
    found: usize,
    /// Mean squared errors of the position as estimated and of dead reckoning \[m²\].
    squared_m2: f64,
    reckoned_m2: f64,
    /// Mean normalised squared error of the pose; one is honest.
    nees: f64,
}

/// A robot on its way, as it is and as it thinks.
struct Robot {
    wheels: Wheels,
    random: Seeded,
    estimator: Estimator,
    agent: u32,
    truth: Isometry3<f64>,
    reckoned: Isometry3<f64>,
    goal: Point3<f64>,
}

impl Wheels {
    /// All seeds.
    fn drives(self) -> Drives {
        let mut drives = Drives::default();
        for seed in 1..=SEEDS {
            let mut robot = Robot::new(self, seed);
            let mut beacons = (0..BEACONS.len()).cycle();
            for step in 1..STEPS {
                let stamp_ns = step * 100_000_000;
                robot.step(stamp_ns);
                if step % STEPS_PER_RANGE == 0 {
                    robot.measure(stamp_ns, beacons.next().unwrap());
                }
                if step >= STEPS_TO_LEARN && step % 10 == 0 {
                    robot.score(&mut drives);
                }
            }
            drives.found += robot.estimator.landmarks().count();
        }
        let scored = f64::from(SEEDS) * ((STEPS - STEPS_TO_LEARN) / 10) as f64;
        drives.squared_m2 /= scored;
        drives.reckoned_m2 /= scored;
        drives.nees /= scored;
        drives
    }
}

impl Robot {
    fn new(wheels: Wheels, seed: u32) -> Self {
        let mut random = Seeded(seed.into());
        let start = goal(&mut random);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * random.normal());
        let truth = Isometry3::from_parts(Translation3::from(start), turn);
        let mut estimator = Estimator::new(Parameters::default());
        let agent = estimator.enrol();
        let at = (truth.translation.vector.into(), turn.coords.into());
        let start = StartPose::new(at.0, at.1, PoseNoise::none()).unwrap();
        estimator.start_pose(agent, &start, &mut Vec::new());
        let goal = goal(&mut random);
        Self {
            wheels,
            random,
            estimator,
            agent,
            truth,
            reckoned: truth,
            goal,
        }
    }

    /// A step towards the goal, as odometry reads it.
    fn step(&mut self, stamp_ns: i64) {
        while (self.truth.translation.vector - self.goal.coords).norm() < 3.0 {
            self.goal = goal(&mut self.random);
        }
        let ahead = self.truth.inverse_transform_point(&self.goal);
        let turn_rad = STEP_S * ahead.y.atan2(ahead.x).clamp(-0.5, 0.5);
        self.truth *= Isometry3::new(Vector3::x() * STEP_M, Vector3::z() * turn_rad);
        let assumed = Parameters::default();
        let sd_m = self.wheels.noise * assumed.translation_sd_per_sqrt_m * STEP_M.sqrt();
        let by_path = assumed.rotation_sd_per_sqrt_m.powi(2) * STEP_M;
        let by_turn = assumed.rotation_sd_per_sqrt_rad.powi(2) * turn_rad.abs();
        let sd_rad = self.wheels.noise * (by_path + by_turn).sqrt();
        let mut off = |sd: f64| sd * self.random.normal();
        let turn = Vector3::z() * (turn_rad + off(sd_rad));
        let read = Isometry3::new(Vector3::new(STEP_M + off(sd_m), off(sd_m), 0.0), turn);
        let noise = self
            .wheels
            .states_noise
            .then(|| PoseNoise::new([sd_m, sd_m, 0.0], [0.0, 0.0, sd_rad]).unwrap());
        let (by, turned) = (read.translation.vector, read.rotation.coords);
        let motion = Motion::from_increment(by.into(), turned.into(), noise).unwrap();
        self.reckoned *= read;
        self.estimator
            .motion(self.agent, stamp_ns, &motion, &mut Vec::new());
    }

    fn measure(&mut self, stamp_ns: i64, beacon: usize) {
        let apart = self
            .truth
            .inverse_transform_point(&Point3::from(BEACONS[beacon]));
        let range_m = apart.coords.norm() + RANGE_SD_M * self.random.normal();
        let range = Range::new(range_m, RANGE_SD_M, [0.0; 3]).unwrap();
        let label = Label::new(&format!("beacon-{beacon}")).unwrap();
        let relation = Relation::Range(range);
        self.estimator
            .landmark(self.agent, stamp_ns, &label, &relation, &mut Vec::new());
    }

    fn score(&self, drives: &mut Drives) {
        let (pose, covariance) = self.estimator.pose(self.agent).unwrap();
        let off = pose.inv_mul(&self.truth);
        let (at, turn) = (off.translation.vector, off.rotation.scaled_axis());
        let error = Vector3::new(at.x, at.y, turn.z);
        let planar: Matrix3<f64> = geometry::planar_part(covariance.matrix());
        drives.nees += error.dot(&(planar.try_inverse().unwrap() * error)) / 3.0;
        drives.squared_m2 += at.norm_squared();
        let reckoned = self.reckoned.translation.vector - self.truth.translation.vector;
        drives.reckoned_m2 += reckoned.norm_squared();
    }
}

/// Somewhere in the yard.
fn goal(random: &mut Seeded) -> Point3<f64> {
    let [x, y] = [(); 2].map(|()| SIDE_M * (0.05 + 0.9 * random.uniform()));
    Point3::new(x, y, 0.0)
}

/// In the noise that is assumed, a robot is lost before it has seen enough of a beacon to place it.
#[test]
fn wheels_better_than_assumed_find_far_beacons_as_if_they_had_said_so() {
    let all = BEACONS.len() * SEEDS as usize;
    for noise in [0.1, 0.3] {
        let [stated, unstated] = [true, false].map(|states_noise| {
            Wheels {
                noise,
                states_noise,
            }
            .drives()
        });
        assert!(10 * unstated.found > 9 * all, "{noise}: {}", unstated.found);
        assert!(
            unstated.squared_m2 < 2.0 * stated.squared_m2,
            "{noise}: {} m and {} m",
            unstated.squared_m2.sqrt(),
            stated.squared_m2.sqrt()
        );
        assert!(unstated.nees < 1.5, "{noise}: {}", unstated.nees);
    }
}

/// Some beacons are placed as if the wheels were better. They help, though more is promised than is
/// kept.
#[test]
fn wheels_as_assumed_are_not_misled_by_far_beacons() {
    let drives = Wheels {
        noise: 1.0,
        states_noise: false,
    }
    .drives();
    assert!(
        drives.squared_m2 < drives.reckoned_m2,
        "{} m and {} m",
        drives.squared_m2.sqrt(),
        drives.reckoned_m2.sqrt()
    );
    assert!(drives.nees < 6.0, "{}", drives.nees);
}
