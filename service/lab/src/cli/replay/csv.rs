//! `cogmap-lab replay csv`.

use std::collections::BTreeSet;
use std::path::PathBuf;

use clap::Args;
use cogmap::cli::output;
use cogmap_lab::csv::{Choice, Log, RowBody, TableSet, Truth};
use cogmap_lab::stream::Stream;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use trajectory::{Alignment, StampedPosition, Trajectory};

use super::arguments::ReplayArgs;
use super::case::Case;
use super::csv_waking::{Sighted, Waking};
use super::errors::Errors;
use super::report::Report;
use super::scoring::{Pairing, Scoring};
use super::team::{Known, Team};

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
    /// Most agents.
    #[arg(long, value_name = "N")]
    max_agents: Option<usize>,
    /// Take the agents in a random order, by this seed; in order of time when absent.
    #[arg(long, value_name = "SEED")]
    shuffle: Option<u64>,
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

/// An agent of which the truth is known.
struct Agent<'a> {
    name: &'a str,
    log: &'a Log,
    truth: &'a Truth,
}

pub(super) fn run(args: &CsvArgs) -> anyhow::Result<()> {
    let set = TableSet::load(&args.directory)?;
    for name in &args.only {
        let is_there = set.agents.contains_key(name);
        anyhow::ensure!(is_there, "the set has no agent {name}");
    }
    let agents = agents(&set, args);
    anyhow::ensure!(!agents.is_empty(), "no agent of the set has a truth");
    let case = Case {
        start_pose: match args.teach {
            None => "from the truth",
            Some(_) => "from the truth for those taught, none for the others",
        },
        teams: teams(&set, &agents, args)?,
        scoring: Scoring {
            pairing: Pairing::Own,
            alignment: Alignment::Planar,
            is_recorded: true,
        },
    };
    let (report, outcomes) = case.outcomes(&args.replay)?;
    let waking = args.teach.map(|taught| {
        let seen = agents.iter().enumerate().map(|(index, agent)| {
            let causal = outcomes
                .iter()
                .find_map(|outcome| outcome.robots.get(agent.name));
            Sighted {
                is_taught: index < taught,
                seen_at: seen_at(agent, args),
                claims: causal.map(|robot| &robot.causal[..]).unwrap_or_default(),
                truth: agent.truth,
            }
        });
        Waking::of(&seen.collect::<Vec<_>>())
    });
    let report = CsvReport {
        medians: report.medians(),
        waking,
        report,
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

/// The agents that are asked for, in the order in which they are sent.
fn agents<'a>(set: &'a TableSet, args: &CsvArgs) -> Vec<Agent<'a>> {
    let is_asked_for = |name: &String| args.only.is_empty() || args.only.contains(name);
    let known = set.agents.iter().filter(|(name, _)| is_asked_for(name));
    let known = known.filter_map(|(name, log)| {
        let truth = log.truth.as_ref()?;
        Some(Agent { name, log, truth })
    });
    let mut agents: Vec<Agent<'a>> = known.collect();
    agents.sort_by_key(|agent| agent.log.rows.first().map(|row| row.stamp_ns));
    if let Some(seed) = args.shuffle {
        agents.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    }
    agents.truncate(args.max_agents.unwrap_or(usize::MAX));
    agents
}

/// What the agents send, by their spaces.
fn teams(set: &TableSet, agents: &[Agent<'_>], args: &CsvArgs) -> anyhow::Result<Vec<Team>> {
    let without: BTreeSet<String> = args.no.iter().cloned().collect();
    let choice = Choice { without };
    let batch = args.replay.batch();
    let space = args.replay.space("csv");
    let mut sent: Vec<(&str, Stream, Trajectory)> = Vec::new();
    for (index, agent) in agents.iter().enumerate() {
        let first = agent.log.rows.first().map_or(0, |row| row.stamp_ns);
        let is_told = args.teach.is_none_or(|taught| index < taught);
        let start = agent.truth.start(first).filter(|_| is_told);
        let stream = set.stream(agent.name, start.as_ref(), &choice)?;
        let positions = agent.truth.trajectory.positions().iter();
        let positions = positions.map(|row| StampedPosition {
            stamp_ns: TableSet::sent_ns(row.stamp_ns),
            ..*row
        });
        sent.push((agent.name, stream, Trajectory::new(positions)?));
    }
    if !args.one_space {
        let alone = sent.into_iter().map(|(name, stream, truth)| {
            Team::alone(format!("{space}-{name}"), name, &stream, Some(truth), batch)
        });
        return Ok(alone.collect());
    }
    let samples = sent.iter().flat_map(|(name, stream, _)| {
        let samples = stream.samples().iter().cloned();
        samples.map(|sample| ((*name).to_owned(), sample))
    });
    let mut samples: Vec<_> = samples.collect();
    if args.together {
        samples.sort_by_key(|(_, sample)| sample.stamp_ns);
    }
    let mut team = Team::new(space, samples, batch);
    for (name, stream, truth) in sent {
        let known = Known::reckoned(stream.reckoned().to_vec(), Some(truth));
        team.robots.insert(name.to_owned(), known);
    }
    Ok(vec![team])
}

/// Where an agent was at its views.
fn seen_at(agent: &Agent<'_>, args: &CsvArgs) -> Vec<nalgebra::Vector3<f64>> {
    let rows = agent.log.rows.iter();
    let views = rows.filter(|row| match &row.body {
        RowBody::Descriptor(channel, _) => !args.no.contains(channel),
        _ => false,
    });
    views
        .filter_map(|row| agent.truth.at(row.stamp_ns))
        .collect()
}
