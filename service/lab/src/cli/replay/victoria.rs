//! `cogmap-lab replay victoria`.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use cogmap_lab::reference::Reference;
use cogmap_lab::victoria::Victoria;
use trajectory::Alignment;

use super::arguments::ReplayArgs;
use super::case::Case;
use super::known::of_stream;
use super::scoring::{Pairing, Scoring};
use super::team::{ROBOT, Team};

#[derive(Debug, Args)]
pub(in crate::cli) struct VictoriaArgs {
    /// The file `victoria_park.txt` as it comes with GTSAM and iSAM (lines ODOMETRY and LANDMARK,
    /// with covariances), or the directory that holds it. The original MATLAB files (`aa3_dr.mat`,
    /// `aa3_lsr2.mat`, `aa3_gpsx.mat`) are not read, so there is no time. A graph in g2o form goes
    /// to `cogmap-lab replay g2o`.
    path: PathBuf,
    /// Where the poses are known to lie: number, x and y in columns. Without it there are no
    /// errors.
    #[arg(long, value_name = "FILE")]
    reference: Option<PathBuf>,
    #[command(flatten)]
    replay: ReplayArgs,
}

pub(super) fn run(args: &VictoriaArgs) -> anyhow::Result<()> {
    let set = Victoria::load(&args.path)?;
    let stream = set.stream();
    let known = match &args.reference {
        None => None,
        Some(file) => {
            let text = std::fs::read_to_string(file)
                .with_context(|| format!("read {}", file.display()))?;
            let shown = || file.display().to_string();
            let reference = Reference::read(&text).with_context(shown)?;
            Some(of_stream(
                &stream,
                &reference.of(set.poses()).with_context(shown)?,
            )?)
        }
    };
    let space = args.replay.space("victoria");
    let case = Case {
        start_pose: "none",
        teams: vec![Team::alone(
            space,
            ROBOT,
            &stream,
            known,
            args.replay.batch(),
        )],
        scoring: Scoring {
            pairing: Pairing::Own,
            alignment: Alignment::Planar,
            is_recorded: false,
        },
    };
    case.show(&args.replay)
}
