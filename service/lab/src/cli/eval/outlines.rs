//! `cogmap-lab eval outlines`.

use std::num::NonZeroUsize;

use clap::{Args, ValueEnum};
use cogmap_lab::outlines::{Family, Levels, OutlineProtocol, Teaching, Turn, run as explore};

use super::progress::Progress;
use cogmap::cli::output;

#[derive(Debug, Args)]
pub(in crate::cli) struct OutlinesArgs {
    /// Numbers of contacts by which objects are taught, with commas between.
    #[arg(long, value_delimiter = ',', default_values_t = [20, 60, 240, 1000], value_name = "N")]
    taught: Vec<usize>,
    /// Sets of five objects and five strangers in each row.
    #[arg(long, default_value_t = 8)]
    sets: usize,
    /// Objects are taught by one run of neighbouring touches, instead of all over.
    #[arg(long)]
    run: bool,
    /// Objects may have turned: anyhow, and contacts tell the surface's normal; or about the
    /// vertical.
    #[arg(long, value_name = "HOW", num_args = 0..=1, default_missing_value = "any")]
    turned: Option<Turned>,
    /// Families of objects, with commas between; all of them when absent.
    #[arg(long, value_delimiter = ',', value_name = "NAME", value_parser = family)]
    families: Vec<Family>,
    /// Rows at the same time; as many as the machine has processors when absent. It changes nothing
    /// but the time that it takes.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Seed of objects, explorations and noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// How objects may have turned.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Turned {
    /// Anyhow.
    Any,
    /// About the vertical.
    Yaw,
}

/// The family of a name.
fn family(name: &str) -> Result<Family, String> {
    let of_name = |own: &Family| format!("{own:?}").eq_ignore_ascii_case(name);
    let names = Family::ALL.map(|own| format!("{own:?}").to_lowercase());
    let found = Family::ALL.into_iter().find(of_name);
    found.ok_or_else(|| format!("a family is one of {}", names.join(", ")))
}

pub(super) fn run(args: &OutlinesArgs) -> anyhow::Result<()> {
    let mut protocols = Vec::new();
    let is_asked = |family: &Family| args.families.is_empty() || args.families.contains(family);
    for family in Family::ALL.into_iter().filter(is_asked) {
        // A line has no normals by which it could be turned back.
        if matches!(args.turned, Some(Turned::Any)) && family == Family::Outline {
            continue;
        }
        for levels in [Levels::Spread, Levels::Same] {
            for &taught in &args.taught {
                let turn = match args.turned {
                    Some(Turned::Any) => Turn::Any,
                    Some(Turned::Yaw) => Turn::Yaw,
                    None => Turn::None,
                };
                let mut protocol = OutlineProtocol::new(family, levels, turn, taught);
                protocol.sets = args.sets;
                protocol.seed = args.seed;
                if args.run {
                    protocol.teaching = Teaching::Run;
                }
                protocol.check()?;
                protocols.push(protocol);
            }
        }
    }
    let each = |protocol: &OutlineProtocol| 2 * protocol.sets * protocol.objects;
    let explorations: usize = protocols.iter().map(each).sum();
    let progress = Progress::new(explorations as u64, "explorations");
    let threads = args
        .threads
        .or_else(|| std::thread::available_parallelism().ok())
        .unwrap_or(NonZeroUsize::MIN);
    let report = explore(&protocols, threads, &|| progress.add(1))?;
    progress.finish();
    if args.json {
        return output::json(&report);
    }
    Ok(output::line(report.to_string().trim_end())?)
}
