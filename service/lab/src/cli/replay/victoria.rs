//! `cogmap-lab replay victoria`.

use std::path::PathBuf;

use clap::Args;
use cogmap_lab::victoria::Victoria;
use trajectory::Alignment;

use super::recorded::{self, Case, RecordedArgs, Truth};

#[derive(Debug, Args)]
pub(in crate::cli) struct VictoriaArgs {
    /// The file `victoria_park.txt` as it comes with GTSAM and iSAM (lines ODOMETRY and LANDMARK,
    /// with covariances), or the directory that holds it. The original MATLAB files (`aa3_dr.mat`,
    /// `aa3_lsr2.mat`, `aa3_gpsx.mat`) are not read, so there is no GPS to compare with and no
    /// time. A graph in g2o form goes to `cogmap-lab replay g2o`.
    path: PathBuf,
    #[command(flatten)]
    recorded: RecordedArgs,
}

pub(super) fn run(args: &VictoriaArgs) -> anyhow::Result<()> {
    let set = Victoria::load(&args.path)?;
    let case = Case {
        title: "Victoria Park".to_owned(),
        recording: &set.recording(),
        truth: Truth::Unknown,
        alignment: Alignment::Planar,
        has_time: false,
        false_share: None,
    };
    recorded::run(&case, &args.recorded)
}
