//! `cogmap export`: what a store holds, read while no service runs on it.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Context;
use clap::{Args, Subcommand};

use super::output;
use crate::decode::{core_settings, records_of, trajectory_interval_ns};
use crate::encode;
use crate::engine::Recorder;
use crate::journal::entries;
use crate::store::{Journal, LocalJournal, SpaceNumber};
use cogmap_proto::SpaceSettings;
use cognitive_map::{CognitiveMap, Record};
use trajectory::write_tum;

#[derive(Debug, Subcommand)]
pub(super) enum ExportCommand {
    /// The journal of a space, one JSON object for each entry; up to the damage where there is one.
    Journal(Source),
    /// A space's map as one JSON object, as it is served over HTTP: as it is now, or as it was.
    Map {
        #[command(flatten)]
        source: Source,
        /// Number of records that the map is to include; all of the journal when absent.
        #[arg(long, value_name = "REVISION")]
        as_of: Option<u64>,
    },
    /// The causal trajectory of an agent's latest session, as TUM lines `t x y z qx qy qz qw`.
    Trajectory {
        #[command(flatten)]
        source: Source,
        /// Agent.
        #[arg(long)]
        agent: String,
    },
}

/// A space of a store.
#[derive(Debug, Args)]
pub(super) struct Source {
    /// Directory of the store.
    #[arg(long, value_name = "DIR", default_value = "cogmap-data")]
    data_dir: PathBuf,
    /// Space.
    #[arg(long, default_value = "default")]
    space: String,
}

pub(super) fn run(command: &ExportCommand) -> anyhow::Result<()> {
    match command {
        ExportCommand::Journal(source) => journal(source),
        ExportCommand::Map { source, as_of } => map(source, *as_of),
        ExportCommand::Trajectory { source, agent } => trajectory(source, agent),
    }
}

fn open(source: &Source) -> anyhow::Result<(LocalJournal, SpaceNumber, SpaceSettings)> {
    let directory = &source.data_dir;
    anyhow::ensure!(
        directory.is_dir(),
        "there is no store at {}",
        directory.display()
    );
    let store = LocalJournal::open(directory)
        .with_context(|| format!("open the store {}", directory.display()))?;
    let space = store.space(&source.space)?;
    let settings = space.settings.context("the space's settings are lost")?;
    let settings = serde_json::from_slice(&settings).context("read the space's settings")?;
    Ok((store, space.number, settings))
}

fn journal(source: &Source) -> anyhow::Result<()> {
    let (store, space, _) = open(source)?;
    for block in store.journal(space, 0) {
        let (number, bytes) = block?;
        for entry in entries(&bytes).with_context(|| format!("read block {number}"))? {
            output::json(&entry)?;
        }
    }
    Ok(())
}

/// The journal does not reach to the revision that is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the journal has the map as of 0 to {reaches}, not as of {asked}")]
struct BeyondJournal {
    asked: u64,
    reaches: u64,
}

/// The journal is the ground state, so the map of any revision is folded from it.
fn map(source: &Source, as_of: Option<u64>) -> anyhow::Result<()> {
    let (store, space, settings) = open(source)?;
    let mut map = CognitiveMap::new(core_settings(&settings)?);
    let mut events = Vec::new();
    let asked = as_of.unwrap_or(u64::MAX);
    for block in store.journal(space, 0) {
        if map.revision() >= asked {
            break;
        }
        let (number, bytes) = block?;
        for entry in entries(&bytes).with_context(|| format!("read block {number}"))? {
            records_of(&entry, |record| {
                // A record adds one at most.
                if map.revision() < asked {
                    map.apply(&record, &mut events);
                    events.clear();
                }
            });
        }
    }
    let reaches = map.revision();
    if let Some(asked) = as_of.filter(|asked| *asked > reaches) {
        return Err(BeyondJournal { asked, reaches }.into());
    }
    let agents = encode::agent_summaries(&source.space, &map);
    let name = source.space.clone();
    for text in encode::map_export(name, settings, Arc::new(map), agents) {
        output::text(&text)?;
    }
    Ok(output::line("")?)
}

/// The journal is the ground state, so the trajectory is folded from it anew.
fn trajectory(source: &Source, agent: &str) -> anyhow::Result<()> {
    let (store, space, settings) = open(source)?;
    let mut map = CognitiveMap::new(core_settings(&settings)?);
    let interval_ns = trajectory_interval_ns(&settings);
    let (mut recorder, mut rows, mut events) = (Recorder::default(), Vec::new(), Vec::new());
    let mut known = None;
    for block in store.journal(space, 0) {
        let (number, bytes) = block?;
        for entry in entries(&bytes).with_context(|| format!("read block {number}"))? {
            records_of(&entry, |record| {
                map.apply(&record, &mut events);
                events.clear();
                if let Record::Enrol { agent: id, name } = &record {
                    let is_asked_for = name.as_str() == agent;
                    // Another agent may take over the name, or the number of one that left nothing.
                    if is_asked_for || known == Some(*id) {
                        known = is_asked_for.then_some(*id);
                        recorder = Recorder::default();
                        rows.clear();
                    }
                }
                let (Record::Sample { agent: id, .. } | Record::Remove { agent: id }) = &record
                else {
                    return;
                };
                if known != Some(*id) {
                    return;
                }
                let Some(of_map) = map.agent(*id) else { return };
                let before = recorder.session();
                let full = recorder.note(&record, of_map, interval_ns);
                // A session that has moved replaces the one before.
                let is_sample = matches!(record, Record::Sample { .. });
                if is_sample && recorder.session() != before {
                    rows.clear();
                } else if let Some(chunk) = full {
                    rows.extend(chunk.rows);
                }
            });
        }
    }
    known.with_context(|| format!("the space has no agent {agent:?}"))?;
    rows.extend_from_slice(recorder.rows());
    Ok(output::line(write_tum(&rows).trim_end())?)
}
