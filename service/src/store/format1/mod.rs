//! Stores of format 1, in which fjall kept everything, and their migration to format 2.
//!
//! ```text
//! keyspace    key                                  value
//! meta        "format"                             1: u32
//!             "next_space"                         u32
//!             "space/" number, in decimal          1: u8, name length: u32, name, settings
//! journal     space: u32, block: u64               the block
//! ```
//!
//! All numbers are big-endian. Checkpoints and trajectories, in further keyspaces, are not read:
//! they are made again from the journal.
//!
//! The new store is written beside the old one, whose files stay until the new one is whole: a
//! crash leaves a store of format 1, or one of format 2 with files that the next migration removes.

#[cfg(test)]
mod fixture;
pub(super) mod marker;

use std::fs;
use std::io;
use std::path::Path;

use fjall::{CompressionType, Database, Keyspace, KeyspaceCreateOptions, Readable};

use super::local::record::{self, SpaceRecord};
use super::local::{FORMAT_VERSION, SPACES, files, is_local_store};
use super::log::{Extent, SpaceLog, Survey, create_mark};
use super::{SpaceNumber, StoreError, StoredSpace};
use marker::{KEYSPACES, MARKER, is_store};

/// Ending of fjall's journals.
const JOURNAL_ENDING: &str = ".jnl";
/// Directory of the new store until it is whole.
const UNFINISHED: &str = "format-2.new";

/// Makes a store of format 1 one of the present format, with the same spaces and journals; leaves
/// any other directory as it is. `samples_in` counts the samples in a block. Says whether there was
/// one.
///
/// # Errors
/// The old store is in use or damaged, or there is no room for the new one beside it.
pub fn migrate(directory: &Path, samples_in: fn(&[u8]) -> u64) -> Result<bool, StoreError> {
    let on_disk = |error: io::Error| StoreError::on_disk(&error, directory);
    if directory.join(MARKER).exists() && is_local_store(directory)? {
        remove_old(directory).map_err(on_disk)?;
    }
    if !is_store(directory) {
        return Ok(false);
    }
    tracing::info!(directory = %directory.display(), "the store is made anew in format 2");
    let old = Old::open(directory)?;
    let unfinished = directory.join(UNFINISHED);
    files::remove_tree(&unfinished).map_err(on_disk)?;
    files::remove_tree(&directory.join(SPACES)).map_err(on_disk)?;
    fs::create_dir(&unfinished).map_err(on_disk)?;
    for space in old.spaces()? {
        old.copy(
            &space,
            &unfinished.join(space.number.0.to_string()),
            samples_in,
        )?;
    }
    files::sync_directory(&unfinished).map_err(on_disk)?;
    files::rename(&unfinished, &directory.join(SPACES)).map_err(on_disk)?;
    record::write(
        directory,
        record::NEXT_SPACE,
        &old.next_space()?.to_le_bytes(),
    )?;
    // The deciding step.
    record::write(directory, record::FORMAT, &FORMAT_VERSION.to_le_bytes())?;
    drop(old);
    remove_old(directory).map_err(on_disk)?;
    Ok(true)
}

/// Removes the files of format 1, the one by which the store is recognised last.
fn remove_old(directory: &Path) -> io::Result<()> {
    files::remove_tree(&directory.join(KEYSPACES))?;
    for name in files::names(directory)? {
        if name.ends_with(JOURNAL_ENDING) {
            files::remove(&directory.join(name))?;
        }
    }
    files::remove(&directory.join(MARKER))?;
    files::sync_directory(directory)
}

/// An open store of format 1.
struct Old {
    database: Database,
    meta: Keyspace,
    journal: Keyspace,
}

impl Old {
    fn open(directory: &Path) -> Result<Self, StoreError> {
        let on_open = |error: fjall::Error| match error {
            fjall::Error::Locked => StoreError::Locked(directory.display().to_string()),
            error => damaged(&error),
        };
        let database = Database::builder(directory)
            .journal_compression(CompressionType::None)
            .open()
            .map_err(on_open)?;
        let keyspace = |name| {
            if !database.keyspace_exists(name) {
                return Err(StoreError::Corrupt(format!("format 1: no keyspace {name}")));
            }
            let opened = database.keyspace(name, KeyspaceCreateOptions::default);
            opened.map_err(on_open)
        };
        let (meta, journal) = (keyspace("meta")?, keyspace("journal")?);
        let old = Self {
            meta,
            journal,
            database: database.clone(),
        };
        match old.number("format")? {
            Some(1) => Ok(old),
            found => Err(StoreError::Corrupt(format!("format 1: it says {found:?}"))),
        }
    }

    fn number(&self, key: &str) -> Result<Option<u32>, StoreError> {
        let value = self.meta.get(key).map_err(|error| damaged(&error))?;
        let number = |value: fjall::UserValue| {
            let bytes = <[u8; 4]>::try_from(&*value).map_err(|_| corrupt(key))?;
            Ok(u32::from_be_bytes(bytes))
        };
        value.map(number).transpose()
    }

    fn next_space(&self) -> Result<u32, StoreError> {
        Ok(self.number("next_space")?.unwrap_or(0))
    }

    fn spaces(&self) -> Result<Vec<StoredSpace>, StoreError> {
        let mut spaces = Vec::new();
        for entry in self.meta.prefix("space/") {
            let (key, value) = entry.into_inner().map_err(|error| damaged(&error))?;
            let space = space_from(&key, &value).ok_or_else(|| corrupt("a space"))?;
            spaces.push(space);
        }
        spaces.sort_by_key(|space| space.number);
        Ok(spaces)
    }

    /// Writes a space as format 2 has it.
    fn copy(
        &self,
        space: &StoredSpace,
        to: &Path,
        samples_in: fn(&[u8]) -> u64,
    ) -> Result<(), StoreError> {
        let on_disk = |error: io::Error| StoreError::on_disk(&error, to);
        fs::create_dir(to).map_err(on_disk)?;
        let record = SpaceRecord {
            space: space.clone(),
            replaces: None,
        };
        record::write(to, record::SPACE, &record.encode()?)?;
        create_mark(to, space.number, Extent::default()).map_err(on_disk)?;
        let survey = Survey::of(to, space.number).map_err(on_disk)?;
        let log = SpaceLog::open(to, space.number, &survey).map_err(on_disk)?;
        let prefix = space.number.0.to_be_bytes();
        let snapshot = self.database.snapshot();
        for entry in snapshot.prefix(&self.journal, prefix) {
            let (key, block) = entry.into_inner().map_err(|error| damaged(&error))?;
            let number = key.get(4..).and_then(|number| number.try_into().ok());
            let number = number
                .map(u64::from_be_bytes)
                .ok_or_else(|| corrupt("a block's key"))?;
            let expected = log.appended().blocks;
            if number != expected {
                let name = &space.name;
                return Err(StoreError::Corrupt(format!(
                    "format 1: block {expected} of space {name:?} is missing"
                )));
            }
            log.append(number, samples_in(&block), &block)
                .map_err(on_disk)?;
        }
        if let Some(pending) = log.pending() {
            log.sync(&pending).map_err(on_disk)?;
        }
        log.sync_mark().map_err(on_disk)
    }
}

/// A space from its record.
fn space_from(key: &[u8], value: &[u8]) -> Option<StoredSpace> {
    let number = std::str::from_utf8(key.strip_prefix(b"space/")?).ok()?;
    let (name_len, rest) = value.strip_prefix(&[1])?.split_first_chunk()?;
    let (name, settings) = rest.split_at_checked(u32::from_be_bytes(*name_len) as usize)?;
    Some(StoredSpace {
        number: SpaceNumber(number.parse().ok()?),
        name: std::str::from_utf8(name).ok()?.to_owned(),
        settings: Some(settings.to_vec()),
    })
}

fn damaged(error: &fjall::Error) -> StoreError {
    StoreError::Corrupt(format!("format 1: {error}"))
}

fn corrupt(what: &str) -> StoreError {
    StoreError::Corrupt(format!("format 1: {what} does not make sense"))
}
