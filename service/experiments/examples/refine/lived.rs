//! A team's samples through the joint estimate and the chronicle.

use std::collections::BTreeMap;
use std::time::Instant;

use cogmap_experiments::metrics::{Alignment, Span, StampedPose, Trajectory, ate_rmse_m};
use cognitive_map::chronicle::{Chronicle, ChronicleSettings, Moment, Refined};
use cognitive_map::estimation::{Estimator, Parameters};
use cognitive_map::{Motion, Relation, Sample, SampleBody, Target};
use nalgebra::{Vector3, Vector6};

/// A team as it lives.
pub(crate) struct Lived {
    pub(crate) estimator: Estimator,
    pub(crate) chronicle: Chronicle,
    parameters: Parameters,
    agents: BTreeMap<u32, u32>,
    names: BTreeMap<String, u32>,
    seqs: BTreeMap<u32, u64>,
    pub(crate) causal: BTreeMap<u32, Vec<StampedPose>>,
    /// Seconds that the chronicle took for each sample.
    pub(crate) times_s: Vec<f64>,
}

impl Lived {
    pub(crate) fn new(anchors_max: Option<u32>) -> Self {
        let parameters = Parameters::default();
        let mut settings = ChronicleSettings::default();
        if let Some(anchors_max) = anchors_max {
            settings.anchors_max = anchors_max;
        }
        Self {
            estimator: Estimator::new(parameters.clone()),
            chronicle: Chronicle::new(settings),
            parameters,
            agents: BTreeMap::new(),
            names: BTreeMap::new(),
            seqs: BTreeMap::new(),
            causal: BTreeMap::new(),
            times_s: Vec::new(),
        }
    }

    /// A robot of the team.
    pub(crate) fn enrol(&mut self, robot: u32, name: String) {
        let agent = self.estimator.enrol();
        self.chronicle.enrol();
        self.agents.insert(robot, agent);
        self.names.insert(name, agent);
    }

    /// A sample of a robot.
    pub(crate) fn sample(&mut self, robot: u32, sample: &Sample, sees_robots: bool) {
        let (agent, stamp_ns) = (self.agents[&robot], sample.stamp_ns);
        let seq = self.seqs.entry(agent).or_default();
        *seq += 1;
        let seq = *seq;
        match &sample.body {
            SampleBody::Motion(motion) => {
                self.estimator.motion(agent, stamp_ns, motion);
            }
            SampleBody::StartPose(start) => self.estimator.start_pose(agent, start),
            SampleBody::Sighting(sighting) => match &sighting.target {
                Target::Landmark(label) => {
                    self.estimator
                        .landmark(agent, stamp_ns, label, &sighting.relation);
                }
                Target::Agent(name) if sees_robots => {
                    let target = self.names[name.as_str()];
                    self.estimator
                        .sighting(agent, stamp_ns, target, &sighting.relation);
                }
                _ => {}
            },
            _ => {}
        }
        let Some((pose, _)) = self.estimator.pose(agent) else {
            return;
        };
        let moment = Moment {
            agent,
            seq,
            stamp_ns,
            pose,
        };
        let begin = Instant::now();
        match &sample.body {
            SampleBody::Motion(motion) => {
                let sd = noise_sd(&self.parameters, motion);
                let variance = sd.component_mul(&sd);
                self.chronicle
                    .motion(&moment, motion.increment(), &variance);
            }
            SampleBody::StartPose(start) => self.chronicle.start_pose(&moment, start),
            SampleBody::Sighting(sighting) => {
                let variance = stated(&sighting.relation, &self.parameters);
                match &sighting.target {
                    Target::Landmark(label) => {
                        self.chronicle
                            .landmark(&moment, label, &sighting.relation, &variance);
                    }
                    Target::Agent(name) if sees_robots => {
                        let target = self.names[name.as_str()];
                        self.chronicle
                            .sighted(&moment, target, &sighting.relation, &variance);
                    }
                    _ => {}
                }
            }
            _ => {}
        }
        self.times_s.push(begin.elapsed().as_secs_f64());
        let poses = self.causal.entry(robot).or_default();
        poses.pop_if(|last| last.stamp_ns == stamp_ns);
        poses.push(StampedPose { stamp_ns, pose });
    }

    /// Prints causal and refined errors against the truth; answers their means over the robots.
    pub(crate) fn compare(
        &self,
        refined: &Refined,
        truths: &BTreeMap<u32, Trajectory>,
        span: Span,
        alignment: Alignment,
    ) -> [f64; 4] {
        let mut sums = [0.0; 4];
        for (robot, causal) in &self.causal {
            let agent = self.agents[robot] as usize;
            let poses: Vec<StampedPose> = refined.agents[agent]
                .poses
                .iter()
                .map(|row| StampedPose {
                    stamp_ns: row.stamp_ns,
                    pose: row.pose,
                })
                .collect();
            let error = |poses: &[StampedPose], alignment| {
                let trajectory = Trajectory::from_poses(poses).ok();
                trajectory
                    .and_then(|estimate| {
                        ate_rmse_m(&estimate, &truths[robot], span, alignment).ok()
                    })
                    .unwrap_or(f64::NAN)
            };
            let errors = [
                error(causal, Alignment::None),
                error(causal, alignment),
                error(&poses, Alignment::None),
                error(&poses, alignment),
            ];
            for (sum, error) in sums.iter_mut().zip(errors) {
                *sum += error;
            }
            println!(
                "robot {robot}: causal {:.4} m, aligned {:.4} m; refined {:.4} m, aligned {:.4} m; {} poses",
                errors[0],
                errors[1],
                errors[2],
                errors[3],
                poses.len(),
            );
        }
        sums.map(|sum| sum / self.causal.len().max(1) as f64)
    }
}

/// Variances as a sighting states them, of a distance with what may be off again and again.
fn stated(relation: &Relation, parameters: &Parameters) -> Vector3<f64> {
    let sd = match relation {
        Relation::Position(seen) => *seen.sd_m(),
        Relation::RangeBearing(seen) => {
            let lasting = parameters.lasting_range_error * seen.range_m();
            let range_sd_m = seen
                .range_sd_m()
                .hypot(lasting.min(3.0 * seen.range_sd_m()));
            Vector3::new(range_sd_m, seen.bearing_sd_rad(), seen.bearing_sd_rad())
        }
        Relation::Pose(seen) => seen.noise().sd().fixed_rows::<3>(0).into_owned(),
    };
    sd.component_mul(&sd)
}

/// Deviations of a motion: its own, or a random walk's.
fn noise_sd(parameters: &Parameters, motion: &Motion) -> Vector6<f64> {
    if let Some(noise) = motion.noise() {
        return *noise.sd();
    }
    let increment = motion.increment();
    let (path_m, angle_rad) = (
        increment.translation.vector.norm(),
        increment.rotation.angle(),
    );
    let across = parameters.translation_sd_per_sqrt_m * path_m.sqrt();
    let about = (parameters.rotation_sd_per_sqrt_m.powi(2) * path_m
        + parameters.rotation_sd_per_sqrt_rad.powi(2) * angle_rad)
        .sqrt();
    let axis = increment.rotation.imag();
    if increment.translation.z == 0.0 && axis.x == 0.0 && axis.y == 0.0 {
        Vector6::new(across, across, 0.0, 0.0, 0.0, about)
    } else {
        Vector6::new(across, across, across, about, about, about)
    }
}
