//! A team's samples through the joint estimate and the graph.

use std::collections::BTreeMap;
use std::time::Instant;

use cognitive_map::estimator::{Effect, Estimator, Parameters};
use cognitive_map::keyframes::{KeyframeGraph, KeyframeSettings, Moment, Refined};
use cognitive_map::{Sample, SampleBody, Target};
use trajectory::{Alignment, Span, StampedPose, Trajectory, ate_rmse_m};

/// A team as it lives.
pub(crate) struct Lived {
    pub(crate) estimator: Estimator,
    pub(crate) graph: KeyframeGraph,
    agents: BTreeMap<u32, u32>,
    names: BTreeMap<String, u32>,
    seqs: BTreeMap<u32, u64>,
    pub(crate) causal: BTreeMap<u32, Vec<StampedPose>>,
    /// Seconds that the graph took for each sample.
    pub(crate) times_s: Vec<f64>,
}

impl Lived {
    pub(crate) fn new(keyframes_max: Option<u32>) -> Self {
        let mut settings = KeyframeSettings::default();
        if let Some(keyframes_max) = keyframes_max {
            settings.keyframes_max = keyframes_max;
        }
        Self {
            estimator: Estimator::new(Parameters::default()),
            graph: KeyframeGraph::new(settings),
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
        self.graph.enrol();
        self.agents.insert(robot, agent);
        self.names.insert(name, agent);
    }

    /// A sample of a robot.
    pub(crate) fn sample(&mut self, robot: u32, sample: &Sample, sees_robots: bool) {
        let (agent, stamp_ns) = (self.agents[&robot], sample.stamp_ns);
        let seq = self.seqs.entry(agent).or_default();
        *seq += 1;
        let seq = *seq;
        let mut effects = Vec::new();
        match &sample.body {
            SampleBody::Motion(motion) => {
                self.estimator.motion(agent, stamp_ns, motion, &mut effects);
            }
            SampleBody::StartPose(start) => self.estimator.start_pose(agent, start, &mut effects),
            SampleBody::Sighting(sighting) => match &sighting.target {
                Target::Landmark(label) => {
                    let relation = &sighting.relation;
                    self.estimator
                        .landmark(agent, stamp_ns, label, relation, &mut effects);
                }
                Target::Agent(name) if sees_robots => {
                    let target = self.names[name.as_str()];
                    self.estimator.sighting(
                        agent,
                        stamp_ns,
                        target,
                        &sighting.relation,
                        &mut effects,
                    );
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
        if let SampleBody::StartPose(start) = &sample.body {
            self.graph.start_pose(&moment, start);
        }
        effects.sort_by_key(Effect::order);
        for effect in &effects {
            self.apply(&moment, effect);
        }
        self.times_s.push(begin.elapsed().as_secs_f64());
        let poses = self.causal.entry(robot).or_default();
        poses.pop_if(|last| last.stamp_ns == stamp_ns);
        poses.push(StampedPose { stamp_ns, pose });
    }

    /// Tells the keyframe graph what a sample brought about.
    fn apply(&mut self, moment: &Moment, effect: &Effect) {
        match effect {
            Effect::Moved { step, .. } => {
                self.graph
                    .motion(moment, &step.increment, &step.variance, &step.calibrated);
            }
            Effect::LandmarkSighted {
                label,
                relation,
                variance,
                ..
            } => self.graph.landmark(moment, label, relation, variance),
            Effect::AgentSighted(seen) if seen.accepted => {
                let variance = seen.variance.fixed_rows::<3>(0).into_owned();
                self.graph.sighted(
                    seen.observer,
                    seen.target,
                    seen.stamp_ns,
                    &seen.relation,
                    &variance,
                );
            }
            Effect::FramesMerged(merged) => {
                for &agent in &merged.agents {
                    if merged.into == 0 {
                        self.graph.placed(agent, &merged.pose);
                    } else {
                        self.graph.transformed(agent, &merged.pose);
                    }
                }
            }
            _ => {}
        }
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
