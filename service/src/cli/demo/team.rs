//! The simulated team: each robot an ordinary client of the service.

use std::sync::atomic::Ordering;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::Context;
use cogmap_client::{Api, Robot, open_session};
use cogmap_proto::{RecallQuery, Sample};
use cogmap_worlds::{DeadReckoning, ObstacleWorld, Team, TeamSettings, robot_name};
use zenoh::{Session, Wait};

use super::Stop;
use super::progress::{Progress, RobotLine};
use super::summary::{Latency, RobotSummary, Summary};
use crate::decode::stamped_pose;
use trajectory::{Alignment, StampedPose, Trajectory, ate_rmse_m};

/// Longest wait for connections, and for the last samples to be durable.
const TIMEOUT: Duration = Duration::from_secs(20);
/// Pause between two looks at the service, as an operator's screen would take them.
const LOOK_INTERVAL: Duration = Duration::from_millis(200);

/// A simulated team and its connections.
pub(super) struct DemoTeam {
    team: Team,
    session: Session,
    space: String,
    robots: Vec<DemoRobot>,
    localise: Latency,
    recall: Latency,
}

struct DemoRobot {
    name: String,
    client: Robot,
    reckoning: DeadReckoning,
    reckoned: Vec<StampedPose>,
    truth: Vec<StampedPose>,
    sent: u64,
}

impl DemoTeam {
    pub(super) fn connect(
        endpoint: &str,
        space: &str,
        robots: u32,
        seed: u64,
    ) -> anyhow::Result<Self> {
        let now = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .context("read the clock")?;
        let epoch_ns = i64::try_from(now.as_nanos()).context("read the clock")?;
        let settings = TeamSettings {
            seed,
            n_robots: robots,
            epoch_ns,
            ..TeamSettings::default()
        };
        let team = Team::new(ObstacleWorld::new(seed), settings)?;
        let session = open_session(&[endpoint], TIMEOUT)?;
        let robots = (1..=robots)
            .map(|number| {
                let name = robot_name(number);
                let client = Robot::builder(space, &name)
                    .zenoh_session(session.clone())
                    .connect()?;
                Ok(DemoRobot {
                    name,
                    client,
                    reckoning: DeadReckoning::default(),
                    reckoned: Vec::new(),
                    truth: Vec::new(),
                    sent: 0,
                })
            })
            .collect::<anyhow::Result<_>>()?;
        let (localise, recall) = (Latency::default(), Latency::default());
        Ok(Self {
            team,
            session,
            space: space.to_owned(),
            robots,
            localise,
            recall,
        })
    }

    /// Drives in real time until the time is over or `stop` is set.
    pub(super) fn drive(
        &mut self,
        duration: Duration,
        stop: &Stop,
        api: &Api,
        progress: &Progress,
    ) -> anyhow::Result<()> {
        let tick = Duration::from_secs_f64(1.0 / self.team.settings().rate_hz);
        let start = Instant::now();
        let (mut due, mut next_look, mut looked_at) = (start, start, 0);
        while start.elapsed() < duration && !stop.load(Ordering::Relaxed) {
            for of_robot in self.team.tick() {
                let robot = &mut self.robots[of_robot.robot as usize - 1];
                robot.truth.push(of_robot.truth);
                let mut samples = Vec::with_capacity(of_robot.readings.len());
                for reading in &of_robot.readings {
                    robot.reckoned.extend(robot.reckoning.apply(reading)?);
                    samples.push(Sample::from(reading));
                }
                robot.sent += samples.len() as u64;
                if !samples.is_empty() {
                    robot.client.send_batch(samples)?;
                }
            }
            if Instant::now() >= next_look {
                self.look(api, looked_at)?;
                looked_at = (looked_at + 1) % self.robots.len();
                next_look = Instant::now() + LOOK_INTERVAL;
                progress.show(start.elapsed(), &self.lines());
            }
            due += tick;
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        }
        Ok(())
    }

    /// Asks where a robot is, and which places are near it, and notes how long that took.
    fn look(&mut self, api: &Api, at: usize) -> anyhow::Result<()> {
        let name = &self.robots[at].name;
        let start = Instant::now();
        let Ok(agent) = api.agent(&self.space, name) else {
            return Ok(()); // its first samples are still on their way
        };
        self.localise.note(start.elapsed());
        let Some(estimate) = agent.estimate else {
            return Ok(());
        };
        let query = RecallQuery {
            position_m: Some(estimate.translation_m),
            ..RecallQuery::default()
        };
        let start = Instant::now();
        api.recall(&self.space, &query)?;
        self.recall.note(start.elapsed());
        Ok(())
    }

    fn lines(&self) -> Vec<RobotLine> {
        self.robots
            .iter()
            .map(|robot| {
                let estimate = robot.client.latest_estimate();
                let error_m = estimate
                    .as_ref()
                    .zip(robot.truth.last())
                    .map(|(estimate, truth)| {
                        let estimated = nalgebra::Vector3::from(estimate.translation_m);
                        (estimated - truth.pose.translation.vector).norm()
                    });
                RobotLine {
                    name: robot.name.clone(),
                    sent: robot.sent,
                    pending: robot.client.pending(),
                    estimate,
                    error_m,
                }
            })
            .collect()
    }

    /// Waits until everything is durable, and sums up.
    pub(super) fn finish(self, api: &Api) -> anyhow::Result<Summary> {
        let mut robots = Vec::new();
        let (mut sent, mut durable, mut applied, mut resent) = (0, 0, 0, 0);
        for robot in self.robots {
            robot.client.flush(TIMEOUT)?;
            let agent = api.agent(&self.space, &robot.name)?;
            sent += robot.sent;
            applied += agent.watermark.applied;
            durable += agent.watermark.durable;
            resent += robot.client.counters().samples_resent;
            let trajectory = api.trajectory(&self.space, &robot.name)?;
            let causal: Vec<_> = trajectory.poses.iter().map(stamped_pose).collect();
            let truth = Trajectory::from_poses(&robot.truth)?;
            let error = |poses: &[StampedPose]| -> anyhow::Result<f64> {
                let estimate = Trajectory::from_poses(poses)?;
                Ok(ate_rmse_m(
                    &estimate,
                    &truth,
                    truth.span(),
                    Alignment::None,
                )?)
            };
            robots.push(RobotSummary {
                dead_reckoning_ate_rmse_m: error(&robot.reckoned)?,
                causal_ate_rmse_m: error(&causal)?,
                samples: robot.sent,
                name: robot.name,
            });
            robot.client.close(TIMEOUT)?;
        }
        let info = api.space(&self.space)?;
        self.session
            .close()
            .wait()
            .map_err(anyhow::Error::from_boxed)?;
        let mean = |of: fn(&RobotSummary) -> f64| {
            robots.iter().map(of).sum::<f64>() / robots.len().max(1) as f64
        };
        Ok(Summary {
            samples_sent: sent,
            samples_applied: applied,
            samples_durable: durable,
            samples_resent: resent,
            duplicates: None,
            dead_reckoning_ate_rmse_m: mean(|robot| robot.dead_reckoning_ate_rmse_m),
            causal_ate_rmse_m: mean(|robot| robot.causal_ate_rmse_m),
            places: info.places,
            trips: info.trips,
            landmarks: info.landmarks,
            localise: self.localise.summary(),
            recall: self.recall.summary(),
            digest: info.digest,
            robots,
        })
    }
}
