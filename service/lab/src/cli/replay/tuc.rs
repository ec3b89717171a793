//! `cogmap-lab replay tuc`.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use cogmap::cli::output;
use cogmap_lab::tuc::{Motion, Tuc};
use serde::Serialize;
use trajectory::{Alignment, Span};

use super::arguments::{ReplayArgs, share};
use super::case::Case;
use super::report::Report;
use super::scoring::{Pairing, Scoring};
use super::team::{ROBOT, Team};

#[derive(Debug, Args)]
pub(in crate::cli) struct TucArgs {
    /// Directory of the data set, with files `*_Input.txt` (odom2 and loop lines) and `*_GT.txt`
    /// (point2 and angle lines).
    directory: PathBuf,
    /// Send all place matches, also those of moments less than ten seconds apart.
    #[arg(long)]
    all: bool,
    /// Add false matches between random moments until they make up this share of all, from 0 to
    /// below 1.
    #[arg(long, value_name = "SHARE", value_parser = share)]
    add_false: Option<f64>,
    /// Seed of the false matches.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Send velocities without noise, as a robot that knows nothing of its odometry, instead of
    /// increments with the noise that the set states.
    #[arg(long)]
    unstated_noise: bool,
    #[command(flatten)]
    replay: ReplayArgs,
}

/// What a replay shows, and what the robot was told.
#[derive(Debug, Serialize)]
struct TucReport {
    /// Place matches that were sent.
    matches: usize,
    /// Share of them that is false by the truth.
    false_share: Option<f64>,
    #[serde(flatten)]
    report: Report,
}

pub(super) fn run(args: &TucArgs) -> anyhow::Result<()> {
    let set = Tuc::load(&args.directory)?;
    let mut matches = if args.all {
        set.matches().to_vec()
    } else {
        set.distant_matches()
    };
    if let Some(share) = args.add_false {
        set.add_false(&mut matches, share, args.seed);
    }
    let n_true = matches.iter().filter(|found| set.is_true(found)).count();
    let n = matches.len();
    let motion = if args.unstated_noise {
        Motion::UnstatedNoise
    } else {
        Motion::StatedNoise
    };
    let stream = set.stream(&matches, motion);
    let steps = [set.steps().first(), set.steps().last()];
    let [Some(first), Some(last)] = steps.map(|step| step.map(|step| step.stamp_ns)) else {
        anyhow::bail!("there is no odometry")
    };
    let recorded = Span {
        start_ns: first,
        end_ns: last,
    };
    let span = Span::common([recorded, set.truth().span()]);
    let span = span.context("odometry and truth have no time in common")?;
    let truth = Some(set.truth().clone());
    let space = args.replay.space("tuc");
    let case = Case {
        start_pose: "from the truth",
        teams: vec![Team::alone(
            space,
            ROBOT,
            &stream,
            truth,
            args.replay.batch(),
        )],
        scoring: Scoring {
            pairing: Pairing::Grid(span),
            alignment: Alignment::Planar,
            is_recorded: true,
        },
    };
    let report = TucReport {
        matches: n,
        false_share: (n > 0).then(|| (n - n_true) as f64 / n as f64),
        report: case.run(&args.replay)?,
    };
    if args.replay.json {
        return output::json(&report);
    }
    let share = 100.0 * report.false_share.unwrap_or(0.0);
    output::line(&format!("{n} place matches, {share:.1} % of them false"))?;
    report.report.print()
}
