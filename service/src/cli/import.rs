//! `cogmap import`: a space from the JSON export of a map.

use std::io::Read;
use std::path::PathBuf;

use anyhow::Context;
use clap::Args;

use super::output;
use crate::decode::{core_settings, map_import, records_of};
use crate::journal::BlockWriter;
use crate::service::open_store;
use crate::store::Journal;
use cogmap_proto::Name;
use cognitive_map::CognitiveMap;

/// Entries of a block. Source: a block of ways is then some 300 KB.
const BLOCK_ENTRIES: usize = 1000;

#[derive(Debug, Args)]
pub(super) struct ImportArgs {
    /// The export, as `cogmap export map` prints it; `-` for standard input.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Directory of the store; no service may run on it. It is made if it is not there.
    #[arg(long, value_name = "DIR", default_value = "cogmap-data")]
    data_dir: PathBuf,
    /// The new space.
    #[arg(long, default_value = "default")]
    space: String,
}

pub(super) fn run(args: &ImportArgs) -> anyhow::Result<()> {
    let export = read(&args.file).with_context(|| format!("read {}", args.file.display()))?;
    let import = map_import(&export)?;
    Name::check(&args.space).with_context(|| format!("{:?} names no space", args.space))?;
    // What is journaled is what a start will fold.
    let mut map = CognitiveMap::new(core_settings(&import.settings)?);
    let mut events = Vec::new();
    for entry in &import.entries {
        records_of(entry, |record| map.apply(&record, &mut events));
        events.clear();
    }
    let directory = &args.data_dir;
    let store =
        open_store(directory).with_context(|| format!("open the store {}", directory.display()))?;
    let settings = serde_json::to_vec(&import.settings)?;
    // An import that is cut short leaves no space behind.
    let mut draft = store.draft(&args.space, &settings)?;
    let mut block = BlockWriter::new();
    for entries in import.entries.chunks(BLOCK_ENTRIES) {
        block.clear();
        for entry in entries {
            block.push(entry);
        }
        draft.append(0, block.bytes())?;
    }
    draft.finish()?;
    Ok(output::line(&format!(
        "{}: {} places and {} ways, digest {}",
        args.space,
        map.place_count(),
        map.way_count(),
        map.digest()
    ))?)
}

fn read(file: &PathBuf) -> std::io::Result<String> {
    if file.as_os_str() == "-" {
        let mut text = String::new();
        std::io::stdin().read_to_string(&mut text)?;
        return Ok(text);
    }
    std::fs::read_to_string(file)
}
