//! Walks through the room of the second experiment.

use cogmap_worlds::{ObstacleWorld, Odometer, OdometryNoise, PureWalker, Step, Walker};
use cognitive_map::estimator::{Estimator, Parameters};
use cognitive_map::{Label, PoseNoise, RangeBearing, Relation, Sample, SampleBody, StartPose};
use geometry::se3;
use nalgebra::{Isometry3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// Obstacles are sighted at every step whose number divides by this.
const EVERY: i64 = 5;
/// Standard deviation of a sighted distance, as a share of it.
const RANGE_SHARE: f64 = 0.05;
/// Steps after which the covariance is compared with the error.
const CONSISTENCY_STEPS: i64 = 50;
/// Steps of the early part, with which a whole walk is compared.
const EARLY_STEPS: i64 = 1000;

/// What is walked.
#[derive(Clone, Copy)]
pub(crate) struct Room {
    pub(crate) steps: i64,
    pub(crate) range_m: f64,
    /// Whether obstacles are sighted before the first step.
    pub(crate) looks_first: bool,
}

enum Body {
    Pure(PureWalker),
    Persistent(Walker),
}

impl Body {
    fn step(&mut self, world: &ObstacleWorld) -> Step {
        match self {
            Self::Pure(walker) => walker.step(world),
            Self::Persistent(walker) => walker.step(world),
        }
    }

    fn pose(&self) -> Isometry3<f64> {
        match self {
            Self::Pure(walker) => walker.pose(),
            Self::Persistent(walker) => *walker.pose(),
        }
    }
}

/// Errors of one walk.
#[derive(Default)]
struct Errors {
    rmse_m: f64,
    early_rmse_m: f64,
    nees: f64,
}

impl Room {
    /// Prints the errors of both kinds of walk; answers whether there were any.
    pub(crate) fn run(self, runs: u64) -> bool {
        for (name, is_persistent) in [("persistent", true), ("pure", false)] {
            let walked: Option<Vec<Errors>> = (1..=runs)
                .map(|seed| self.walk(seed, is_persistent))
                .collect();
            let Some(walked) = walked.filter(|walked| !walked.is_empty()) else {
                return false;
            };
            let sorted = |of: fn(&Errors) -> f64| {
                let mut values: Vec<f64> = walked.iter().map(of).collect();
                values.sort_by(f64::total_cmp);
                (
                    0.5 * (values[(values.len() - 1) / 2] + values[values.len() / 2]),
                    values[values.len() - 1],
                )
            };
            let (median_m, worst_m) = sorted(|errors| errors.rmse_m);
            let (growth, _) = sorted(|errors| errors.rmse_m / errors.early_rmse_m);
            let (nees, _) = sorted(|errors| errors.nees);
            println!(
                "{name}: median {median_m:.4} m, worst {worst_m:.4} m, {growth:.3} of the first {EARLY_STEPS} steps, nees {nees:.2}"
            );
        }
        true
    }

    fn walk(self, seed: u64, is_persistent: bool) -> Option<Errors> {
        let world = ObstacleWorld::new(seed);
        let stream = |number| {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            random.set_stream(number);
            random
        };
        let mut body = if is_persistent {
            Body::Persistent(Walker::new(&world, world.centre_m(), stream(1))?)
        } else {
            Body::Pure(PureWalker::new(&world, world.centre_m(), stream(1))?)
        };
        let noise = OdometryNoise {
            translation_share: 0.05,
            scale_bias: 0.01,
            rotation_sd_rad: 0.5_f64.to_radians(),
            gyro_bias_rad: 0.02_f64.to_radians(),
        };
        let mut odometer = Odometer::new(noise, stream(2)).ok()?;
        let mut eyes = stream(3);
        let mut estimator = Estimator::new(Parameters::default());
        let agent = estimator.enrol();
        let (shift, turn) = (body.pose().translation.vector, body.pose().rotation.coords);
        let start = StartPose::new(shift.into(), turn.into(), PoseNoise::none()).ok()?;
        estimator.start_pose(agent, &start, &mut Vec::new());
        let (mut errors, mut compared) = (Errors::default(), 0.0);
        for step in 0..=self.steps {
            let stamp_ns = step * 100_000_000;
            if step > 0 {
                let reading = odometer.read(&body.step(&world), stamp_ns, 0.1);
                if let SampleBody::Motion(motion) = Sample::try_from(&reading).ok()?.body {
                    estimator.motion(agent, stamp_ns, &motion, &mut Vec::new());
                }
            }
            let truth = body.pose();
            if step % EVERY == 0 && (step > 0 || self.looks_first) {
                self.look(&world, &truth, &mut eyes, |label, relation| {
                    estimator.landmark(agent, stamp_ns, label, relation, &mut Vec::new());
                })?;
            }
            let (pose, covariance) = estimator.pose(agent)?;
            let squared = (pose.translation.vector - truth.translation.vector).norm_squared();
            errors.rmse_m += squared;
            if step <= EARLY_STEPS {
                errors.early_rmse_m += squared;
            }
            if step > 0 && step % CONSISTENCY_STEPS == 0 {
                let (linear, angular) = se3::log(&pose.inv_mul(&truth));
                let off = Vector6::from_iterator(linear.iter().chain(angular.iter()).copied());
                errors.nees += off.dot(&(covariance.matrix().try_inverse()? * off)) / 6.0;
                compared += 1.0;
            }
        }
        errors.rmse_m = (errors.rmse_m / self.steps as f64).sqrt();
        errors.early_rmse_m = (errors.early_rmse_m / self.steps.min(EARLY_STEPS) as f64).sqrt();
        errors.nees /= compared;
        Some(errors)
    }

    /// Sights every obstacle within range, as the experiment's agent does.
    fn look(
        self,
        world: &ObstacleWorld,
        pose: &Isometry3<f64>,
        eyes: &mut ChaCha8Rng,
        mut seen: impl FnMut(&Label, &Relation),
    ) -> Option<()> {
        for (number, cube) in (1..).zip(world.cubes()) {
            let line = cube.centre_m - pose.translation.vector;
            if line.norm() > self.range_m {
                continue;
            }
            let mut noisy =
                |value: f64, sd: f64| value + sd * eyes.sample::<f64, _>(StandardNormal);
            let (range_sd_m, bearing_sd_rad) = (RANGE_SHARE * line.norm(), 1_f64.to_radians());
            let at = pose.rotation.inverse() * line;
            let range_m = noisy(line.norm(), range_sd_m).max(0.0);
            let azimuth = noisy(at.y.atan2(at.x), bearing_sd_rad);
            let elevation = noisy(at.z.atan2(at.x.hypot(at.y)), bearing_sd_rad);
            let relation =
                RangeBearing::new(range_m, azimuth, elevation, range_sd_m, bearing_sd_rad).ok()?;
            let label = Label::new(&format!("cube-{number:02}")).ok()?;
            seen(&label, &Relation::RangeBearing(relation));
        }
        Some(())
    }
}
