//! `cogmap-lab replay mrclam`.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use cogmap_lab::mrclam::{Mrclam, PlanarPose, TeamReading};
use cogmap_proto::Sample;
use cogmap_worlds::{ReadingBody, ReadingTarget, dead_reckoned, robot_name};
use trajectory::Alignment;

use super::arguments::{ReplayArgs, share};
use super::case::Case;
use super::scoring::{Pairing, Scoring};
use super::team::{Known, Team};

#[derive(Debug, Args)]
pub(in crate::cli) struct MrclamArgs {
    /// Directory of the data set.
    directory: PathBuf,
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
    /// Give this share of the sightings another name, at random, as if a barcode had been misread.
    #[arg(long, value_name = "SHARE", value_parser = share)]
    false_names: Option<f64>,
    /// Seed of which ones.
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    false_names_seed: u64,
    #[command(flatten)]
    replay: ReplayArgs,
}

pub(super) fn run(args: &MrclamArgs) -> anyhow::Result<()> {
    let mut set = Mrclam::load(&args.directory)
        .with_context(|| format!("read {}", args.directory.display()))?;
    if let Some(share) = args.false_names {
        set.confuse(share, args.false_names_seed);
    }
    for robot in &args.anonymous {
        anyhow::ensure!(
            set.robots().contains_key(robot),
            "the set has no robot {robot}"
        );
    }
    let start_pose = if args.unknown_starts {
        "from the truth for the first robot, none for the others"
    } else {
        "from the truth"
    };
    let case = Case {
        start_pose,
        teams: vec![team(&set, args)?],
        scoring: Scoring {
            pairing: Pairing::Grid(set.span()),
            alignment: Alignment::Planar,
            is_recorded: true,
        },
    };
    case.show(&args.replay)
}

/// The team's samples by stamp, and where its robots were.
fn team(set: &Mrclam, args: &MrclamArgs) -> anyhow::Result<Team> {
    let first = set.robots().keys().next().copied();
    let is_asked_for = |entry: &TeamReading| match &entry.reading.body {
        ReadingBody::StartPose { .. } => !args.unknown_starts || Some(entry.robot) == first,
        ReadingBody::Sighting {
            target: ReadingTarget::Robot(_),
            ..
        } => !args.no_robot_sightings,
        _ => true,
    };
    let readings = set.team_readings().into_iter().filter(is_asked_for);
    let samples = readings.map(|mut reading| {
        if args.anonymous.contains(&reading.robot) {
            reading = reading.with_own_names();
        }
        let sample = Sample::from(&reading.reading);
        (robot_name(reading.robot), sample)
    });
    let space = args.replay.space("mrclam");
    let mut team = Team::new(space, samples, args.replay.batch());
    for (&number, log) in set.robots() {
        let known = Known {
            reckoned: dead_reckoned(&set.robot_readings(number))?,
            truth: Some(log.truth_trajectory()),
            true_poses: log.truth().iter().map(PlanarPose::in_space).collect(),
        };
        team.robots.insert(robot_name(number), known);
    }
    Ok(team)
}
