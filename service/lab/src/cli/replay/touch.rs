//! `cogmap-lab replay touch`.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::Context;
use clap::Args;
use cogmap_lab::touch::{TouchExperiment, TouchNoise, TouchProtocol, TouchReport, TouchSet};

use object_recognition::ANSWER_PROBABILITY;

use crate::cli::eval::{Progress, Turns};
use cogmap::cli::output;

/// Metres in a millimetre.
const M_PER_MM: f64 = 1e-3;

#[derive(Debug, Args)]
pub(in crate::cli) struct TouchArgs {
    /// Directory with one file an object, `<name>.csv`, of the columns `x_mm,y_mm,z_mm,level`.
    directory: PathBuf,
    /// Standard deviation of a touch's position along each axis [mm].
    #[arg(long, default_value_t = 2.0, value_name = "MM")]
    noise_mm: f64,
    /// Standard deviation of a level, in its own unit.
    #[arg(long, default_value_t = 0.5, value_name = "SD")]
    noise_level: f64,
    /// Explorations of each object.
    #[arg(long, default_value_t = 20)]
    trials: u32,
    /// Most touches of an exploration.
    #[arg(long, default_value_t = 12, value_name = "N")]
    max_touches: usize,
    /// Which turns the objects may have made since they were learned.
    #[arg(long, value_enum, default_value = "none")]
    rotate: Turns,
    /// Touches say that they were drawn from the whole object, as those of a question over HTTP
    /// may; otherwise they count as found, as those of an agent do.
    #[arg(long)]
    told: bool,
    /// An answer is given as soon as its probability is this high.
    #[arg(long, default_value_t = ANSWER_PROBABILITY, value_name = "P")]
    sure: f64,
    /// Seed of the order of touches, of noise and of where the object is.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Explorations at the same time; as many as the machine has processors when absent. It changes
    /// nothing but times.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Write `report.json`, and all touches as `trials.csv`, into this directory.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &TouchArgs) -> anyhow::Result<()> {
    let protocol = TouchProtocol {
        noise: TouchNoise {
            position_sd_m: args.noise_mm * M_PER_MM,
            level_sd: args.noise_level,
        },
        rotate: args.rotate.into(),
        is_reach_told: args.told,
        trials: args.trials,
        touches_max: args.max_touches,
        sure: args.sure,
        seed: args.seed,
    };
    protocol.check()?;
    let set = TouchSet::load(&args.directory)?;
    let threads = args
        .threads
        .or_else(|| std::thread::available_parallelism().ok())
        .unwrap_or(NonZeroUsize::MIN);
    let explorations = set.objects().len() as u64 * u64::from(args.trials);
    let progress = Progress::new(explorations, "explorations");
    let begin = Instant::now();
    let explored = |count| progress.add(count);
    let clock = || begin.elapsed().as_secs_f64();
    let experiment = TouchExperiment::run(&set, &protocol, threads, &explored, &clock)?;
    progress.finish();
    let report = TouchReport::of(&experiment);
    if let Some(directory) = &args.out {
        let write = || -> anyhow::Result<()> {
            std::fs::create_dir_all(directory)?;
            let json = serde_json::to_string_pretty(&report)? + "\n";
            std::fs::write(directory.join("report.json"), json)?;
            std::fs::write(directory.join("trials.csv"), experiment.csv())?;
            Ok(())
        };
        write().with_context(|| format!("write into {}", directory.display()))?;
    }
    if args.json {
        output::json(&report)
    } else {
        Ok(output::line(report.to_string().trim_end())?)
    }
}
