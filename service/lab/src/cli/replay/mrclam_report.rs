//! The errors of a replayed team.

use std::collections::BTreeMap;

use cogmap_lab::mrclam::{Mrclam, PlanarPose, RobotLog};
use cogmap_lab::nees::{Nees, NeesMeans};
use cogmap_proto::StampedPose;
use cogmap_worlds::dead_reckoned;
use cogmap_worlds::robot_name;
use serde::Serialize;
use trajectory::{Alignment, Trajectory, ate_rmse_m};

use super::outcome::{Outcome, RobotOutcome, Timing};
use super::team_batch::TeamBatch;
use cogmap::cli::output;
use cogmap::decode::stamped_pose;

/// What a replay shows. Errors are means over the robots, of those that found their place in the
/// map.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    samples: u64,
    digest: String,
    places: u64,
    trips: u64,
    landmarks: u64,
    dead_reckoning_ate_rmse_m: f64,
    dead_reckoning_aligned_ate_rmse_m: f64,
    causal_ate_rmse_m: Option<f64>,
    causal_aligned_ate_rmse_m: Option<f64>,
    refined_ate_rmse_m: Option<f64>,
    refined_aligned_ate_rmse_m: Option<f64>,
    /// Sightings of landmarks and of robots that counted, and that were refused.
    accepted: u64,
    rejected: u64,
    consistency: Consistency,
    /// Of a replay straight into the core: times that samples took \[ms\].
    update_ms: Option<Timing>,
    /// Recorded time over the time that it took in the core.
    real_time_factor: Option<f64>,
    robots: BTreeMap<String, RobotReport>,
}

/// Errors of one robot: RMSE of position on a 10 Hz grid over the common span, in the frame of the
/// truth, and after the best rigid motion in the plane. None for a robot that never found its
/// place.
#[derive(Debug, Serialize)]
struct RobotReport {
    samples: u64,
    dead_reckoning_ate_rmse_m: f64,
    dead_reckoning_aligned_ate_rmse_m: f64,
    causal_ate_rmse_m: Option<f64>,
    causal_aligned_ate_rmse_m: Option<f64>,
    refined_ate_rmse_m: Option<f64>,
    refined_aligned_ate_rmse_m: Option<f64>,
    /// When it found its place \[s\] after the start.
    placed_after_s: Option<f64>,
    accepted: u64,
    rejected: u64,
    consistency: Consistency,
}

/// How honest the covariances are: both are 1 where they are, and more where they are too small.
#[derive(Clone, Copy, Debug, Serialize)]
struct Consistency {
    /// Normalised estimation error squared of the position in the plane, per component, once a
    /// second (of a replay straight into the core).
    nees_mean: Option<f64>,
    /// The same of x, y and heading each by itself, of the position and of the pose in the plane.
    nees: Option<NeesMeans>,
    /// Normalised innovation squared of the accepted sightings, per component.
    nis_mean: Option<f64>,
}

/// Compares what came out with the truth.
pub(super) fn report(
    set: &Mrclam,
    batches: &[TeamBatch],
    outcome: &Outcome,
) -> anyhow::Result<Report> {
    let mut robots = BTreeMap::new();
    let mut nees = Nees::default();
    let nothing = RobotOutcome::default();
    for (&number, log) in set.robots() {
        let name = robot_name(number);
        let of_robot = batches.iter().filter(|batch| batch.robot == name);
        let samples = of_robot.map(|batch| batch.samples.len() as u64).sum();
        let came_out = outcome.robots.get(&name).unwrap_or(&nothing);
        nees.add_all(&normalised_errors(log, came_out));
        robots.insert(name, robot_report(set, number, log, samples, came_out)?);
    }
    let span_s = (set.span().end_ns - set.span().start_ns) as f64 * 1e-9;
    let of = |value: fn(&RobotReport) -> Option<f64>| mean(robots.values().filter_map(value));
    Ok(Report {
        samples: outcome.samples,
        digest: outcome.digest.clone(),
        places: outcome.places,
        trips: outcome.trips,
        landmarks: outcome.landmarks,
        dead_reckoning_ate_rmse_m: of(|robot| Some(robot.dead_reckoning_ate_rmse_m)).unwrap_or(0.0),
        dead_reckoning_aligned_ate_rmse_m: of(|robot| {
            Some(robot.dead_reckoning_aligned_ate_rmse_m)
        })
        .unwrap_or(0.0),
        causal_ate_rmse_m: of(|robot| robot.causal_ate_rmse_m),
        causal_aligned_ate_rmse_m: of(|robot| robot.causal_aligned_ate_rmse_m),
        refined_ate_rmse_m: of(|robot| robot.refined_ate_rmse_m),
        refined_aligned_ate_rmse_m: of(|robot| robot.refined_aligned_ate_rmse_m),
        accepted: robots.values().map(|robot| robot.accepted).sum(),
        rejected: robots.values().map(|robot| robot.rejected).sum(),
        consistency: Consistency {
            nees_mean: of(|robot| robot.consistency.nees_mean),
            nees: nees.means(),
            nis_mean: of(|robot| robot.consistency.nis_mean),
        },
        update_ms: outcome.timing,
        real_time_factor: outcome.timing.map(|timing| span_s / timing.total_s),
        robots,
    })
}

fn robot_report(
    set: &Mrclam,
    number: u32,
    log: &RobotLog,
    samples: u64,
    came_out: &RobotOutcome,
) -> anyhow::Result<RobotReport> {
    let span = set.span();
    let truth: Vec<_> = log.truth().iter().map(PlanarPose::in_space).collect();
    let truth = Trajectory::from_poses(&truth)?;
    let reckoned = Trajectory::from_poses(&dead_reckoned(&set.robot_readings(number))?)?;
    let error = |estimate: &Trajectory, alignment| ate_rmse_m(estimate, &truth, span, alignment);
    // Plain and aligned; none of a robot that never found its place.
    let errors = |rows: &[StampedPose]| -> anyhow::Result<Option<(f64, f64)>> {
        if rows.is_empty() {
            return Ok(None);
        }
        let estimate = Trajectory::from_poses(&rows.iter().map(stamped_pose).collect::<Vec<_>>())?;
        let plain = error(&estimate, Alignment::None)?;
        Ok(Some((plain, error(&estimate, Alignment::Planar)?)))
    };
    let (causal, refined) = (errors(&came_out.causal)?, errors(&came_out.refined)?);
    let first = came_out.causal.first();
    let nees = normalised_errors(log, came_out).means();
    Ok(RobotReport {
        samples,
        dead_reckoning_ate_rmse_m: error(&reckoned, Alignment::None)?,
        dead_reckoning_aligned_ate_rmse_m: error(&reckoned, Alignment::Planar)?,
        causal_ate_rmse_m: causal.map(|(plain, _)| plain),
        causal_aligned_ate_rmse_m: causal.map(|(_, aligned)| aligned),
        refined_ate_rmse_m: refined.map(|(plain, _)| plain),
        refined_aligned_ate_rmse_m: refined.map(|(_, aligned)| aligned),
        placed_after_s: first.map(|first| (first.stamp_ns - span.start_ns) as f64 * 1e-9),
        accepted: came_out.evidence.accepted,
        rejected: came_out.evidence.refused,
        consistency: Consistency {
            nees_mean: nees.map(|nees| nees.position),
            nees,
            nis_mean: came_out.evidence.nis_mean,
        },
    })
}

/// The robot's errors in their deviations.
fn normalised_errors(log: &RobotLog, came_out: &RobotOutcome) -> Nees {
    let mut nees = Nees::default();
    for (belief, covariance) in &came_out.beliefs {
        if let Some(truth) = log.truth_at(belief.stamp_ns) {
            nees.add(
                &truth.in_space().pose,
                &stamped_pose(belief).pose,
                covariance,
            );
        }
    }
    nees
}

/// Mean; none of nothing.
fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0u32);
    for value in values {
        sum += value;
        count += 1;
    }
    (count > 0).then(|| sum / f64::from(count))
}

impl Report {
    /// As text.
    pub(super) fn print(&self) -> anyhow::Result<()> {
        let metres = |value: Option<f64>| match value {
            Some(value) => format!("{value:7.3}"),
            None => "  never".to_owned(),
        };
        output::line(
            "robot      samples   dead reckoning [m]    causal [m]            refined [m]",
        )?;
        output::line(
            "                     plain    aligned       plain    aligned      plain    aligned",
        )?;
        for (name, robot) in &self.robots {
            output::line(&format!(
                "{name:<9} {:>8}   {:>7.3}  {:>7.3}     {}  {}    {}  {}",
                robot.samples,
                robot.dead_reckoning_ate_rmse_m,
                robot.dead_reckoning_aligned_ate_rmse_m,
                metres(robot.causal_ate_rmse_m),
                metres(robot.causal_aligned_ate_rmse_m),
                metres(robot.refined_ate_rmse_m),
                metres(robot.refined_aligned_ate_rmse_m),
            ))?;
        }
        output::line(&format!(
            "mean      {:>8}   {:>7.3}  {:>7.3}     {}  {}    {}  {}",
            self.samples,
            self.dead_reckoning_ate_rmse_m,
            self.dead_reckoning_aligned_ate_rmse_m,
            metres(self.causal_ate_rmse_m),
            metres(self.causal_aligned_ate_rmse_m),
            metres(self.refined_ate_rmse_m),
            metres(self.refined_aligned_ate_rmse_m),
        ))?;
        output::line(&format!(
            "{} sightings accepted, {} refused; squared errors over expected: {} of poses, {} of sightings",
            self.accepted,
            self.rejected,
            ratio(self.consistency.nees_mean),
            ratio(self.consistency.nis_mean),
        ))?;
        if let Some(nees) = self.consistency.nees {
            output::line(&format!(
                "of poses: x {:.2}, y {:.2}, heading {:.2}, position {:.2}, all three {:.2}",
                nees.x, nees.y, nees.heading, nees.position, nees.pose,
            ))?;
        }
        if let (Some(timing), Some(factor)) = (self.update_ms, self.real_time_factor) {
            output::line(&format!(
                "{factor:.0} times real time; a sample p50 {:.1} us, p99 {:.1} us, max {:.1} ms",
                timing.p50 * 1e3,
                timing.p99 * 1e3,
                timing.max,
            ))?;
        }
        output::line(&format!(
            "{} places, {} trips, {} landmarks, digest {}",
            self.places, self.trips, self.landmarks, self.digest
        ))?;
        Ok(())
    }
}

fn ratio(value: Option<f64>) -> String {
    value.map_or("none".to_owned(), |value| format!("{value:.2}"))
}
