//! Both ports in one directory: the journals, and beside them what is derived.

use std::path::Path;

use super::super::derived::FjallDerived;
use super::super::{
    Blocks, Checkpoint, ChunkKey, Derived, DerivedError, Draft, Journal, OpenJournal, SpaceNumber,
    StoreError, StoredChunk, StoredSpace,
};
use super::{LocalJournal, opening};

/// The store in a directory of this machine. One process has it open at a time.
#[derive(Debug)]
pub struct LocalStore {
    // Closed first: the lock of the directory goes with the journals.
    derived: FjallDerived,
    journal: LocalJournal,
}

impl LocalStore {
    /// Opens the store in `directory`, and creates both where they are absent. Derived state that
    /// cannot be opened is dropped. A failure leaves no directory behind that was not there.
    ///
    /// # Errors
    /// Those of [`LocalJournal::open`], and [`StoreError::Io`] when the directory holds something
    /// else.
    pub fn open(directory: &Path) -> Result<Self, StoreError> {
        let opened = opening::open(directory, true)?;
        let opening::Opened { journal, created } = opened;
        let spaces = journal.spaces();
        let derived = spaces.and_then(|spaces| {
            let numbers = spaces.iter().map(|space| space.number);
            FjallDerived::open(&directory.join("derived"), numbers)
        });
        match derived {
            Ok(derived) => Ok(Self { derived, journal }),
            Err(error) => {
                drop(journal);
                opening::remove_created(created.as_deref());
                Err(error)
            }
        }
    }

    /// The journals.
    pub fn journals(&self) -> &LocalJournal {
        &self.journal
    }
}

impl Journal for LocalStore {
    fn spaces(&self) -> Result<Vec<StoredSpace>, StoreError> {
        self.journal.spaces()
    }

    fn create_space(&self, name: &str, settings: &[u8]) -> Result<SpaceNumber, StoreError> {
        self.journal.create_space(name, settings)
    }

    fn draft<'a>(&'a self, name: &str, settings: &[u8]) -> Result<Box<dyn Draft + 'a>, StoreError> {
        self.journal.draft(name, settings)
    }

    fn delete_space(&self, space: SpaceNumber) -> Result<(), StoreError> {
        self.journal.delete_space(space)?;
        // The space is gone; what is left of it here goes at the next start at the latest.
        if let Err(error) = self.derived.forget(space) {
            tracing::warn!(%error, space = space.0, "drop the derived state of a deleted space");
        }
        Ok(())
    }

    fn open_journal(&self, space: SpaceNumber) -> Result<OpenJournal, StoreError> {
        self.journal.open_journal(space)
    }

    fn append(
        &self,
        space: SpaceNumber,
        block: u64,
        samples: u64,
        bytes: &[u8],
    ) -> Result<(), StoreError> {
        self.journal.append(space, block, samples, bytes)
    }

    fn sync(&self) -> Result<(), StoreError> {
        self.journal.sync()
    }

    fn journal(&self, space: SpaceNumber, from: u64) -> Blocks<'_> {
        self.journal.journal(space, from)
    }
}

impl Derived for LocalStore {
    fn write_checkpoint(
        &self,
        space: SpaceNumber,
        changed: &Checkpoint,
    ) -> Result<(), DerivedError> {
        self.derived.write_checkpoint(space, changed)
    }

    fn checkpoint(&self, space: SpaceNumber) -> Result<Option<Checkpoint>, DerivedError> {
        self.derived.checkpoint(space)
    }

    fn forget(&self, space: SpaceNumber) -> Result<(), DerivedError> {
        self.derived.forget(space)
    }

    fn put_chunk(
        &self,
        space: SpaceNumber,
        key: ChunkKey,
        bytes: &[u8],
    ) -> Result<(), DerivedError> {
        self.derived.put_chunk(space, key, bytes)
    }

    fn chunks(
        &self,
        space: SpaceNumber,
        agent: u32,
        session: u64,
        from_ns: i64,
        limit: usize,
    ) -> Result<Vec<StoredChunk>, DerivedError> {
        self.derived.chunks(space, agent, session, from_ns, limit)
    }
}
