//! A data set through the estimate.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

use cogmap_lab::mrclam::Mrclam;
use cogmap_worlds::robot_name;
use cognitive_map::estimator::{Estimator, Parameters};
use cognitive_map::{Label, Sample, SampleBody, Target};
use geometry::PoseCovariance;
use nalgebra::{Isometry3, Vector2, Vector3};
use trajectory::{Alignment, StampedPose, Trajectory, ate_rmse_m};

/// Between two instants at which the covariance is compared with the error \[ns\].
const CONSISTENCY_NS: i64 = 1_000_000_000;

/// What the estimate is told.
#[derive(Clone, Debug)]
pub(crate) struct Told {
    /// What robots see of one another.
    pub(crate) sightings_of_robots: bool,
    /// Where robots other than the first one start.
    pub(crate) all_starts: bool,
    /// The robots that have names of their own for landmarks.
    pub(crate) anonymous: Vec<u32>,
}

/// Prints the errors; answers whether the set could be read.
pub(crate) fn run(directory: &str, told: &Told) -> bool {
    let Ok(set) = Mrclam::load(Path::new(directory)) else {
        return false;
    };
    let mut estimator = Estimator::new(Parameters::default());
    let agents: BTreeMap<u32, u32> = set
        .robots()
        .keys()
        .map(|&r| (r, estimator.enrol()))
        .collect();
    let by_name: BTreeMap<String, u32> = agents.iter().map(|(&r, &a)| (robot_name(r), a)).collect();
    let mut causal: BTreeMap<u32, Vec<StampedPose>> = BTreeMap::new();
    let mut times_s = Vec::new();
    let mut consistency = Consistency::default();
    for mut entry in set.team_readings() {
        if told.anonymous.contains(&entry.robot) {
            entry = entry.with_own_names();
        }
        let Ok(sample) = Sample::try_from(&entry.reading) else {
            continue;
        };
        let (agent, stamp_ns) = (agents[&entry.robot], sample.stamp_ns);
        let begin = Instant::now();
        take(&mut estimator, agent, &sample, told, &by_name);
        times_s.push(begin.elapsed().as_secs_f64());
        if !estimator.is_in_map(agent) {
            continue;
        }
        let Some((pose, covariance)) = estimator.pose(agent) else {
            continue;
        };
        let poses = causal.entry(entry.robot).or_default();
        poses.pop_if(|last| last.stamp_ns == stamp_ns);
        poses.push(StampedPose { stamp_ns, pose });
        let truth = set.robots()[&entry.robot].truth_at(stamp_ns);
        let truth = truth.map(|truth| truth.in_space().pose.translation.vector);
        if let Some(nees) = truth.and_then(|truth| nees(&truth, &pose, &covariance)) {
            consistency.note(entry.robot, stamp_ns, nees);
        }
    }
    print(&set, &estimator, &agents, &causal);
    if !told.anonymous.is_empty() {
        print_names(&estimator);
    }
    times_s.sort_by(f64::total_cmp);
    let total_s: f64 = times_s.iter().sum();
    println!(
        "{} landmarks, nees {:.2}, {} samples in {total_s:.2} s, p50 {:.1} us, p99 {:.1} us, max {:.2} ms",
        estimator.landmarks().count(),
        consistency.mean(),
        times_s.len(),
        times_s[times_s.len() / 2] * 1e6,
        times_s[times_s.len() * 99 / 100] * 1e6,
        times_s[times_s.len() - 1] * 1e3,
    );
    true
}

/// Gives the estimator a sample, unless it must not be told.
fn take(
    estimator: &mut Estimator,
    agent: u32,
    sample: &Sample,
    told: &Told,
    by_name: &BTreeMap<String, u32>,
) {
    let stamp_ns = sample.stamp_ns;
    match &sample.body {
        SampleBody::Motion(motion) => {
            estimator.motion(agent, stamp_ns, motion, &mut Vec::new());
        }
        SampleBody::StartPose(start) if agent == 0 || told.all_starts => {
            estimator.start_pose(agent, start, &mut Vec::new());
        }
        SampleBody::Sighting(sighting) => match &sighting.target {
            Target::Landmark(label) => {
                estimator.landmark(agent, stamp_ns, label, &sighting.relation, &mut Vec::new());
            }
            Target::Agent(name) if told.sightings_of_robots => {
                let target = by_name[name.as_str()];
                estimator.sighting(agent, stamp_ns, target, &sighting.relation, &mut Vec::new());
            }
            _ => {}
        },
        _ => {}
    }
}

/// Normalised estimation error squared of a position in the plane.
fn nees(truth: &Vector3<f64>, pose: &Isometry3<f64>, covariance: &PoseCovariance) -> Option<f64> {
    let off = pose.rotation.inverse() * (truth - pose.translation.vector);
    let spread = covariance.matrix().fixed_view::<2, 2>(0, 0).into_owned();
    let inverse = spread.try_inverse()?;
    let off = Vector2::new(off.x, off.y);
    Some(off.dot(&(inverse * off)))
}

/// Prints a line for each robot, and the means.
fn print(
    set: &Mrclam,
    estimator: &Estimator,
    agents: &BTreeMap<u32, u32>,
    causal: &BTreeMap<u32, Vec<StampedPose>>,
) {
    let mut sums = [0.0; 2];
    for (robot, poses) in causal {
        let truth = set.robots()[robot].truth_trajectory();
        let Ok(estimate) = Trajectory::from_poses(poses) else {
            continue;
        };
        let error =
            |alignment| ate_rmse_m(&estimate, &truth, set.span(), alignment).unwrap_or(f64::NAN);
        let errors = [error(Alignment::None), error(Alignment::Planar)];
        sums = [sums[0] + errors[0], sums[1] + errors[1]];
        let evidence = estimator
            .evidence(agents[robot])
            .copied()
            .unwrap_or_default();
        println!(
            "robot {robot}: {:.3} m, aligned {:.3} m; in the map after {:.1} s; {} sightings, {} refused, nis {:.2}",
            errors[0],
            errors[1],
            (poses[0].stamp_ns - set.span().start_ns) as f64 * 1e-9,
            evidence.accepted,
            evidence.refused,
            evidence.nis / evidence.components.max(1) as f64,
        );
    }
    let n = causal.len().max(1) as f64;
    println!("mean {:.4} m, aligned {:.4} m", sums[0] / n, sums[1] / n);
}

/// Prints how many names of landmarks were found to be others', and whether they are:
/// `landmark-6-of-robot3` is `landmark-6`, or what another robot calls so.
fn print_names(estimator: &Estimator) {
    let is_right = |name: &&Label| {
        let plain = |name: &Label| {
            let name = name.as_str();
            name.split("-of-").next().unwrap_or(name).to_owned()
        };
        plain(name) == plain(estimator.name_of(name))
    };
    let right = estimator.other_names().filter(is_right).count();
    let all = estimator.other_names().count();
    println!("{all} names are others', {right} of them rightly");
}

/// Normalised estimation errors squared, per component.
#[derive(Default)]
struct Consistency {
    latest_ns: BTreeMap<u32, i64>,
    sum: f64,
    count: u32,
}

impl Consistency {
    fn note(&mut self, robot: u32, stamp_ns: i64, squared: f64) {
        let latest_ns = self.latest_ns.entry(robot).or_insert(i64::MIN);
        if stamp_ns.saturating_sub(*latest_ns) >= CONSISTENCY_NS {
            *latest_ns = stamp_ns;
            self.sum += squared / 2.0;
            self.count += 1;
        }
    }

    fn mean(&self) -> f64 {
        self.sum / f64::from(self.count.max(1))
    }
}
