//! `cogmap-lab replay sequences`.

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use cogmap::cli::output;
use cogmap_lab::csv::{Choice, TableSet};
use cogmap_proto::SpaceSettings;

use super::sequence_recall::{CLAIM, SequenceQuestions, SequenceRecall};
use crate::cli::eval::Host;

const SPACE: &str = "sequences";

#[derive(Debug, Args)]
pub(in crate::cli) struct SequencesArgs {
    /// Directory of a set with views, as `replay csv` reads it.
    directory: PathBuf,
    /// The agent whose way is remembered; the others are asked for. When absent, the first by name
    /// of those whose truth is known.
    #[arg(long, value_name = "AGENT")]
    taught: Option<String>,
    /// Views of a question, one after the other.
    #[arg(long, default_value_t = 10, value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=64))]
    length: u32,
    /// An answer is right that is no farther off \[m\].
    #[arg(long, default_value_t = 30.0, value_name = "M", value_parser = distance_m)]
    within_m: f64,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

/// A distance \[m\].
fn distance_m(text: &str) -> Result<f64, String> {
    let metres: f64 = text.parse().map_err(|_| "it is no number".to_owned())?;
    if metres.is_finite() && metres >= 0.0 {
        Ok(metres)
    } else {
        Err("a distance is finite, and not below zero".to_owned())
    }
}

/// The first agent by name of which the truth is known.
fn first_known(set: &TableSet) -> anyhow::Result<String> {
    let mut known = set.agents.iter().filter(|(_, log)| log.truth.is_some());
    let (name, _) = known.next().context("no agent of the set has a truth")?;
    Ok(name.clone())
}

pub(super) fn run(args: &SequencesArgs) -> anyhow::Result<()> {
    let set = TableSet::load(&args.directory)?;
    let questions = SequenceQuestions {
        taught: match &args.taught {
            Some(taught) => taught.clone(),
            None => first_known(&set)?,
        },
        length: args.length,
        within_m: args.within_m,
        choice: Choice::default(),
    };
    // Without the agents no service is started.
    questions.check(&set)?;
    let host = Host::start()?;
    let recall = questions.ask(&host.api(), SPACE, &SpaceSettings::default(), &set)?;
    drop(host);
    if args.json {
        return output::json(&recall);
    }
    print(&recall)
}

fn print(recall: &SequenceRecall) -> anyhow::Result<()> {
    let asked = &recall.asked;
    output::line(&format!(
        "{} views of each agent after {}'s; right is within {} m of where the next one was seen",
        asked.length, asked.taught, asked.within_m
    ))?;
    for row in &recall.rows {
        let claims_right = row
            .claims_right
            .map_or("none".to_owned(), |share| format!("{:.1} %", share * 100.0));
        output::line(&format!(
            "\n{}: {} questions, {:.1} % right; {} told with {CLAIM} or more, {claims_right} of \
            these right; p50 {:.2} ms, p99 {:.2} ms",
            row.agent,
            row.questions,
            row.right * 100.0,
            row.claims,
            row.ms_p50,
            row.ms_p99,
        ))?;
        output::line("probability        said    right       sd     count")?;
        for bin in row.calibration.bins() {
            output::line(&format!(
                "{:.2} to {:.2} {:>10.3} {:>8.3} {:>8.3} {:>9}",
                bin.from, bin.to, bin.said, bin.came, bin.sd, bin.count
            ))?;
        }
    }
    Ok(())
}
