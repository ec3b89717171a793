//! `cogmap-lab replay csv`.

use std::path::PathBuf;

use clap::Args;
use cogmap::cli::output;
use cogmap_lab::csv::{Choice, TableSet};
use serde::Serialize;

use super::arguments::{ReplayArgs, share};
use super::csv_waking::Waking;
use super::errors::Errors;
use super::recording::{Recording, Selection, Sharing};
use super::report::Report;

#[derive(Debug, Args)]
pub(in crate::cli) struct CsvArgs {
    /// Directory with `samples.csv`, `truth.csv` and a file `CHANNEL.npy` for each channel of views
    /// (`cogmap_lab::csv` says which columns they have).
    directory: PathBuf,
    /// Only these agents.
    #[arg(long, value_name = "AGENT,AGENT", value_delimiter = ',')]
    only: Vec<String>,
    /// Put all agents into one space, one after the other; otherwise each has a space of its own.
    #[arg(long)]
    one_space: bool,
    /// In one space, tell only so many agents where they start; the others wake up unknown. All are
    /// told when absent.
    #[arg(long, value_name = "N", requires = "one_space")]
    teach: Option<usize>,
    /// In one space, send the samples of all agents in order of time, as a team that is out
    /// together.
    #[arg(long, requires = "one_space")]
    together: bool,
    /// Leave out these channels.
    #[arg(long, value_name = "CHANNEL,CHANNEL", value_delimiter = ',')]
    no: Vec<String>,
    /// Send motions without the noise that the set states, as a robot that knows nothing of its
    /// odometry.
    #[arg(long)]
    unstated_noise: bool,
    /// Most agents.
    #[arg(long, value_name = "N")]
    max_agents: Option<usize>,
    /// Take the agents in a random order, by this seed; in order of time when absent.
    #[arg(long, value_name = "SEED")]
    shuffle: Option<u64>,
    /// Make this share of the distances 15 m too long, at random, as if they had come by way of a
    /// wall.
    #[arg(long, value_name = "SHARE", value_parser = share)]
    reflect: Option<f64>,
    /// Seed of which ones.
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    reflect_seed: u64,
    #[command(flatten)]
    replay: ReplayArgs,
}

/// What a replay shows.
#[derive(Debug, Serialize)]
struct CsvReport {
    /// Of the agents' errors, the median of each.
    medians: Errors,
    /// What became of agents that woke up unknown.
    waking: Option<Waking>,
    #[serde(flatten)]
    report: Report,
}

pub(super) fn run(args: &CsvArgs) -> anyhow::Result<()> {
    let mut set = TableSet::load(&args.directory)?;
    check_left_out(&set, &args.no)?;
    if let Some(share) = args.reflect {
        set.reflect(share, args.reflect_seed);
    }
    let selection = args.selection();
    let replayed = Recording::new(&set, &selection)?.replay(&args.replay)?;
    let report = CsvReport {
        medians: replayed.report.medians(),
        waking: replayed.waking,
        report: replayed.report,
    };
    if args.replay.json {
        return output::json(&report);
    }
    report.report.print()?;
    let medians = &report.medians;
    output::line(&format!("medians              {}", medians.cells()))?;
    match &report.waking {
        Some(waking) => Ok(output::line(&waking.to_string())?),
        None => Ok(()),
    }
}

/// Refuses to leave out a channel that the set has not: its name is surely misspelt.
fn check_left_out(set: &TableSet, left_out: &[String]) -> anyhow::Result<()> {
    let channels = set.channels();
    for name in left_out {
        let known = channels.iter().copied().collect::<Vec<_>>().join(", ");
        let known = if known.is_empty() { "none" } else { &known };
        anyhow::ensure!(
            channels.contains(name.as_str()),
            "--no {name}: the set has no such channel; it has {known}"
        );
    }
    Ok(())
}

impl CsvArgs {
    /// Which agents are asked for, and what they send.
    fn selection(&self) -> Selection {
        Selection {
            only: self.only.clone(),
            choice: Choice {
                without: self.no.iter().cloned().collect(),
                unstated_noise: self.unstated_noise,
            },
            max_agents: self.max_agents,
            shuffle: self.shuffle,
            sharing: match (self.one_space, self.together) {
                (false, _) => Sharing::Nobody,
                (true, false) => Sharing::InTurn,
                (true, true) => Sharing::Together,
            },
            taught: self.teach,
        }
    }
}
