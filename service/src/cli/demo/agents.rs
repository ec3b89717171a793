//! The simulated agents: each an ordinary client of the service.

use std::sync::mpsc::Sender;
use std::time::Duration;

use cogmap_client::{Api, ApiError, Robot};
use cogmap_proto::{Estimate, Sample};
use cogmap_worlds::{AgentTick, DeadReckoning};
use nalgebra::Vector3;
use trajectory::{Alignment, StampedPose, Trajectory, ate_rmse_m};
use zenoh::Session;

use super::progress::RobotLine;
use super::summary::RobotSummary;
use crate::decode::stamped_pose;

/// Longest wait for the last samples to be durable.
pub(super) const TIMEOUT: Duration = Duration::from_secs(60);

/// An agent that is switched on.
pub(super) struct DemoAgent {
    name: String,
    client: Robot,
    /// Its motion alone, from where it truly started: nobody else is told so much.
    reckoning: DeadReckoning,
    reckoned: Vec<StampedPose>,
    truth: Vec<StampedPose>,
    sent: u64,
}

/// Samples on their way.
#[derive(Clone, Copy, Default)]
pub(super) struct Traffic {
    pub(super) sent: u64,
    pub(super) applied: u64,
    pub(super) durable: u64,
    pub(super) resent: u64,
}

impl Traffic {
    pub(super) fn add(&mut self, more: &Self) {
        self.sent += more.sent;
        self.applied += more.applied;
        self.durable += more.durable;
        self.resent += more.resent;
    }
}

impl DemoAgent {
    /// Switches an agent on. Its estimates go to `heard`.
    pub(super) fn switch_on(
        session: &Session,
        space: &str,
        first: &AgentTick,
        heard: Sender<Estimate>,
    ) -> anyhow::Result<Self> {
        let client = Robot::builder(space, &first.name)
            .zenoh_session(session.clone())
            .connect()?;
        client.on_estimate(move |estimate| {
            // Whoever does not listen any more has ended.
            let _ = heard.send(estimate.clone());
        });
        Ok(Self {
            name: first.name.clone(),
            client,
            reckoning: DeadReckoning::from(first.truth.pose),
            reckoned: Vec::new(),
            truth: Vec::new(),
            sent: 0,
        })
    }

    /// Sends what the agent read.
    pub(super) fn send(&mut self, tick: &AgentTick) -> anyhow::Result<()> {
        self.truth.push(tick.truth);
        let is_first = self.reckoned.is_empty();
        if is_first {
            self.reckoned.push(tick.truth);
        }
        let mut samples = Vec::with_capacity(tick.readings.len());
        for reading in &tick.readings {
            if !is_first {
                self.reckoned.extend(self.reckoning.apply(reading)?);
            }
            samples.push(Sample::from(reading));
        }
        self.sent += samples.len() as u64;
        if !samples.is_empty() {
            self.client.send_batch(samples)?;
        }
        Ok(())
    }

    /// Waits until everything is durable.
    pub(super) fn flush(&self) -> anyhow::Result<()> {
        Ok(self.client.flush(TIMEOUT)?)
    }

    /// Where it truly was at a stamp \[m\].
    pub(super) fn truth_m(&self, stamp_ns: i64) -> Option<Vector3<f64>> {
        let after = self.truth.partition_point(|pose| pose.stamp_ns < stamp_ns);
        let pose = self.truth.get(after).or(self.truth.last())?;
        Some(pose.pose.translation.vector)
    }

    /// Distance of an estimate from the truth \[m\].
    pub(super) fn error_m(&self, estimate: &Estimate) -> Option<f64> {
        let truth_m = self.truth_m(estimate.stamp_ns)?;
        Some((Vector3::from(estimate.translation_m) - truth_m).norm())
    }

    pub(super) fn line(&self) -> RobotLine {
        let estimate = self.client.latest_estimate();
        RobotLine {
            name: self.name.clone(),
            sent: self.sent,
            pending: self.client.pending(),
            error_m: estimate.as_ref().and_then(|told| self.error_m(told)),
            estimate,
        }
    }

    /// Waits until everything is durable, ends the session, and sums up.
    pub(super) fn switch_off(
        self,
        api: &Api,
        space: &str,
    ) -> anyhow::Result<(RobotSummary, Traffic)> {
        self.client.flush(TIMEOUT)?;
        let agent = api.agent(space, &self.name)?;
        let traffic = Traffic {
            sent: self.sent,
            applied: agent.watermark.applied,
            durable: agent.watermark.durable,
            resent: self.client.counters().samples_resent,
        };
        let end_error_m = agent.estimate.and_then(|told| self.error_m(&told));
        let causal: Vec<_> = api.trajectory(space, &self.name)?.poses;
        let first_ns = self.truth.first().map_or(0, |pose| pose.stamp_ns);
        let causal: Vec<_> = causal
            .iter()
            .map(stamped_pose)
            .filter(|pose| pose.stamp_ns >= first_ns)
            .collect();
        let end_of = |poses: &[StampedPose]| {
            let pose = poses.last()?;
            let truth_m = self.truth_m(pose.stamp_ns)?;
            Some((pose.pose.translation.vector - truth_m).norm())
        };
        let summary = RobotSummary {
            dead_reckoning_ate_rmse_m: self.rmse_m(&self.reckoned),
            causal_ate_rmse_m: self.rmse_m(&causal),
            dead_reckoning_end_error_m: end_of(&self.reckoned),
            causal_end_error_m: end_error_m,
            samples: self.sent,
            name: self.name.clone(),
        };
        self.client.close(TIMEOUT)?;
        Ok((summary, traffic))
    }

    /// RMSE of position against the truth \[m\]; none without poses, as of a robot that was never
    /// found.
    fn rmse_m(&self, poses: &[StampedPose]) -> Option<f64> {
        let truth = Trajectory::from_poses(&self.truth).ok()?;
        let estimate = Trajectory::from_poses(poses).ok()?;
        ate_rmse_m(&estimate, &truth, truth.span(), Alignment::None).ok()
    }
}

/// Removes an agent that the space knows from before, so that it knows nothing of where it is.
pub(super) fn remove(api: &Api, space: &str, name: &str) -> Result<(), ApiError> {
    match api.delete_agent(space, name) {
        // It was never there, or has been removed already.
        Err(ApiError::Problem(problem)) if matches!(problem.status, 404 | 410) => Ok(()),
        result => result,
    }
}
