//! `cogmap-lab eval env3`.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::Context;
use clap::{Args, ValueEnum};
use cogmap_lab::eval::object::{
    Normals, ObjectExperiment, ObjectProtocol, ObjectReport, ObjectTable, Rotate, object_figures,
};
use cogmap_lab::objects::ExplorationNoise;
use serde::Serialize;

use super::progress::Progress;
use cogmap::cli::output;

#[derive(Debug, Args)]
pub(in crate::cli) struct ObjectArgs {
    /// Number of objects; several numbers, with commas between, are so many experiments.
    #[arg(long, value_delimiter = ',', default_values_t = [2, 3, 4], value_name = "N")]
    objects: Vec<u32>,
    /// Standard deviation of a felt level, as a share of the range of levels.
    #[arg(long, default_value_t = ObjectProtocol::of_paper(3).noise.value, value_name = "SHARE")]
    value_noise: f64,
    /// Standard deviation of a move's measured displacement along each axis, as a share of its
    /// length.
    #[arg(long, default_value_t = ObjectProtocol::of_paper(3).noise.motion, value_name = "SHARE")]
    motion_noise: f64,
    /// Which turns the objects may have made since they were learned.
    #[arg(long, value_enum, default_value = "none")]
    rotate: Turns,
    /// Contacts tell the surface's normal, as they always do with --rotate so3.
    #[arg(long)]
    normals: bool,
    /// Explorations of learned objects; a quarter as many are of objects that were never learned.
    #[arg(long, default_value_t = ObjectProtocol::of_paper(3).trials)]
    trials: u32,
    /// Most touches of an exploration.
    #[arg(long, default_value_t = ObjectProtocol::of_paper(3).touches_max, value_name = "N")]
    max_touches: usize,
    /// An answer is given as soon as its probability is this high.
    #[arg(long, default_value_t = ObjectProtocol::of_paper(3).sure, value_name = "P")]
    sure: f64,
    /// Most touches of each object while learning.
    #[arg(long, default_value_t = ObjectProtocol::of_paper(3).learning_touches, value_name = "N")]
    learning_touches: usize,
    /// Seed of objects, explorations and noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Explorations at the same time; as many as the machine has processors when absent. It changes
    /// nothing but times.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Write figures and report into this directory.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object: the report of one experiment, or of several in a list `experiments`.
    #[arg(long)]
    json: bool,
}

/// Turns that an object may have made.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(in crate::cli) enum Turns {
    /// None: only where the exploration began is unknown.
    None,
    /// The 24 that take a cube into itself.
    #[value(name = "24")]
    Cube,
    /// All about the vertical.
    Yaw,
    /// All rotations.
    So3,
}

impl From<Turns> for Rotate {
    fn from(turns: Turns) -> Self {
        match turns {
            Turns::None => Self::None,
            Turns::Cube => Self::Cube,
            Turns::Yaw => Self::Yaw,
            Turns::So3 => Self::Free,
        }
    }
}

/// Several experiments.
#[derive(Debug, Serialize)]
struct Reports<'a> {
    experiments: &'a [ObjectReport],
}

pub(super) fn run(args: &ObjectArgs) -> anyhow::Result<()> {
    let protocols: Vec<ObjectProtocol> = args
        .objects
        .iter()
        .map(|objects| protocol(*objects, args))
        .collect();
    for protocol in &protocols {
        protocol.check()?;
    }
    let threads = args
        .threads
        .or_else(|| std::thread::available_parallelism().ok())
        .unwrap_or(NonZeroUsize::MIN);
    let begin = Instant::now();
    let explorations = protocols.iter().map(ObjectExperiment::explorations).sum();
    let progress = Progress::new(explorations, "explorations");
    let reports = protocols
        .iter()
        .map(|protocol| {
            let explored = |count| progress.add(count);
            let clock = || begin.elapsed().as_secs_f64();
            let experiment = ObjectExperiment::run(protocol, threads, &explored, &clock)?;
            Ok(ObjectReport::of(&experiment))
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    progress.finish();
    if let Some(directory) = &args.out {
        write(directory, &reports)
            .with_context(|| format!("write into {}", directory.display()))?;
    }
    match &reports[..] {
        [report] if args.json => output::json(report),
        experiments if args.json => output::json(&Reports { experiments }),
        _ => Ok(output::line(ObjectTable(&reports).to_string().trim_end())?),
    }
}

/// What the arguments ask for.
fn protocol(objects: u32, args: &ObjectArgs) -> ObjectProtocol {
    let told = args.normals || matches!(args.rotate, Turns::So3);
    ObjectProtocol {
        objects,
        noise: ExplorationNoise {
            value: args.value_noise,
            motion: args.motion_noise,
        },
        rotate: args.rotate.into(),
        normals: if told { Normals::Told } else { Normals::Untold },
        trials: args.trials,
        touches_max: args.max_touches,
        sure: args.sure,
        learning_touches: args.learning_touches,
        seed: args.seed,
    }
}

/// Writes report and figures.
fn write(directory: &Path, reports: &[ObjectReport]) -> anyhow::Result<()> {
    std::fs::create_dir_all(directory)?;
    let json = serde_json::to_string_pretty(&Reports {
        experiments: reports,
    })? + "\n";
    std::fs::write(directory.join("report.json"), json)?;
    for figure in object_figures(reports)? {
        std::fs::write(directory.join(format!("{}.svg", figure.name)), figure.svg)?;
    }
    Ok(())
}
