use cognitive_map::estimator::{Estimator, Parameters};
use cognitive_map::{Label, Motion, PoseNoise, RangeBearing, Relation, StartPose};
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};

use random::Seeded;

const ROBOTS: usize = 4;
const STEP_S: f64 = 0.5;
const SPEED_M_S: f64 = 0.4;
/// How far is seen \[m\].
const RANGE_M: f64 = 5.0;
const RANGE_SHARE: f64 = 0.05;
const BEARING_SD_RAD: f64 = 0.02;

/// What a robot's sightings are turned into: range \[m\] and azimuth \[rad\].
pub(crate) type Lie = fn(&mut Seeded, f64, f64) -> (f64, f64);

/// What happens in the hall.
#[derive(Clone)]
pub(crate) struct Hall {
    pub(crate) seed: u64,
    pub(crate) steps: usize,
    /// Half the hall's length and width \[m\].
    pub(crate) half_m: f64,
    /// Posts in it.
    pub(crate) posts: usize,
    /// Deviations of sightings as they are stated, over the true ones.
    pub(crate) stated: f64,
    /// Robots that state them so; the others state the true ones.
    pub(crate) stated_by: std::ops::Range<usize>,
    /// Share of sightings of something else, anywhere within reach.
    pub(crate) mistaken: f64,
    /// Whether the motion's noise is stated, and the same factor there.
    pub(crate) stated_motion: Option<f64>,
    /// What robot 0 says instead of what it sees, from this step on.
    pub(crate) lie: Option<(usize, Lie)>,
    /// Robot 1 is somewhere else from this step on, without having driven there.
    pub(crate) slip: Option<(usize, Isometry3<f64>)>,
    /// Post 0 stands there from this step on.
    pub(crate) moved: Option<(usize, Point3<f64>)>,
    /// Posts 0 and 1 are taken for each other from this step on.
    pub(crate) swapped: Option<usize>,
    /// Robot 2 neither drives nor tells anything in these steps.
    pub(crate) silence: std::ops::Range<usize>,
    /// Whether walls hide what is not in the same quarter of the hall.
    pub(crate) walls: bool,
}

/// What came out.
pub(crate) struct Outcome {
    pub(crate) estimator: Estimator,
    /// Distance of each robot's estimate from the truth after each step \[m\].
    pub(crate) errors_m: Vec<[f64; ROBOTS]>,
    /// Where the posts stand at the end.
    pub(crate) posts: Vec<Point3<f64>>,
}

impl Default for Hall {
    fn default() -> Self {
        Self {
            seed: 1,
            steps: 400,
            half_m: 6.0,
            posts: 20,
            stated: 1.0,
            stated_by: 0..ROBOTS,
            mistaken: 0.0,
            stated_motion: None,
            lie: None,
            slip: None,
            moved: None,
            swapped: None,
            silence: 0..0,
            walls: false,
        }
    }
}

impl Outcome {
    /// Root of a robot's mean squared error from a step on \[m\].
    pub(crate) fn rmse_m(&self, robot: usize, from: usize) -> f64 {
        let errors = self.errors_m[from..].iter().map(|errors| errors[robot]);
        let sum: f64 = errors.map(|error| error * error).sum();
        (sum / (self.errors_m.len() - from) as f64).sqrt()
    }

    /// The worst of that over some robots.
    pub(crate) fn worst_rmse_m(&self, robots: impl IntoIterator<Item = usize>, from: usize) -> f64 {
        let rmse = robots.into_iter().map(|robot| self.rmse_m(robot, from));
        rmse.fold(0.0, f64::max)
    }

    /// Where the estimate has a post.
    pub(crate) fn post(&self, number: usize) -> Option<Point3<f64>> {
        let label = label(number);
        let mut landmarks = self.estimator.landmarks();
        let found = landmarks.find(|(name, ..)| **name == label)?;
        Some(found.1)
    }
}

impl Hall {
    /// Lets the robots drive.
    pub(crate) fn run(&self) -> Outcome {
        let mut random = Seeded(self.seed);
        let mut posts: Vec<Point3<f64>> = (0..self.posts)
            .map(|_| {
                let [x, y] = [(); 2].map(|()| (2.0 * random.uniform() - 1.0) * self.half_m);
                Point3::new(x, y, 0.0)
            })
            .collect();
        let corners = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)];
        let mut truth =
            corners.map(|(x, y)| planar(0.5 * self.half_m * x, 0.5 * self.half_m * y, 3.0 * x + y));
        let mut estimator = Estimator::new(Parameters::default());
        for pose in &truth {
            let agent = estimator.enrol();
            let noise = PoseNoise::new([0.02, 0.02, 0.0], [0.0, 0.0, 0.01]).unwrap();
            let (shift, turn) = (pose.translation.vector, pose.rotation.coords);
            let start = StartPose::new(shift.into(), turn.into(), noise).unwrap();
            estimator.start_pose(agent, &start, &mut Vec::new());
        }
        let scales = [(); ROBOTS].map(|()| (1.0 + 0.01 * random.normal(), 0.001 * random.normal()));
        let mut errors_m = Vec::new();
        for step in 0..self.steps {
            let stamp_ns = i64::try_from(step + 1).unwrap() * 500_000_000;
            if let Some((_, place)) = self.moved.filter(|(at, _)| *at == step) {
                posts[0] = place;
            }
            for robot in 0..ROBOTS {
                let silent = robot == 2 && self.silence.contains(&step);
                if let Some((_, slip)) = &self.slip.filter(|(at, _)| robot == 1 && *at == step) {
                    truth[robot] *= slip;
                }
                if !silent {
                    let motion = drive(&mut truth[robot], self.half_m, &mut random, scales[robot]);
                    let motion = self.as_stated(&motion);
                    estimator.motion(number(robot), stamp_ns, &motion, &mut Vec::new());
                }
            }
            for robot in 0..ROBOTS {
                if !(robot == 2 && self.silence.contains(&step)) {
                    self.look(
                        step,
                        robot,
                        &truth,
                        &posts,
                        stamp_ns,
                        &mut random,
                        &mut estimator,
                    );
                }
            }
            errors_m.push(std::array::from_fn(|robot| {
                let estimate = estimator.in_frame(number(robot)).unwrap();
                (estimate.translation.vector - truth[robot].translation.vector).norm()
            }));
        }
        Outcome {
            estimator,
            errors_m,
            posts,
        }
    }

    /// A motion as odometry states it.
    fn as_stated(&self, motion: &Motion) -> Motion {
        let noise = self.stated_motion.map(|factor| {
            let (along, about) = (0.05 * SPEED_M_S * STEP_S * factor, 0.01 * factor);
            PoseNoise::new([along, along, 0.0], [0.0, 0.0, about]).unwrap()
        });
        let increment = motion.increment();
        let (shift, turn) = (increment.translation.vector, increment.rotation.coords);
        Motion::from_increment(shift.into(), turn.into(), noise).unwrap()
    }

    /// A robot sees two posts, and one other robot, of those within reach.
    #[expect(clippy::too_many_arguments, reason = "all of the world at one instant")]
    fn look(
        &self,
        step: usize,
        robot: usize,
        truth: &[Isometry3<f64>; ROBOTS],
        posts: &[Point3<f64>],
        stamp_ns: i64,
        random: &mut Seeded,
        estimator: &mut Estimator,
    ) {
        let liar = self
            .lie
            .filter(|(since, _)| robot == 0 && *since <= step)
            .map(|(_, lie)| lie);
        let pose = truth[robot];
        let here = Point3::from(pose.translation.vector);
        let quarter = |point: &Point3<f64>| (point.x > 0.0, point.y > 0.0);
        let is_seen = |point: &Point3<f64>| {
            (point - here).norm() < RANGE_M && (!self.walls || quarter(point) == quarter(&here))
        };
        let near: Vec<usize> = (0..posts.len())
            .filter(|&post| is_seen(&posts[post]))
            .collect();
        for turn in 0..near.len().min(2) {
            let post = near[(2 * step + turn) % near.len()];
            let called = match (self.swapped, post) {
                (Some(since), 0 | 1) if step >= since => 1 - post,
                _ => post,
            };
            let relation = self.relation((robot, liar), &pose, &posts[post], random);
            estimator.landmark(
                number(robot),
                stamp_ns,
                &label(called),
                &relation,
                &mut Vec::new(),
            );
        }
        let others = (0..ROBOTS).filter(|&other| {
            other != robot && is_seen(&Point3::from(truth[other].translation.vector))
        });
        let others: Vec<usize> = others.collect();
        if !others.is_empty() {
            let other = others[step % others.len()];
            let point = Point3::from(truth[other].translation.vector);
            let relation = self.relation((robot, liar), &pose, &point, random);
            estimator.sighting(
                number(robot),
                stamp_ns,
                number(other),
                &relation,
                &mut Vec::new(),
            );
        }
    }

    /// What a robot tells of a point.
    fn relation(
        &self,
        (robot, liar): (usize, Option<Lie>),
        pose: &Isometry3<f64>,
        point: &Point3<f64>,
        random: &mut Seeded,
    ) -> Relation {
        let seen = pose.inverse_transform_point(point).coords;
        let range_sd_m = RANGE_SHARE * seen.norm();
        let mut range_m = (seen.norm() + range_sd_m * random.normal()).max(0.0);
        let mut azimuth_rad = seen.y.atan2(seen.x) + BEARING_SD_RAD * random.normal();
        if let Some(lie) = liar {
            (range_m, azimuth_rad) = lie(random, range_m, azimuth_rad);
        }
        if self.mistaken > 0.0 && random.uniform() < self.mistaken {
            range_m = RANGE_M * random.uniform();
            azimuth_rad = std::f64::consts::PI * (2.0 * random.uniform() - 1.0);
        }
        let stated = if self.stated_by.contains(&robot) {
            self.stated
        } else {
            1.0
        };
        let (range_sd_m, bearing_sd_rad) = (range_sd_m * stated, BEARING_SD_RAD * stated);
        let seen = RangeBearing::new(range_m, azimuth_rad, 0.0, range_sd_m, bearing_sd_rad);
        Relation::RangeBearing(seen.unwrap())
    }
}

/// A step towards the middle of the hall, more or less; answers what odometry reads.
fn drive(
    truth: &mut Isometry3<f64>,
    half_m: f64,
    random: &mut Seeded,
    (scale, bias): (f64, f64),
) -> Motion {
    let here = truth.translation.vector;
    let inwards = truth.inverse_transform_point(&Point3::origin()).coords;
    let pull = if here.norm() > 0.7 * half_m {
        0.3 * inwards.y.atan2(inwards.x)
    } else {
        0.0
    };
    let turn = pull + 0.15 * random.normal();
    let path_m = SPEED_M_S * STEP_S;
    *truth *= planar(path_m, 0.0, turn);
    let read_m = path_m * scale * (1.0 + 0.05 * random.normal());
    let read_rad = turn + bias * STEP_S + 0.01 * random.normal();
    let turned = planar(0.0, 0.0, read_rad).rotation.coords;
    Motion::from_increment([read_m, 0.0, 0.0], turned.into(), None).unwrap()
}

pub(crate) fn planar(x: f64, y: f64, heading: f64) -> Isometry3<f64> {
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading);
    Isometry3::from_parts(Vector3::new(x, y, 0.0).into(), turn)
}

pub(crate) fn label(number: usize) -> Label {
    Label::new(&format!("post-{number}")).unwrap()
}

fn number(robot: usize) -> u32 {
    u32::try_from(robot).unwrap()
}
