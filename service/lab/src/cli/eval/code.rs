//! `cogmap-lab eval code`.

use std::num::NonZeroUsize;

use clap::Args;
use cogmap_lab::eval::code::{Candidate, CodeComparison, CodeProtocol, CodeReport, Condition};
use cognitive_map::SettingsValues;

use super::progress::Progress;
use cogmap::cli::output;

#[derive(Debug, Args)]
pub(in crate::cli) struct CodeArgs {
    /// Number of places.
    #[arg(long, default_value_t = CodeProtocol::default().places)]
    places: u64,
    /// Recalls of each kind.
    #[arg(long, default_value_t = CodeProtocol::default().queries)]
    queries: u32,
    /// Standard deviation of noise on each phase component of a noisy code [turns].
    #[arg(long, default_value_t = CodeProtocol::default().phase_noise_turns, value_name = "TURNS")]
    phase_noise: f64,
    /// Standard deviation, along each axis, of a jittered code's position from the place [m].
    #[arg(long, default_value_t = CodeProtocol::default().jitter_m, value_name = "M")]
    jitter_m: f64,
    /// Number of grid modules; the default of a space when absent.
    #[arg(long, alias = "modules", value_name = "N")]
    grid_modules: Option<usize>,
    /// Spacing of the finest grid module [m]; the default of a space when absent.
    #[arg(long, alias = "spacing-m", value_name = "M")]
    grid_spacing_m: Option<f64>,
    /// Ratio of the spacings of neighbouring modules; the default of a space when absent.
    #[arg(long, alias = "ratio", value_name = "RATIO")]
    grid_ratio: Option<f64>,
    /// Set the code beside others instead, with the errors of recall in env1 and env2.
    #[arg(long)]
    compare: bool,
    /// Runs in each room, with --compare.
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    runs: u32,
    /// Seed of places, cues and, with --compare, the first run.
    #[arg(long, default_value_t = CodeProtocol::default().seed)]
    seed: u64,
    /// Threads; as many as the machine has processors when absent. It changes nothing but the time
    /// that it takes.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &CodeArgs) -> anyhow::Result<()> {
    let default = SettingsValues::default();
    let protocol = CodeProtocol {
        settings: SettingsValues {
            grid_modules: args.grid_modules.unwrap_or(default.grid_modules),
            grid_spacing_m: args.grid_spacing_m.unwrap_or(default.grid_spacing_m),
            grid_ratio: args.grid_ratio.unwrap_or(default.grid_ratio),
            ..default
        },
        places: args.places,
        queries: args.queries,
        phase_noise_turns: args.phase_noise,
        jitter_m: args.jitter_m,
        seed: args.seed,
    };
    // As a wrong use of the command, before anything is built.
    protocol.check()?;
    let threads = args
        .threads
        .or_else(|| std::thread::available_parallelism().ok())
        .unwrap_or(NonZeroUsize::MIN);
    if args.compare {
        let begun = |code: &Candidate| {
            output::progress(&format!(
                "{} modules, finest {} m, ratio {}",
                code.grid_modules, code.grid_spacing_m, code.grid_ratio
            ));
        };
        let comparison = CodeComparison::measure(&protocol, args.runs, threads, &begun)?;
        return if args.json {
            output::json(&comparison)
        } else {
            Ok(output::line(comparison.to_string().trim_end())?)
        };
    }
    output::progress(&format!("building a map of {} places", protocol.places));
    let progress = Progress::new(CodeReport::queries(&Condition::ALL, &protocol), "recalls");
    let report = CodeReport::measure(&protocol, threads, &|recalled| progress.add(recalled))?;
    progress.finish();
    if args.json {
        output::json(&report)
    } else {
        Ok(output::line(report.to_string().trim_end())?)
    }
}
