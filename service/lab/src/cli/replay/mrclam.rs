//! `cogmap-lab replay mrclam`.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use cogmap_lab::mapping;
use cogmap_lab::mrclam::{Mrclam, PlanarPose, TeamReading};
use cogmap_proto::limits::BATCH_SAMPLES_MAX;
use cogmap_proto::{Sample, SpaceSettings};
use cogmap_worlds::dead_reckoned;
use cogmap_worlds::{ReadingBody, ReadingTarget, robot_name};
use trajectory::StampedPose;
use trajectory::write_tum;

use super::mrclam_report::report;
use super::outcome::Outcome;
use super::team_batch::TeamBatch;
use super::{offline, online};
use cogmap::cli::output;
use cogmap::decode::stamped_pose;

#[derive(Debug, Args)]
#[allow(
    clippy::struct_excessive_bools,
    reason = "each is a switch of the command line"
)]
pub(in crate::cli) struct MrclamArgs {
    /// Directory of the data set.
    directory: PathBuf,
    /// Write `robotN.causal.tum` and `robotN.refined.tum` for each robot into this directory.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Draw each robot's paths, seen from above, as `robotN.paths.svg` beside them.
    #[arg(long, requires = "out")]
    plot: bool,
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
    /// Leave out what the robots saw of one another.
    #[arg(long)]
    no_robot_sightings: bool,
    /// Tell only the first robot where it starts; the others have to find their place.
    #[arg(long)]
    unknown_starts: bool,
    /// Robots that call landmarks by names of their own, by number; where they start is then told
    /// by geometry, and by what robots see of one another.
    #[arg(long, value_name = "N,N", value_delimiter = ',')]
    anonymous: Vec<u32>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &MrclamArgs) -> anyhow::Result<()> {
    let set = Mrclam::load(&args.directory)?;
    for robot in &args.anonymous {
        anyhow::ensure!(
            set.robots().contains_key(robot),
            "the set has no robot {robot}"
        );
    }
    let batches = batches(&set, args);
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
        if args.plot {
            draw(directory, &set, &outcome)?;
        }
    }
    let report = report(&set, &batches, &outcome)?;
    if args.json {
        output::json(&report)
    } else {
        report.print()
    }
}

/// The team's samples by stamp, cut where the robot changes and after the most samples of a batch.
fn batches(set: &Mrclam, args: &MrclamArgs) -> Vec<TeamBatch> {
    let most = usize::from(args.batch).min(BATCH_SAMPLES_MAX);
    let first = set.robots().keys().next().copied();
    let is_asked_for = |entry: &TeamReading| match &entry.reading.body {
        ReadingBody::StartPose { .. } => !args.unknown_starts || Some(entry.robot) == first,
        ReadingBody::Sighting {
            target: ReadingTarget::Robot(_),
            ..
        } => !args.no_robot_sightings,
        _ => true,
    };
    let mut batches: Vec<TeamBatch> = Vec::new();
    for mut reading in set.team_readings().into_iter().filter(is_asked_for) {
        if args.anonymous.contains(&reading.robot) {
            reading = reading.with_own_names();
        }
        let robot = robot_name(reading.robot);
        let sample = Sample::from(&reading.reading);
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
    for (robot, came_out) in &outcome.robots {
        for (kind, rows) in [("causal", &came_out.causal), ("refined", &came_out.refined)] {
            let file = directory.join(format!("{robot}.{kind}.tum"));
            let poses: Vec<_> = rows.iter().map(stamped_pose).collect();
            std::fs::write(&file, write_tum(&poses))
                .with_context(|| format!("write {}", file.display()))?;
        }
    }
    Ok(())
}

/// Draws the paths of each robot in the frame of the truth, none of them moved.
fn draw(directory: &Path, set: &Mrclam, outcome: &Outcome) -> anyhow::Result<()> {
    let path = |label: &str, poses: &[StampedPose]| mapping::Path {
        label: label.to_owned(),
        positions_m: poses
            .iter()
            .map(|pose| pose.pose.translation.vector)
            .collect(),
    };
    for (&number, log) in set.robots() {
        let robot = robot_name(number);
        let Some(came_out) = outcome.robots.get(&robot) else {
            continue;
        };
        let of_kind =
            |rows: &[cogmap_proto::StampedPose]| rows.iter().map(stamped_pose).collect::<Vec<_>>();
        let paths = [
            path(
                "dead reckoning",
                &dead_reckoned(&set.robot_readings(number))?,
            ),
            path("causal", &of_kind(&came_out.causal)),
            path("refined", &of_kind(&came_out.refined)),
        ];
        let truth: Vec<_> = log.truth().iter().map(PlanarPose::in_space).collect();
        let subtitle = "as estimated, in the frame of the truth, seen from above";
        let figure = mapping::figure(&robot, subtitle, &paths, Some(&path("truth", &truth)), &[])?;
        let file = directory.join(format!("{robot}.paths.svg"));
        std::fs::write(&file, figure.svg).with_context(|| format!("write {}", file.display()))?;
    }
    Ok(())
}
