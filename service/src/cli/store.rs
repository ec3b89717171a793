//! `cogmap store`, `cogmap backup`, `cogmap restore`: the care of a store.

use std::num::NonZeroU32;
use std::path::PathBuf;

use anyhow::Context;
use clap::{Args, Subcommand};
use serde_json::{Value, json};

use super::output;
use crate::engine::{self, RepairReport};
use crate::journal::samples_in;
use crate::service::{open_store, store_at};
use crate::store::{self, BackupReport, Damage, Shards, SpaceSurvey};

#[derive(Debug, Subcommand)]
pub(super) enum StoreCommand {
    /// Read every block of every space, and say what is damaged or missing. The service may run on
    /// it.
    Verify(VerifyArgs),
    /// Make a new journal of the blocks of a damaged space that can be read. The old one is kept.
    Repair(RepairArgs),
    /// Copy all spaces of a store into another one, and check what has come. No service may run on
    /// either.
    Copy(CopyArgs),
}

#[derive(Debug, Args)]
pub(super) struct VerifyArgs {
    /// Directory of the store.
    #[arg(long, value_name = "DIR", default_value = "cogmap-data")]
    data_dir: PathBuf,
    /// Only this space.
    #[arg(long)]
    space: Option<String>,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
pub(super) struct RepairArgs {
    /// Directory of the store; no service may run on it.
    #[arg(long, value_name = "DIR", default_value = "cogmap-data")]
    data_dir: PathBuf,
    /// The damaged space.
    #[arg(long)]
    space: String,
    /// Print one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
pub(super) struct CopyArgs {
    /// Directory or URL of the store.
    #[arg(value_name = "FROM")]
    from: String,
    /// Directory or URL of the other one, which is made if it is not there.
    #[arg(value_name = "TO")]
    to: String,
    /// Shards that the other one is made with on object storage; one that is there keeps its own.
    #[arg(long, value_name = "COUNT", default_value = "1")]
    shards: NonZeroU32,
}

#[derive(Debug, Args)]
pub(super) struct BackupArgs {
    /// Directory of the backup.
    #[arg(value_name = "BACKUP")]
    backup: PathBuf,
    /// Directory of the store.
    #[arg(long, value_name = "DIR", default_value = "cogmap-data")]
    data_dir: PathBuf,
}

pub(super) fn run(command: &StoreCommand) -> anyhow::Result<()> {
    match command {
        StoreCommand::Verify(args) => verify(args),
        StoreCommand::Repair(args) => repair(args),
        StoreCommand::Copy(args) => copy(args),
    }
}

fn copy(args: &CopyArgs) -> anyhow::Result<()> {
    let open = |place: &str, creates: Option<Shards>| {
        store_at(place, creates).with_context(|| format!("open the store {place}"))
    };
    let shards = Shards::from(args.shards);
    let (from, to) = (open(&args.from, None)?, open(&args.to, Some(shards))?);
    let copied = store::copy(&from, &to, samples_in)?;
    for space in copied {
        output::line(&format!(
            "{}: {} blocks with {} samples, check {:016x} on both ends",
            space.name, space.extent.blocks, space.extent.samples, space.check
        ))?;
    }
    Ok(())
}

fn verify(args: &VerifyArgs) -> anyhow::Result<()> {
    let surveys = store::verify(&args.data_dir, args.space.as_deref())
        .with_context(|| format!("verify the store {}", args.data_dir.display()))?;
    if args.json {
        let spaces: Vec<_> = surveys.iter().map(survey_json).collect();
        output::json(&json!({ "spaces": spaces }))?;
    } else {
        for surveyed in &surveys {
            print_survey(surveyed)?;
        }
    }
    let damaged = surveys.iter().filter(|surveyed| !is_sound(surveyed));
    let names: Vec<_> = damaged.map(|surveyed| surveyed.name.as_str()).collect();
    anyhow::ensure!(names.is_empty(), "damaged: {}", names.join(", "));
    Ok(())
}

fn is_sound(surveyed: &SpaceSurvey) -> bool {
    surveyed.has_record && surveyed.survey.is_sound()
}

fn survey_json(surveyed: &SpaceSurvey) -> Value {
    let survey = &surveyed.survey;
    let damage: Vec<_> = survey.damage.iter().map(damage_json).collect();
    json!({
        "space": surveyed.name,
        "number": surveyed.number.0,
        "sound": is_sound(surveyed),
        "has_record": surveyed.has_record,
        "mark_lost": survey.mark_lost,
        "blocks": survey.readable.blocks,
        "samples": survey.readable.samples,
        "acknowledged_blocks": survey.acknowledged.blocks,
        "acknowledged_samples": survey.acknowledged.samples,
        "lost_blocks": survey.lost.blocks,
        "lost_samples": survey.lost.samples,
        "damage": damage,
        "torn_tail": survey.torn_tail.as_ref().map(damage_json),
    })
}

fn damage_json(damage: &Damage) -> Value {
    json!({
        "block": damage.block,
        "next": damage.next,
        "file": damage.file,
        "offset": damage.offset,
        "reason": damage.flaw.to_string(),
    })
}

fn print_survey(surveyed: &SpaceSurvey) -> anyhow::Result<()> {
    let (survey, name) = (&surveyed.survey, &surveyed.name);
    let verdict = if is_sound(surveyed) {
        "sound"
    } else {
        "DAMAGED"
    };
    output::line(&format!(
        "{name}: {verdict}, {} of {} acknowledged blocks and {} of {} samples can be read",
        survey
            .acknowledged
            .blocks
            .saturating_sub(survey.lost.blocks),
        survey.acknowledged.blocks,
        survey
            .acknowledged
            .samples
            .saturating_sub(survey.lost.samples),
        survey.acknowledged.samples,
    ))?;
    if !surveyed.has_record {
        output::line("  both copies of the record with its name and settings are damaged")?;
    }
    if survey.mark_lost {
        output::line(
            "  it is not known how far it was acknowledged: blocks may be missing at its end",
        )?;
    }
    for damage in &survey.damage {
        output::line(&format!("  damaged: {}", in_words(damage)))?;
    }
    if let Some(tail) = &survey.torn_tail {
        output::line(&format!(
            "  never acknowledged, cut at the next start: {}",
            in_words(tail)
        ))?;
    }
    Ok(())
}

fn in_words(damage: &Damage) -> String {
    let (block, file, offset, flaw) = (damage.block, &damage.file, damage.offset, damage.flaw);
    let blocks = match damage.next {
        Some(next) if next > block + 1 => format!("blocks {block} to {}", next - 1),
        Some(_) => format!("block {block}"),
        None => format!("block {block} and all after it"),
    };
    format!("{blocks}, at byte {offset} of {file}: {flaw}")
}

fn repair(args: &RepairArgs) -> anyhow::Result<()> {
    let directory = &args.data_dir;
    // An empty directory would be made a store.
    let is_empty = std::fs::read_dir(directory).map_or(true, |mut names| names.next().is_none());
    anyhow::ensure!(!is_empty, "there is no store at {}", directory.display());
    let store =
        open_store(directory).with_context(|| format!("open the store {}", directory.display()))?;
    let space = store.journals().space(&args.space)?;
    match engine::repair(&store, &space)? {
        None if args.json => output::json(&Value::Null),
        None => Ok(output::line(&format!(
            "{}: nothing is damaged",
            args.space
        ))?),
        Some(report) if args.json => output::json(&report),
        Some(report) => print_repair(&report),
    }
}

fn print_repair(report: &RepairReport) -> anyhow::Result<()> {
    output::line(&format!(
        "{}: repaired; {} blocks with {} samples are kept, {} acknowledged samples are lost",
        report.space, report.blocks_kept, report.samples_kept, report.samples_lost
    ))?;
    for lost in &report.damage {
        let blocks = match lost.next {
            Some(next) if next > lost.first + 1 => format!("blocks {} to {}", lost.first, next - 1),
            Some(_) => format!("block {}", lost.first),
            None => format!("block {} and all after it", lost.first),
        };
        output::line(&format!("  lost: {blocks}: {}", lost.reason))?;
    }
    for agent in &report.agents {
        if agent.name_lost {
            let (number, name) = (agent.agent, &agent.name);
            output::line(&format!(
                "  agent {number}: its name is lost, it is called {name:?} now"
            ))?;
        }
        for missing in &agent.missing {
            let (from, last, session) = (missing.from, missing.to - 1, missing.session);
            let whence = if missing.at_end {
                " at the end, and may be sent again"
            } else {
                ""
            };
            output::line(&format!(
                "  agent {:?}: samples {from} to {last} of session {session} are missing{whence}",
                agent.name
            ))?;
        }
    }
    Ok(output::line(&format!(
        "  the damaged files are kept in {}",
        report.set_aside.display()
    ))?)
}

pub(super) fn backup(args: &BackupArgs) -> anyhow::Result<()> {
    let report = store::backup(&args.data_dir, &args.backup)
        .with_context(|| format!("back up the store {}", args.data_dir.display()))?;
    print_backup(&report, "in the backup")
}

pub(super) fn restore(args: &BackupArgs) -> anyhow::Result<()> {
    let report = store::restore(&args.backup, &args.data_dir)
        .with_context(|| format!("restore the backup {}", args.backup.display()))?;
    print_backup(&report, "restored")
}

fn print_backup(report: &BackupReport, what: &str) -> anyhow::Result<()> {
    for space in &report.spaces {
        let (blocks, samples) = (space.extent.blocks, space.extent.samples);
        output::line(&format!(
            "{}: {blocks} blocks with {samples} samples {what}",
            space.name
        ))?;
    }
    let left_out = report.left_out.iter();
    let left_out: Vec<_> = left_out
        .map(|(name, reason)| format!("{name} ({reason})"))
        .collect();
    anyhow::ensure!(left_out.is_empty(), "left out: {}", left_out.join(", "));
    Ok(())
}
