//! `cogmap-lab replay tuc`.

use std::path::PathBuf;

use clap::Args;
use cogmap_lab::tuc::Tuc;
use trajectory::Alignment;

use super::recorded::{self, Case, RecordedArgs, Truth};
use super::tuc_samples;

#[derive(Debug, Args)]
pub(in crate::cli) struct TucArgs {
    /// Directory of the data set, with files `*_Input.txt` (odom2 and loop lines) and `*_GT.txt`
    /// (point2 and angle lines).
    directory: PathBuf,
    /// Add false matches between random moments until they make up this share of all, from 0 to
    /// below 1.
    #[arg(long, value_name = "SHARE", value_parser = share)]
    add_false: Option<f64>,
    /// Seed of the false matches.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Send odometry and matches as samples through the memory that a service keeps, with the
    /// default settings of a space, instead of straight into the solver.
    #[arg(long, conflicts_with_all = ["no_causal", "out", "plot"])]
    samples: bool,
    #[command(flatten)]
    recorded: RecordedArgs,
}

pub(super) fn run(args: &TucArgs) -> anyhow::Result<()> {
    let set = Tuc::load(&args.directory)?;
    let mut matches = set.distant_matches();
    if let Some(share) = args.add_false {
        set.add_false(&mut matches, share, args.seed);
    }
    let n_true = matches.iter().filter(|found| set.is_true(found)).count();
    let n = matches.len();
    if args.samples {
        return tuc_samples::run(&set, &matches, args.recorded.json);
    }
    let case = Case {
        title: "Odometry and place matches".to_owned(),
        recording: &set.recording(&matches),
        truth: Truth::OverTime(set.truth()),
        alignment: Alignment::Planar,
        has_time: true,
        false_share: (n > 0).then(|| (n - n_true) as f64 / n as f64),
    };
    recorded::run(&case, &args.recorded)
}

/// A share of matches that can be reached by adding some.
fn share(text: &str) -> Result<f64, String> {
    let share: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    if (0.0..=0.99).contains(&share) {
        Ok(share)
    } else {
        Err("not from 0 to 0.99".to_owned())
    }
}
