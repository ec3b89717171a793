//! A robot with good sensors in a room: covariances are honest whatever its wheels are worth, and
//! what it says of them.

use cognitive_map::estimator::{Estimator, Parameters};
use cognitive_map::{Label, Motion, PoseNoise, RangeBearing, Relation, StartPose};
use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use random::Seeded;

/// Length and width of the room \[m\].
const SIDE_M: f64 = 10.0;
const POSTS: usize = 15;
/// How far is seen, and from where on \[m\].
const RANGES_M: (f64, f64) = (0.3, 6.0);
const RANGE_SD_M: f64 = 0.03;
const BEARING_SD_RAD: f64 = 0.01;
const STEP_S: f64 = 0.1;
/// Steps from one look around to the next.
const STEPS_PER_LOOK: i64 = 5;
const STEPS: i64 = 1800;
/// Steps after which odometry is known.
const STEPS_TO_LEARN: i64 = 600;
const SEEDS: u64 = 12;

/// Wheels and what they say of themselves.
#[derive(Clone, Copy)]
struct Wheels {
    /// Their noise, in the deviations that the settings assume.
    noise: f64,
    /// What they state, in the same unit.
    stated: Option<f64>,
    /// Steps before the robot looks around for the first time.
    blind_steps: i64,
    /// By how much they turn the robot with each metre, unread \[rad/m\].
    veer_rad_m: f64,
}

/// Normalised errors squared of pose, after odometry is known, and its mean squared error of
/// position \[m²\].
struct Errors {
    nees: f64,
    nees_of_heading: f64,
    squared_m2: f64,
}

impl Wheels {
    /// Means over some seeds.
    fn errors(self) -> Errors {
        let all: Vec<Errors> = (1..=SEEDS).map(|seed| self.drive(seed)).collect();
        let mean = |of: fn(&Errors) -> f64| all.iter().map(of).sum::<f64>() / all.len() as f64;
        Errors {
            nees: mean(|errors| errors.nees),
            nees_of_heading: mean(|errors| errors.nees_of_heading),
            squared_m2: mean(|errors| errors.squared_m2),
        }
    }

    fn drive(self, seed: u64) -> Errors {
        let random = &mut Seeded(seed);
        let point = |random: &mut Seeded| {
            let [x, y] = [(); 2].map(|()| SIDE_M * (0.05 + 0.9 * random.uniform()));
            Point3::new(x, y, 0.0)
        };
        let posts: Vec<Point3<f64>> = (0..POSTS).map(|_| point(random)).collect();
        let parameters = Parameters::default();
        let mut estimator = Estimator::new(parameters.clone());
        let agent = estimator.enrol();
        let mut truth = Isometry3::new(point(random).coords, Vector3::z() * random.normal());
        let (shift, turn) = (truth.translation.vector, truth.rotation.coords);
        let start = StartPose::new(shift.into(), turn.into(), PoseNoise::none()).unwrap();
        estimator.start_pose(agent, &start, &mut Vec::new());
        let mut goal = point(random);
        let (mut errors, mut compared) = (
            Errors {
                nees: 0.0,
                nees_of_heading: 0.0,
                squared_m2: 0.0,
            },
            0.0,
        );
        for step in 0..STEPS {
            let stamp_ns = step * 100_000_000;
            if step > 0 {
                while (truth.translation.vector - goal.coords).norm() < 0.3 {
                    goal = point(random);
                }
                let motion = self.step(&mut truth, &goal, &parameters, random);
                estimator.motion(agent, stamp_ns, &motion, &mut Vec::new());
            }
            if step >= self.blind_steps && step % STEPS_PER_LOOK == 0 {
                look(&mut estimator, agent, stamp_ns, &truth, &posts, random);
            }
            if step >= STEPS_TO_LEARN && step % 10 == 0 {
                let (pose, covariance) = estimator.pose(agent).unwrap();
                let off = pose.inv_mul(&truth);
                let (at, turn) = (off.translation.vector, off.rotation.scaled_axis());
                let error = Vector3::new(at.x, at.y, turn.z);
                let planar: Matrix3<f64> = geometry::planar_part(covariance.matrix());
                errors.nees += error.dot(&(planar.try_inverse().unwrap() * error)) / 3.0;
                errors.nees_of_heading += turn.z * turn.z / planar[(2, 2)];
                errors.squared_m2 += at.norm_squared();
                compared += 1.0;
            }
        }
        errors.nees /= compared;
        errors.nees_of_heading /= compared;
        errors.squared_m2 /= compared;
        errors
    }

    /// A step towards a goal, as odometry reads it.
    fn step(
        self,
        truth: &mut Isometry3<f64>,
        goal: &Point3<f64>,
        parameters: &Parameters,
        random: &mut Seeded,
    ) -> Motion {
        let ahead = truth.inverse_transform_point(goal);
        let turn_rad_s = ahead.y.atan2(ahead.x).clamp(-0.8, 0.8);
        let length_m = STEP_S * if turn_rad_s.abs() > 0.6 { 0.1 } else { 0.5 };
        let turn_rad = turn_rad_s * STEP_S;
        *truth *= Isometry3::new(Vector3::x() * length_m, Vector3::z() * turn_rad);
        let sd_m = parameters.translation_sd_per_sqrt_m * length_m.sqrt();
        let by_path = parameters.rotation_sd_per_sqrt_m.powi(2) * length_m;
        let by_turn = parameters.rotation_sd_per_sqrt_rad.powi(2) * turn_rad.abs();
        let sd_rad = (by_path + by_turn).sqrt();
        let mut off = |sd: f64| self.noise * sd * random.normal();
        let read = [length_m + off(sd_m), off(sd_m), 0.0];
        let half = 0.5 * (turn_rad - self.veer_rad_m * length_m + off(sd_rad));
        let noise = self.stated.map(|part| {
            PoseNoise::new([part * sd_m, part * sd_m, 0.0], [0.0, 0.0, part * sd_rad]).unwrap()
        });
        Motion::from_increment(read, [0.0, 0.0, half.sin(), half.cos()], noise).unwrap()
    }
}

/// Sights every post within range.
fn look(
    estimator: &mut Estimator,
    agent: u32,
    stamp_ns: i64,
    truth: &Isometry3<f64>,
    posts: &[Point3<f64>],
    random: &mut Seeded,
) {
    for (number, post) in posts.iter().enumerate() {
        let at = truth.inverse_transform_point(post);
        let range_m = at.coords.norm();
        if !(RANGES_M.0..=RANGES_M.1).contains(&range_m) {
            continue;
        }
        let seen = RangeBearing::new(
            range_m + RANGE_SD_M * random.normal(),
            at.y.atan2(at.x) + BEARING_SD_RAD * random.normal(),
            0.0,
            RANGE_SD_M,
            BEARING_SD_RAD,
        );
        let label = Label::new(&format!("post-{number}")).unwrap();
        let relation = Relation::RangeBearing(seen.unwrap());
        estimator.landmark(agent, stamp_ns, &label, &relation, &mut Vec::new());
    }
}

#[test]
fn covariances_are_honest_whatever_wheels_are_worth() {
    for noise in [0.1, 0.3, 1.0, 3.0] {
        let errors = Wheels {
            noise,
            stated: None,
            blind_steps: 0,
            veer_rad_m: 0.0,
        }
        .errors();
        assert!(
            (0.5..1.7).contains(&errors.nees),
            "{noise}: {}",
            errors.nees
        );
    }
}

/// What a robot does before it sees anything turns its whole map, by as much as its wheels are off.
/// When these are known, so is that. It is a single error in each drive: the mean of twelve squares
/// exceeds 2.7 once in a thousand times (χ²).
#[test]
fn a_map_that_begins_blindly_is_as_unsure_as_the_wheels_are_worth() {
    for (noise, honest) in [(0.1, 0.2..2.7), (0.3, 0.3..2.7), (1.0, 0.5..2.7)] {
        let wheels = Wheels {
            noise,
            stated: None,
            blind_steps: 20,
            veer_rad_m: 0.0,
        };
        let of_heading = wheels.errors().nees_of_heading;
        assert!(honest.contains(&of_heading), "{noise}: {of_heading}");
    }
}

/// Wheels of different sizes, either way: a robot that has found it out is off by no more than one
/// with even wheels by half again.
#[test]
fn robots_that_veer_are_found_out() {
    let wheels = |veer_rad_m| Wheels {
        noise: 0.3,
        stated: None,
        blind_steps: 0,
        veer_rad_m,
    };
    let even = wheels(0.0).errors();
    for veer_rad_m in [0.05, -0.05] {
        let errors = wheels(veer_rad_m).errors();
        assert!(
            errors.squared_m2 < 1.5 * 1.5 * even.squared_m2,
            "{veer_rad_m}: {} and {}",
            errors.squared_m2.sqrt(),
            even.squared_m2.sqrt()
        );
        assert!(
            (0.4..1.7).contains(&errors.nees),
            "{veer_rad_m}: {}",
            errors.nees
        );
    }
}

#[test]
fn noise_that_is_stated_rightly_stays_honest() {
    for noise in [0.1, 1.0] {
        let stated = Some(noise);
        let wheels = Wheels {
            noise,
            stated,
            blind_steps: 0,
            veer_rad_m: 0.0,
        };
        let errors = wheels.errors();
        assert!(
            (0.5..1.5).contains(&errors.nees),
            "{noise}: {}",
            errors.nees
        );
    }
}

#[test]
fn a_robot_that_states_next_to_no_noise_does_not_bend_the_map() {
    let liar = Wheels {
        noise: 1.0,
        stated: Some(1e-4),
        blind_steps: 0,
        veer_rad_m: 0.0,
    };
    let errors = liar.errors();
    assert!(
        errors.squared_m2.sqrt() < 0.15,
        "{}",
        errors.squared_m2.sqrt()
    );
}
