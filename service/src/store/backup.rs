//! Backups: the journals as far as they are written, copied beside the running service.
//!
//! A backup is a store directory itself, without derived state. Every block is checked while it is
//! copied, and whatever was acknowledged before the backup began is in it.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use super::local::record::{self, Found};
use super::local::{
    FORMAT_VERSION, SPACES, files, is_local_store, lock, numbers, refuse_foreign, stored_space,
    verify,
};
use super::log::{Extent, Item, LogReader, create_mark, read_mark, segment_name};
use super::{DamagedJournal, SpaceNumber, StoreError};

/// Length at which a file of a copied journal is closed \[bytes\].
const SEGMENT_BYTES: u64 = 64 << 20;

/// What a backup holds.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BackupReport {
    /// The spaces in it, by number.
    pub spaces: Vec<SpaceBackup>,
    /// Spaces that are not in it, and why.
    pub left_out: Vec<(String, String)>,
}

/// A space in a backup.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SpaceBackup {
    /// Its name.
    pub name: String,
    /// Its blocks, and the samples in them.
    pub extent: Extent,
}

/// Copies the store in `directory`, on which a service may run, to the directory `to`, which is
/// empty or absent. A damaged space is left out and named.
///
/// # Errors
/// There is no store, `to` holds something, or a disk fails.
pub fn backup(directory: &Path, to: &Path) -> Result<BackupReport, StoreError> {
    if !is_local_store(directory)? {
        refuse_foreign(directory)?;
        return Err(StoreError::Io(format!(
            "there is no store at {}",
            directory.display()
        )));
    }
    copy_store(directory, to)
}

/// Makes the store in `to`, which is empty or absent, from the backup in `backup`. Every block of
/// the backup is read and checked before anything is written.
///
/// # Errors
/// `backup` holds no whole backup, `to` holds something, or a disk fails.
pub fn restore(backup: &Path, to: &Path) -> Result<BackupReport, StoreError> {
    for surveyed in verify(backup, None)? {
        if let Some(damaged) = DamagedJournal::of(&surveyed.name, &surveyed.survey) {
            return Err(StoreError::Damaged(Box::new(damaged)));
        }
        if !surveyed.has_record || surveyed.survey.mark_lost {
            let name = surveyed.name;
            return Err(StoreError::Corrupt(format!(
                "the backup of space {name:?} is not whole"
            )));
        }
    }
    copy_store(backup, to)
}

/// Copies all spaces, and makes the directory a store when they are there.
fn copy_store(from: &Path, to: &Path) -> Result<BackupReport, StoreError> {
    let on_disk = |error: io::Error| StoreError::on_disk(&error, to);
    files::create_directory(to).map_err(on_disk)?;
    let present = files::names(to).map_err(on_disk)?;
    if let Some(name) = present.iter().find(|name| *name != "lost+found") {
        return Err(StoreError::Io(format!(
            "{} is not empty, but holds {name}",
            to.display()
        )));
    }
    let lock = lock(to)?;
    let (spaces, copied_spaces) = (from.join(SPACES), to.join(SPACES));
    files::create_directory(&copied_spaces).map_err(on_disk)?;
    let mut report = BackupReport::default();
    let present = numbers(&spaces).map_err(|error| StoreError::on_disk(&error, &spaces))?;
    for number in &present {
        let space = SpaceNumber(*number);
        let own = spaces.join(number.to_string());
        let copy = copied_spaces.join(number.to_string());
        let name = stored_space(&spaces, space)?.name;
        match copy_space(&own, &copy, space) {
            Ok(extent) => report.spaces.push(SpaceBackup { name, extent }),
            // Deleted meanwhile.
            Err(_) if !own.exists() => files::remove_tree(&copy).map_err(on_disk)?,
            Err(NotCopied::Damaged(reason)) => {
                files::remove_tree(&copy).map_err(on_disk)?;
                report.left_out.push((name, reason));
            }
            Err(NotCopied::Store(error)) => return Err(error),
        }
    }
    let next = match record::read(from, record::NEXT_SPACE)? {
        Found::Contents(contents) => record::number(&contents),
        Found::Nothing | Found::Damaged => None,
    };
    let beyond = present.last().map_or(0, |last| last.saturating_add(1));
    let next = next.unwrap_or(0).max(beyond);
    record::write(to, record::NEXT_SPACE, &next.to_le_bytes())?;
    record::write(to, record::FORMAT, &FORMAT_VERSION.to_le_bytes())?;
    drop(lock);
    Ok(report)
}

/// Why a space is not copied.
enum NotCopied {
    /// It is damaged.
    Damaged(String),
    /// A disk fails.
    Store(StoreError),
}

impl From<StoreError> for NotCopied {
    fn from(error: StoreError) -> Self {
        Self::Store(error)
    }
}

/// Copies a space, at least up to its mark.
fn copy_space(from: &Path, to: &Path, space: SpaceNumber) -> Result<Extent, NotCopied> {
    let on_read = |error: io::Error| NotCopied::Store(StoreError::on_disk(&error, from));
    let on_write = |error: io::Error| NotCopied::Store(StoreError::on_disk(&error, to));
    let Found::Contents(contents) = record::read(from, record::SPACE)? else {
        return Err(NotCopied::Damaged("its record cannot be read".to_owned()));
    };
    let Some(mark) = read_mark(from, space).map_err(on_read)? else {
        return Err(NotCopied::Damaged(
            "it is not known how far it was acknowledged".to_owned(),
        ));
    };
    files::create_directory(to).map_err(on_write)?;
    record::write(to, record::SPACE, &contents)?;
    let mut copy = Copy::new(to);
    let mut reader = LogReader::open(from, space, 0).map_err(on_read)?;
    let mut extent = Extent::default();
    // To the end, and not to the mark alone: after a power cut that is older than what was
    // acknowledged.
    loop {
        let flaw = match reader.next().map_err(on_read)? {
            Some(Item::Block(header)) => {
                let head = header.encode(space);
                copy.append(header.block, &head, reader.payload())
                    .map_err(on_write)?;
                extent = Extent {
                    blocks: header.block + 1,
                    samples: header.total,
                };
                continue;
            }
            Some(Item::Damage(damage)) => Some(damage),
            None => None,
        };
        if extent.blocks >= mark.blocks {
            break; // what follows is being written
        }
        return Err(NotCopied::Damaged(match flaw {
            Some(damage) => format!("block {} is damaged: {}", damage.block, damage.flaw),
            None => format!("blocks {} to {} are missing", extent.blocks, mark.blocks),
        }));
    }
    copy.finish().map_err(on_write)?;
    create_mark(to, space, extent).map_err(on_write)?;
    files::sync_directory(to).map_err(on_write)?;
    Ok(extent)
}

/// Segments of a copied journal.
struct Copy<'a> {
    directory: &'a Path,
    file: Option<BufWriter<File>>,
    length: u64,
}

impl<'a> Copy<'a> {
    fn new(directory: &'a Path) -> Self {
        Self {
            directory,
            file: None,
            length: 0,
        }
    }

    fn append(&mut self, block: u64, header: &[u8], payload: &[u8]) -> io::Result<()> {
        let bytes = (header.len() + payload.len()) as u64;
        if self.length + bytes > SEGMENT_BYTES {
            self.finish()?;
        }
        if self.file.is_none() {
            let file = File::create_new(self.directory.join(segment_name(block)))?;
            self.file = Some(BufWriter::new(file));
        }
        let Some(file) = &mut self.file else {
            return Err(io::Error::other("the copy has no segment"));
        };
        file.write_all(header)?;
        file.write_all(payload)?;
        self.length += bytes;
        Ok(())
    }

    /// Closes the segment durably.
    fn finish(&mut self) -> io::Result<()> {
        self.length = 0;
        if let Some(file) = self.file.take() {
            let file = file.into_inner().map_err(io::IntoInnerError::into_error)?;
            files::sync_all(&file)?;
        }
        Ok(())
    }
}
