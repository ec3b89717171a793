//! A journal in the place of a damaged one.

use std::path::PathBuf;

use super::super::log::SpaceLog;
use super::super::{SpaceNumber, StoreError, StoredSpace};
use super::opening::set_aside;
use super::record::{self, SpaceRecord};
use super::{LocalJournal, files};

/// A new journal of a space, which takes the place of the present one when it is finished. Dropped
/// before, it leaves the store as it was.
#[derive(Debug)]
pub struct Replacement<'a> {
    journal: &'a LocalJournal,
    record: SpaceRecord,
    replaced: SpaceNumber,
    unfinished: PathBuf,
    log: SpaceLog,
}

impl LocalJournal {
    /// Begins a journal in the place of that of a space, with its name and settings.
    ///
    /// # Errors
    /// The store cannot be written.
    pub fn replace(&self, space: &StoredSpace) -> Result<Replacement<'_>, StoreError> {
        let _changing = self.lock_spaces();
        let replaced = space.number;
        self.refuse_if_broken()?;
        let record = SpaceRecord {
            space: StoredSpace {
                number: self.take_number()?,
                ..space.clone()
            },
            replaces: Some(replaced),
        };
        let (unfinished, log) = self.begin_space(&record)?;
        Ok(Replacement {
            journal: self,
            record,
            replaced,
            unfinished,
            log,
        })
    }
}

impl Replacement<'_> {
    /// Appends the next block, which holds `samples` samples.
    ///
    /// # Errors
    /// The store cannot be written.
    pub fn append(&mut self, samples: u64, bytes: &[u8]) -> Result<(), StoreError> {
        let block = self.log.appended().blocks;
        let write = || self.log.append(block, samples, bytes);
        self.journal.change(&self.unfinished, write)
    }

    /// Puts the journal in the place of the other one, durably. Returns the space's new number, and
    /// the directory where the other journal is kept.
    ///
    /// # Errors
    /// The store cannot be written.
    pub fn finish(mut self) -> Result<(SpaceNumber, PathBuf), StoreError> {
        let journal = self.journal;
        let number = self.record.space.number;
        let directory = journal.space_directory(number);
        journal.change(&self.unfinished, || {
            if let Some(pending) = self.log.pending() {
                self.log.sync(&pending)?;
            }
            self.log.sync_mark()?;
            // From here on the store is repaired; a crash leaves the rest to the next opening.
            files::rename(&self.unfinished, &directory)
        })?;
        let aside = set_aside(&journal.directory, self.replaced)?;
        self.record.replaces = None;
        record::write(&directory, record::SPACE, &self.record.encode()?)?;
        Ok((number, aside))
    }
}
