//! The embedded end of the store: a directory of this machine, which one process has open at a
//! time.
//!
//! # Format 2
//!
//! ```text
//! format, next_space                 records, see `record.rs`; each has a second copy, NAME.copy
//! lock                               locked while a process has the store open
//! spaces/{number}/space              record: name and settings
//! spaces/{number}/durable            how far the journal was acknowledged, see `log/mark.rs`
//! spaces/{number}/{first block}.log  segments of the journal, see `log/frame.rs`; 16 hex digits
//! set-aside/{number}                 spaces as they were before a repair
//! deleted/{number}                   spaces that are being deleted
//! derived/                           what can be made again, by fjall; see `derived/mod.rs`
//! ```
//!
//! Files of the journal are only appended to, so a running store can be copied up to its marks.
//! Blocks and settings are the engine's, which versions its own bytes. A name that ends in `.new`
//! is not finished, and opening the store removes it.

mod draft;
pub(super) mod files;
mod opening;
pub(super) mod record;
mod store;
mod survey;
mod syncing;

#[cfg(test)]
mod damage_tests;
#[cfg(test)]
pub(crate) mod disk_model;
#[cfg(test)]
mod power_cut_tests;
#[cfg(test)]
mod tests;

#[cfg(test)]
pub(super) use tests::copy_files as copy_for_tests;

use std::collections::BTreeSet;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use super::log::{Item, LogReader, Pending, SpaceLog, Survey, create_mark, read_mark};
use super::{
    Blocks, DamagedJournal, Draft, Extent, Journal, OpenJournal, SpaceNumber, StoreError,
    StoredSpace,
};
use record::{Found, SpaceRecord};
use syncing::{Logs, MarkSync, sync_all};

pub use draft::Replacement;
pub(super) use opening::{is_store as is_local_store, lock, refuse_foreign};
pub use store::LocalStore;
pub use survey::{SpaceSurvey, verify};

/// Newest disk format that this build reads, and the one it writes.
pub const FORMAT_VERSION: u32 = 2;

/// Directory of the spaces.
pub(super) const SPACES: &str = "spaces";
/// Directory of the spaces as they were before a repair.
const SET_ASIDE: &str = "set-aside";
/// Directory of the spaces that are being deleted.
const DELETED: &str = "deleted";
/// Ending of names that are not finished.
const UNFINISHED: &str = ".new";

/// The journals in a directory of this machine.
#[derive(Debug)]
pub struct LocalJournal {
    directory: PathBuf,
    /// Held while the list of spaces changes, so that two creations cannot take the same name.
    changing: Mutex<()>,
    /// Held while directories are synced, so that none is moved away meanwhile.
    syncing: Mutex<()>,
    logs: Arc<Logs>,
    /// The first failed write of a journal.
    failure: OnceLock<FirstFailure>,
    marks: Option<MarkSync>,
    /// Locked as long as it is open.
    _lock: File,
}

/// What all are told who want to write after it.
#[derive(Debug)]
struct FirstFailure {
    disk_full: bool,
    detail: String,
}

impl LocalJournal {
    /// Opens the journals of the store in `directory`.
    ///
    /// # Errors
    /// [`StoreError::Locked`] when another process has it open, [`StoreError::NewerFormat`] and
    /// [`StoreError::OlderFormat`] when another version has written it, [`StoreError::Corrupt`]
    /// when its records do not make sense, and [`StoreError::Io`] when the directory holds no
    /// store.
    pub fn open(directory: &Path) -> Result<Self, StoreError> {
        opening::open(directory, false).map(|opened| opened.journal)
    }

    /// A space, by name.
    ///
    /// # Errors
    /// There is none of that name.
    pub fn space(&self, name: &str) -> Result<StoredSpace, StoreError> {
        let spaces = self.spaces()?;
        let found = spaces.into_iter().find(|space| space.name == name);
        found.ok_or_else(|| StoreError::Io(format!("the store has no space {name:?}")))
    }

    /// Reads the journal of a space from one end to the other. Changes nothing.
    ///
    /// # Errors
    /// Its files cannot be opened.
    pub fn survey(&self, space: SpaceNumber) -> Result<Survey, StoreError> {
        let directory = self.space_directory(space);
        Survey::of(&directory, space).map_err(|error| StoreError::on_disk(&error, &directory))
    }

    /// Passes every readable block of a space to `take`, in order, with its number and samples, and
    /// every damage between them.
    ///
    /// # Errors
    /// The files cannot be opened.
    pub fn read_all(
        &self,
        space: SpaceNumber,
        mut take: impl FnMut(Result<(u64, u64, &[u8]), super::Damage>),
    ) -> Result<(), StoreError> {
        let directory = self.space_directory(space);
        let fault = |error: io::Error| StoreError::on_disk(&error, &directory);
        let mut reader = LogReader::open(&directory, space, 0).map_err(fault)?;
        while let Some(item) = reader.next().map_err(fault)? {
            match item {
                Item::Block(header) => take(Ok((header.block, header.samples, reader.payload()))),
                Item::Damage(damage) => take(Err(damage)),
            }
        }
        Ok(())
    }

    /// Runs a write of a journal, unless one has failed before. What a failed one has left on the
    /// disk is unknown, so it is the last one.
    fn write(&self, write: impl FnOnce() -> io::Result<()>) -> Result<(), StoreError> {
        self.change(&self.directory, write).inspect_err(|error| {
            self.failure.get_or_init(|| FirstFailure {
                disk_full: matches!(error, StoreError::DiskFull),
                detail: error.to_string(),
            });
        })
    }

    /// Runs a change beside the journals that are being written, unless a write has failed before.
    /// A failed one leaves what the next opening clears.
    fn change<T>(
        &self,
        what: &Path,
        change: impl FnOnce() -> io::Result<T>,
    ) -> Result<T, StoreError> {
        self.refuse_if_broken()?;
        change().map_err(|error| StoreError::on_disk(&error, what))
    }

    fn refuse_if_broken(&self) -> Result<(), StoreError> {
        match self.failure.get() {
            None => Ok(()),
            Some(failure) if failure.disk_full => Err(StoreError::DiskFull),
            Some(failure) => Err(StoreError::Broken(failure.detail.clone())),
        }
    }

    fn space_directory(&self, space: SpaceNumber) -> PathBuf {
        self.directory.join(SPACES).join(space.0.to_string())
    }

    fn log(&self, space: SpaceNumber) -> Option<Arc<SpaceLog>> {
        let logs = self.logs.read().unwrap_or_else(PoisonError::into_inner);
        logs.get(&space).cloned()
    }

    fn keep_log(&self, space: SpaceNumber, log: SpaceLog) -> Arc<SpaceLog> {
        let log = Arc::new(log);
        let mut logs = self.logs.write().unwrap_or_else(PoisonError::into_inner);
        logs.insert(space, Arc::clone(&log));
        log
    }

    /// Takes the number of a new space.
    fn take_number(&self) -> Result<SpaceNumber, StoreError> {
        let next = match record::read(&self.directory, record::NEXT_SPACE)? {
            Found::Contents(contents) => record::number(&contents),
            Found::Nothing | Found::Damaged => None,
        };
        // Where the record is lost, the numbers that are in use tell enough.
        let used = [SPACES, SET_ASIDE, DELETED].map(|part| numbers(&self.directory.join(part)));
        let beyond_used = used.into_iter().flatten().flatten().max();
        let beyond_used = beyond_used.map_or(0, |number| number.saturating_add(1));
        let number = next.unwrap_or(0).max(beyond_used);
        let next = number
            .checked_add(1)
            .ok_or_else(|| StoreError::Io("all space numbers are used up".to_owned()))?;
        record::write(&self.directory, record::NEXT_SPACE, &next.to_le_bytes())?;
        Ok(SpaceNumber(number))
    }

    /// Writes a space without a journal under an unfinished name, and opens its journal.
    fn begin_space(&self, record: &SpaceRecord) -> Result<(PathBuf, SpaceLog), StoreError> {
        let space = record.space.number;
        let directory = self.space_directory(space);
        let unfinished = self
            .directory
            .join(SPACES)
            .join(format!("{}{UNFINISHED}", space.0));
        let fault = |error: io::Error| StoreError::on_disk(&error, &directory);
        files::remove_tree(&unfinished).map_err(fault)?;
        std::fs::create_dir(&unfinished).map_err(fault)?;
        record::write(&unfinished, record::SPACE, &record.encode()?)?;
        create_mark(&unfinished, space, Extent::default()).map_err(fault)?;
        let survey = Survey::of(&unfinished, space).map_err(fault)?;
        let log = SpaceLog::open(&unfinished, space, &survey).map_err(fault)?;
        Ok((unfinished, log))
    }

    fn refuse_taken(&self, name: &str) -> Result<(), StoreError> {
        if self.spaces()?.iter().any(|space| space.name == name) {
            return Err(StoreError::SpaceExists(name.to_owned()));
        }
        Ok(())
    }

    fn lock_spaces(&self) -> MutexGuard<'_, ()> {
        // The lock guards no data of its own, so a panic under it leaves nothing half done.
        self.changing.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Journal for LocalJournal {
    fn spaces(&self) -> Result<Vec<StoredSpace>, StoreError> {
        let parent = self.directory.join(SPACES);
        let mut spaces = Vec::new();
        for number in numbers(&parent).map_err(|error| StoreError::on_disk(&error, &parent))? {
            spaces.push(stored_space(&parent, SpaceNumber(number))?);
        }
        // The placeholder of a lost name must not be another space's name.
        let known = spaces.iter().filter(|space| space.settings.is_some());
        let known: BTreeSet<_> = known.map(|space| space.name.clone()).collect();
        for lost in spaces.iter_mut().filter(|space| space.settings.is_none()) {
            while known.contains(&lost.name) {
                lost.name.push_str("-lost");
            }
        }
        Ok(spaces)
    }

    fn create_space(&self, name: &str, settings: &[u8]) -> Result<SpaceNumber, StoreError> {
        let _changing = self.lock_spaces();
        self.refuse_taken(name)?;
        self.begin(name, Some(settings), None)?.publish()
    }

    fn draft<'a>(&'a self, name: &str, settings: &[u8]) -> Result<Box<dyn Draft + 'a>, StoreError> {
        let _changing = self.lock_spaces();
        self.refuse_taken(name)?;
        Ok(Box::new(self.begin(name, Some(settings), None)?))
    }

    fn delete_space(&self, space: SpaceNumber) -> Result<(), StoreError> {
        let _changing = self.lock_spaces();
        let directory = self.space_directory(space);
        if !directory.exists() {
            return Ok(());
        }
        let parent = self.directory.join(DELETED);
        let doomed = parent.join(space.0.to_string());
        self.change(&directory, || {
            let _not_syncing = self.syncing.lock().unwrap_or_else(PoisonError::into_inner);
            // Held for a moment only, for the writers of all spaces pass here.
            let logs = self.logs.write();
            logs.unwrap_or_else(PoisonError::into_inner).remove(&space);
            files::create_directory(&parent)?;
            files::remove_tree(&doomed)?;
            // One step decides: before it the space is whole, after it the space is gone, and what
            // is left are files that nobody reads.
            files::rename(&directory, &doomed)
        })?;
        self.change(&doomed, || files::remove_tree(&doomed))
    }

    fn open_journal(&self, space: SpaceNumber) -> Result<OpenJournal, StoreError> {
        if let Some(log) = self.log(space) {
            return Ok(OpenJournal {
                extent: log.appended(),
                cut: None,
                mark_lost: false,
            });
        }
        let directory = self.space_directory(space);
        let survey = self.survey(space)?;
        let name = stored_space(&self.directory.join(SPACES), space)?.name;
        if let Some(damaged) = DamagedJournal::of(&name, &survey) {
            return Err(StoreError::Damaged(Box::new(damaged)));
        }
        let log = self.change(&directory, || SpaceLog::open(&directory, space, &survey))?;
        self.keep_log(space, log);
        Ok(OpenJournal {
            extent: survey.end,
            cut: survey.torn_tail,
            mark_lost: survey.mark_lost,
        })
    }

    fn append(
        &self,
        space: SpaceNumber,
        block: u64,
        samples: u64,
        bytes: &[u8],
    ) -> Result<(), StoreError> {
        let Some(log) = self.log(space) else {
            return Err(StoreError::Io(format!(
                "the journal of space {} is not open",
                space.0
            )));
        };
        self.write(|| log.append(block, samples, bytes))
    }

    fn sync(&self) -> Result<(), StoreError> {
        let _syncing = self.syncing.lock().unwrap_or_else(PoisonError::into_inner);
        let pending: Vec<(Arc<SpaceLog>, Pending)> = {
            let logs = self.logs.read().unwrap_or_else(PoisonError::into_inner);
            let pending = logs.values().map(|log| (log, log.pending()));
            pending
                .filter_map(|(log, pending)| Some((Arc::clone(log), pending?)))
                .collect()
        };
        self.write(|| sync_all(&pending))?;
        if let Some(marks) = &self.marks {
            marks.wake(!pending.is_empty());
        }
        Ok(())
    }

    fn journal(&self, space: SpaceNumber, from: u64) -> Blocks<'_> {
        let end = self
            .log(space)
            .map_or(u64::MAX, |log| log.appended().blocks);
        let directory = self.space_directory(space);
        // The mark first: what it says is in the journal by then.
        let opened = read_mark(&directory, space)
            .and_then(|mark| Ok((mark, LogReader::open(&directory, space, from)?)));
        match opened {
            Ok((mark, reader)) => Box::new(Reading {
                journal: self,
                space,
                reader: Some(reader),
                next: from,
                acknowledged: mark.unwrap_or_default().blocks.min(end),
                end,
            }),
            Err(error) => Box::new(std::iter::once(Err(StoreError::on_disk(
                &error, &directory,
            )))),
        }
    }
}

/// Blocks of a journal, up to the first damage.
struct Reading<'a> {
    journal: &'a LocalJournal,
    space: SpaceNumber,
    /// None after the end or an error.
    reader: Option<LogReader>,
    /// Number of the next block.
    next: u64,
    /// Blocks that were acknowledged when the reading began.
    acknowledged: u64,
    /// Number of the block that was next when the reading began.
    end: u64,
}

impl Iterator for Reading<'_> {
    type Item = Result<(u64, Vec<u8>), StoreError>;

    fn next(&mut self) -> Option<Self::Item> {
        let mut reader = self.reader.take()?;
        match reader.next() {
            Ok(Some(Item::Block(header))) if header.block < self.end => {
                let payload = reader.payload().to_vec();
                self.reader = Some(reader);
                self.next = header.block + 1;
                Some(Ok((header.block, payload)))
            }
            Ok(Some(Item::Damage(damage))) if damage.block < self.end => self.damaged().map(Err),
            Ok(None) if self.next < self.acknowledged => self.damaged().map(Err),
            Ok(_) => None,
            Err(error) => Some(Err(StoreError::on_disk(&error, &self.journal.directory))),
        }
    }
}

impl Reading<'_> {
    /// What a survey says of a damage: none where it is a torn tail, and so the end.
    fn damaged(&self) -> Option<StoreError> {
        let spaces = self.journal.directory.join(SPACES);
        let damaged = self.journal.survey(self.space).and_then(|survey| {
            let name = stored_space(&spaces, self.space)?.name;
            Ok(DamagedJournal::of(&name, &survey))
        });
        match damaged {
            Ok(damaged) => Some(StoreError::Damaged(Box::new(damaged?))),
            Err(error) => Some(error),
        }
    }
}

/// A space as its record says, or a placeholder where the record is lost.
pub(super) fn stored_space(spaces: &Path, number: SpaceNumber) -> Result<StoredSpace, StoreError> {
    let found = record::read(&spaces.join(number.0.to_string()), record::SPACE)?;
    let record = match found {
        Found::Contents(contents) => SpaceRecord::decode(&contents),
        Found::Nothing | Found::Damaged => None,
    };
    let of_this = record.filter(|record| record.space.number == number);
    Ok(of_this.map_or_else(
        || StoredSpace {
            number,
            name: format!("space-{}", number.0),
            settings: None,
        },
        |record| record.space,
    ))
}

/// Numbers of the spaces in a directory, in order.
pub(super) fn numbers(directory: &Path) -> io::Result<Vec<u32>> {
    let names = files::names(directory)?;
    let number = |name: &String| {
        let number: u32 = name.parse().ok()?;
        (number.to_string() == *name).then_some(number)
    };
    let mut numbers: Vec<_> = names.iter().filter_map(number).collect();
    // In decimal, 10 comes before 9.
    numbers.sort_unstable();
    Ok(numbers)
}

impl Drop for LocalJournal {
    fn drop(&mut self) {
        if let Some(marks) = self.marks.take() {
            marks.end();
        }
    }
}
