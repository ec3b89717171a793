//! Spaces that are written before they are in the store.

use std::path::PathBuf;

use super::super::log::SpaceLog;
use super::super::{Draft, SpaceNumber, StoreError, StoredSpace};
use super::opening::set_aside;
use super::record::{self, SpaceRecord};
use super::{LocalJournal, files};

/// A new space and its journal, under an unfinished name.
#[derive(Debug)]
pub(super) struct LocalDraft<'a> {
    journal: &'a LocalJournal,
    record: SpaceRecord,
    unfinished: PathBuf,
    log: SpaceLog,
}

/// A draft of a space with another journal, which takes the place of the present one.
#[derive(Debug)]
pub struct Replacement<'a> {
    draft: LocalDraft<'a>,
    replaced: SpaceNumber,
}

impl LocalJournal {
    /// Begins a journal in the place of that of a space, with its name and settings.
    ///
    /// # Errors
    /// The store cannot be written.
    pub fn replace(&self, space: &StoredSpace) -> Result<Replacement<'_>, StoreError> {
        let _changing = self.lock_spaces();
        let replaced = space.number;
        let draft = self.begin(&space.name, space.settings.as_deref(), Some(replaced))?;
        Ok(Replacement { draft, replaced })
    }

    /// Begins a draft; whoever calls holds the list of spaces.
    pub(super) fn begin(
        &self,
        name: &str,
        settings: Option<&[u8]>,
        replaces: Option<SpaceNumber>,
    ) -> Result<LocalDraft<'_>, StoreError> {
        self.refuse_if_broken()?;
        let space = StoredSpace {
            number: self.take_number()?,
            name: name.to_owned(),
            settings: settings.map(<[u8]>::to_vec),
        };
        let record = SpaceRecord { space, replaces };
        let (unfinished, log) = self.begin_space(&record)?;
        Ok(LocalDraft {
            journal: self,
            record,
            unfinished,
            log,
        })
    }
}

impl LocalDraft<'_> {
    /// Finishes it; whoever calls holds the list of spaces.
    pub(super) fn publish(&self) -> Result<SpaceNumber, StoreError> {
        let number = self.record.space.number;
        let directory = self.journal.space_directory(number);
        self.journal.change(&self.unfinished, || {
            if let Some(pending) = self.log.pending() {
                self.log.sync(&pending)?;
            }
            self.log.sync_mark()?;
            files::rename(&self.unfinished, &directory)
        })?;
        Ok(number)
    }
}

impl Draft for LocalDraft<'_> {
    fn append(&mut self, samples: u64, bytes: &[u8]) -> Result<(), StoreError> {
        let block = self.log.appended().blocks;
        let write = || self.log.append(block, samples, bytes);
        self.journal.change(&self.unfinished, write)
    }

    fn finish(self: Box<Self>) -> Result<SpaceNumber, StoreError> {
        let _changing = self.journal.lock_spaces();
        self.journal.refuse_taken(&self.record.space.name)?;
        self.publish()
    }
}

impl Replacement<'_> {
    /// Appends the next block, which holds `samples` samples.
    ///
    /// # Errors
    /// The store cannot be written.
    pub fn append(&mut self, samples: u64, bytes: &[u8]) -> Result<(), StoreError> {
        self.draft.append(samples, bytes)
    }

    /// Puts the journal in the place of the other one, durably. Returns the space's new number, and
    /// the directory where the other journal is kept.
    ///
    /// # Errors
    /// The store cannot be written.
    pub fn finish(self) -> Result<(SpaceNumber, PathBuf), StoreError> {
        let Self {
            mut draft,
            replaced,
        } = self;
        // From here on the store is repaired; a crash leaves the rest to the next opening.
        let number = draft.publish()?;
        let journal = draft.journal;
        let aside = set_aside(&journal.directory, replaced)?;
        draft.record.replaces = None;
        let directory = journal.space_directory(number);
        record::write(&directory, record::SPACE, &draft.record.encode()?)?;
        Ok((number, aside))
    }
}
