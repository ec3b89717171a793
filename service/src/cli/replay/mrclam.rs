//! `cogmap replay mrclam`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use cogmap_experiments::metrics::{Alignment, Trajectory, ate_rmse_m, dead_reckoned};
use cogmap_experiments::mrclam::{Mrclam, PlanarPose};
use cogmap_experiments::reading::robot_name;
use cogmap_experiments::tum::write_tum;
use cogmap_proto::limits::BATCH_SAMPLES_MAX;
use cogmap_proto::{Sample, SpaceSettings, StampedPose};
use serde::Serialize;

use super::{offline, online, sample_of};
use crate::cli::export::pose;
use crate::cli::output;

#[derive(Debug, Args)]
pub(in crate::cli) struct MrclamArgs {
    /// Directory of the data set.
    directory: PathBuf,
    /// Write `robotN.causal.tum` for each robot into this directory.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Send the samples through Zenoh to the service at this endpoint, and read the result over
    /// HTTP, instead of straight into the core.
    #[arg(long, value_name = "ENDPOINT", requires = "http")]
    connect: Option<String>,
    /// Base of the service's HTTP interface.
    #[arg(long, value_name = "URL")]
    http: Option<String>,
    /// Bearer token of the service's HTTP interface.
    #[arg(
        long,
        env = "COGMAP_TOKEN",
        value_name = "TOKEN",
        hide_env_values = true
    )]
    token: Option<String>,
    /// Space that is created for the replay; it must not exist.
    #[arg(long, default_value = "mrclam")]
    space: String,
    /// Most samples of a batch. Changes nothing but the number of messages.
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u16).range(1..=4096))]
    batch: u16,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// Consecutive samples of one robot, in the order in which the team sends.
#[derive(Clone, Debug)]
pub(super) struct TeamBatch {
    pub(super) robot: String,
    pub(super) samples: Vec<Sample>,
}

/// What came out of a replay.
#[derive(Debug)]
pub(super) struct Outcome {
    /// Causal trajectory of each robot, by name.
    pub(super) trajectories: BTreeMap<String, Vec<StampedPose>>,
    pub(super) samples: u64,
    pub(super) digest: String,
    pub(super) places: u64,
    pub(super) trips: u64,
    pub(super) landmarks: u64,
}

#[derive(Debug, Serialize)]
struct Report {
    samples: u64,
    digest: String,
    places: u64,
    trips: u64,
    landmarks: u64,
    dead_reckoning_ate_rmse_m: f64,
    dead_reckoning_aligned_ate_rmse_m: f64,
    causal_ate_rmse_m: f64,
    causal_aligned_ate_rmse_m: f64,
    robots: BTreeMap<String, RobotReport>,
}

/// Errors of one robot: RMSE of position on a 10 Hz grid over the common span, in the frame of the
/// truth, and after the best rigid motion in the plane.
#[derive(Debug, Serialize)]
struct RobotReport {
    samples: u64,
    dead_reckoning_ate_rmse_m: f64,
    dead_reckoning_aligned_ate_rmse_m: f64,
    causal_ate_rmse_m: f64,
    causal_aligned_ate_rmse_m: f64,
}

pub(super) fn run(args: &MrclamArgs) -> anyhow::Result<()> {
    let set = Mrclam::load(&args.directory)?;
    let batches = batches(&set, usize::from(args.batch).min(BATCH_SAMPLES_MAX));
    let settings = SpaceSettings::default();
    let outcome = match (&args.connect, &args.http) {
        (Some(endpoint), Some(http)) => {
            let service = online::Target {
                endpoint,
                http,
                token: args.token.as_deref(),
                space: &args.space,
            };
            online::replay(&batches, &settings, &service)?
        }
        _ => offline::replay(&batches, &settings)?,
    };
    if let Some(directory) = &args.out {
        write_trajectories(directory, &outcome)?;
    }
    let report = report(&set, &batches, &outcome)?;
    if args.json {
        output::json(&report)
    } else {
        print(&report)
    }
}

/// The team's samples by stamp, cut where the robot changes and after `most` samples.
fn batches(set: &Mrclam, most: usize) -> Vec<TeamBatch> {
    let mut batches: Vec<TeamBatch> = Vec::new();
    for reading in set.team_readings() {
        let robot = robot_name(reading.robot);
        let sample = sample_of(&reading.reading);
        match batches.last_mut() {
            Some(last) if last.robot == robot && last.samples.len() < most => {
                last.samples.push(sample);
            }
            _ => batches.push(TeamBatch {
                robot,
                samples: vec![sample],
            }),
        }
    }
    batches
}

fn write_trajectories(directory: &Path, outcome: &Outcome) -> anyhow::Result<()> {
    std::fs::create_dir_all(directory)
        .with_context(|| format!("create {}", directory.display()))?;
    for (robot, rows) in &outcome.trajectories {
        let file = directory.join(format!("{robot}.causal.tum"));
        let poses: Vec<_> = rows.iter().map(pose).collect();
        std::fs::write(&file, write_tum(&poses))
            .with_context(|| format!("write {}", file.display()))?;
    }
    Ok(())
}

fn report(set: &Mrclam, batches: &[TeamBatch], outcome: &Outcome) -> anyhow::Result<Report> {
    let span = set.span();
    let mut robots = BTreeMap::new();
    for (&number, log) in set.robots() {
        let name = robot_name(number);
        let truth: Vec<_> = log.truth().iter().map(PlanarPose::in_space).collect();
        let truth = Trajectory::from_poses(&truth)?;
        let reckoned = Trajectory::from_poses(&dead_reckoned(&set.robot_readings(number))?)?;
        let rows = outcome
            .trajectories
            .get(&name)
            .map(Vec::as_slice)
            .unwrap_or_default();
        let causal: Vec<_> = rows.iter().map(pose).collect();
        let causal = Trajectory::from_poses(&causal)?;
        let error = |estimate, alignment| ate_rmse_m(estimate, &truth, span, alignment);
        let of_robot = batches.iter().filter(|batch| batch.robot == name);
        let robot = RobotReport {
            samples: of_robot.map(|batch| batch.samples.len() as u64).sum(),
            dead_reckoning_ate_rmse_m: error(&reckoned, Alignment::None)?,
            dead_reckoning_aligned_ate_rmse_m: error(&reckoned, Alignment::Planar)?,
            causal_ate_rmse_m: error(&causal, Alignment::None)?,
            causal_aligned_ate_rmse_m: error(&causal, Alignment::Planar)?,
        };
        robots.insert(name, robot);
    }
    let mean = |of: fn(&RobotReport) -> f64| {
        robots.values().map(of).sum::<f64>() / robots.len().max(1) as f64
    };
    Ok(Report {
        samples: outcome.samples,
        digest: outcome.digest.clone(),
        places: outcome.places,
        trips: outcome.trips,
        landmarks: outcome.landmarks,
        dead_reckoning_ate_rmse_m: mean(|robot| robot.dead_reckoning_ate_rmse_m),
        dead_reckoning_aligned_ate_rmse_m: mean(|robot| robot.dead_reckoning_aligned_ate_rmse_m),
        causal_ate_rmse_m: mean(|robot| robot.causal_ate_rmse_m),
        causal_aligned_ate_rmse_m: mean(|robot| robot.causal_aligned_ate_rmse_m),
        robots,
    })
}

fn print(report: &Report) -> anyhow::Result<()> {
    output::line("robot      samples   dead reckoning [m]    causal [m]")?;
    output::line("                     plain    aligned       plain    aligned")?;
    for (name, robot) in &report.robots {
        output::line(&format!(
            "{name:<9} {:>8}   {:>7.3}  {:>7.3}     {:>7.3}  {:>7.3}",
            robot.samples,
            robot.dead_reckoning_ate_rmse_m,
            robot.dead_reckoning_aligned_ate_rmse_m,
            robot.causal_ate_rmse_m,
            robot.causal_aligned_ate_rmse_m,
        ))?;
    }
    output::line(&format!(
        "mean      {:>8}   {:>7.3}  {:>7.3}     {:>7.3}  {:>7.3}",
        report.samples,
        report.dead_reckoning_ate_rmse_m,
        report.dead_reckoning_aligned_ate_rmse_m,
        report.causal_ate_rmse_m,
        report.causal_aligned_ate_rmse_m,
    ))?;
    output::line(&format!(
        "{} places, {} trips, {} landmarks, digest {}",
        report.places, report.trips, report.landmarks, report.digest
    ))?;
    Ok(())
}
