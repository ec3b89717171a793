//! The store: the journal, which is the ground state, and what is derived from it.
//!
//! Two ports, [`Journal`] and [`Derived`], and their ends: the embedded one ([`LocalStore`]), and
//! one on object storage (`ObjectStore`, with the feature `object-storage`). Whatever happens to
//! derived state, it is dropped and made again from the journal. Everything else of the service
//! speaks to the ports, and only the ends know a format.

mod backup;
mod copy;
mod derived;
mod error;
mod format1;
mod local;
mod log;
#[cfg(feature = "object-storage")]
mod object;
mod shard;
#[cfg(test)]
mod suite;
mod whole;

use cognitive_map::CheckpointPage;

/// Most files that the store has open: segment and mark of each of the most spaces, the tables of
/// what is derived, and those of merges.
pub const OPEN_FILES_MAX: usize = 2 * 256 + 2 * derived::CACHED_FILES_MAX;

#[cfg(test)]
pub(crate) use local::disk_model;

pub use backup::{BackupReport, SpaceBackup, backup, restore};
pub use copy::{CopiedSpace, copy};
pub use error::{DamagedJournal, DerivedError, StoreError};
pub use format1::migrate;
pub use local::{FORMAT_VERSION, LocalJournal, LocalStore, Replacement, SpaceSurvey, verify};
pub use log::{Damage, Extent, Flaw, Survey};
#[cfg(feature = "object-storage")]
pub use object::{NodeId, NodeRecord, ObjectStorage, ObjectStore, OwnerRecord, Registry, Seen};
pub use shard::{ShardNumber, Shards};
pub use whole::WholeStore;

/// A space as the store knows it. The number is never used again, the name may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SpaceNumber(pub u32);

/// A space that the store holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredSpace {
    /// Its number.
    pub number: SpaceNumber,
    /// Its name; `space-` and its number where its record is lost.
    pub name: String,
    /// Its settings, as the engine wrote them; none where its record is lost.
    pub settings: Option<Vec<u8>>,
}

/// A journal that is ready to be appended to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OpenJournal {
    /// What it holds: the number of its blocks is that of the next one.
    pub extent: Extent,
    /// What was cut off its end: a block that was never acknowledged, caught by a crash.
    pub cut: Option<Damage>,
    /// Whether it could not be told how far the journal was acknowledged, and so whether blocks at
    /// its end are missing.
    pub mark_lost: bool,
}

/// Derived state as it was after a block of the journal.
#[derive(Clone, Debug)]
pub struct Checkpoint {
    /// Number of the first journal block that the checkpoint does not include.
    pub next_block: u64,
    /// The pages of the map.
    pub pages: Vec<CheckpointPage>,
    /// State of the trajectory recorders, as the engine wrote it.
    pub recorders: Vec<u8>,
}

/// Where a chunk of a trajectory belongs. Chunks of a session are ordered by their first stamp.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ChunkKey {
    /// Agent.
    pub agent: u32,
    /// Session of the agent.
    pub session: u64,
    /// Stamp of the chunk's first pose \[ns\].
    pub first_stamp_ns: i64,
}

/// A chunk of a trajectory under its key.
pub type StoredChunk = (ChunkKey, Vec<u8>);

/// Blocks of the journal, with their numbers, in order. After an error there are no more.
pub type Blocks<'a> = Box<dyn Iterator<Item = Result<(u64, Vec<u8>), StoreError>> + 'a>;

/// The port of a journal for each space. All methods may be called from any thread; each space has
/// one writer.
///
/// What [`Journal::append`] has written survives the process and a power cut after the next
/// [`Journal::sync`] has returned; on the embedded end it survives the process at once. After an
/// error of either the journal refuses all further changes ([`StoreError::DiskFull`] or
/// [`StoreError::Fenced`] once more, or [`StoreError::Broken`]); reading goes on.
pub trait Journal: std::fmt::Debug + Send + Sync + 'static {
    /// Number of this process as the owner of the journals, larger than that of any owner before; 0
    /// where one machine alone can own them, as on the embedded end.
    fn term(&self) -> u64 {
        0
    }

    /// The spaces, by number.
    ///
    /// # Errors
    /// The journal cannot be read.
    fn spaces(&self) -> Result<Vec<StoredSpace>, StoreError>;

    /// Creates a space durably, under a new number.
    ///
    /// # Errors
    /// The name is taken, or the journal cannot be written.
    fn create_space(&self, name: &str, settings: &[u8]) -> Result<SpaceNumber, StoreError>;

    /// Begins a space that is in the store when it is finished, with all its blocks.
    ///
    /// # Errors
    /// The name is taken, or the journal cannot be written.
    fn draft<'a>(&'a self, name: &str, settings: &[u8]) -> Result<Box<dyn Draft + 'a>, StoreError>;

    /// Deletes a space durably, with all that belongs to it.
    ///
    /// # Errors
    /// The journal cannot be written.
    fn delete_space(&self, space: SpaceNumber) -> Result<(), StoreError>;

    /// Checks every block of a space's journal, and makes it ready to be appended to. This may take
    /// as long as the disk needs to read it.
    ///
    /// # Errors
    /// [`StoreError::Damaged`] when something that was acknowledged is damaged or missing.
    fn open_journal(&self, space: SpaceNumber) -> Result<OpenJournal, StoreError>;

    /// Appends block number `block`, which holds `samples` samples, to the open journal of a space.
    ///
    /// # Errors
    /// The journal cannot be written.
    fn append(
        &self,
        space: SpaceNumber,
        block: u64,
        samples: u64,
        bytes: &[u8],
    ) -> Result<(), StoreError>;

    /// Makes durable all that was appended before the call, and remembers outside the journal how
    /// far that is.
    ///
    /// # Errors
    /// The journal cannot be written.
    fn sync(&self) -> Result<(), StoreError>;

    /// The journal of a space from block `from` on: up to its end when asked, or to the first
    /// damage.
    fn journal(&self, space: SpaceNumber, from: u64) -> Blocks<'_>;

    /// Whether the journal still takes changes, as far as is known without asking the disk.
    ///
    /// # Errors
    /// [`StoreError::Fenced`]: another process owns it.
    fn check_ownership(&self) -> Result<(), StoreError> {
        Ok(())
    }

    /// Grows when there may be something new to read in a journal that another process writes; 0
    /// where this process does.
    fn progress(&self) -> u64 {
        0
    }

    /// Gives the journal up, so that another process may own it at once. Nothing is written
    /// afterwards.
    fn give_up(&self) {}
}

/// A space that is being written and that nobody sees. Dropped before it is finished, it leaves the
/// store as it was; so does a crash.
pub trait Draft: std::fmt::Debug {
    /// Appends the next block, which holds `samples` samples.
    ///
    /// # Errors
    /// The journal cannot be written.
    fn append(&mut self, samples: u64, bytes: &[u8]) -> Result<(), StoreError>;

    /// Puts the space into the store, durably and in one step. Returns its number.
    ///
    /// # Errors
    /// The name has been taken meanwhile, or the journal cannot be written.
    fn finish(self: Box<Self>) -> Result<SpaceNumber, StoreError>;
}

/// The port of what is derived from the journals: checkpoints and trajectories. A failure loses
/// nothing that the journal does not hold, and stops nobody: after a failed write, further ones
/// fail at once, and the next start finds no derived state and makes it anew.
pub trait Derived: std::fmt::Debug + Send + Sync + 'static {
    /// Writes, in one atomic step, the pages that changed since the checkpoint before, the state of
    /// the trajectory recorders, and up to where in the journal they reach. A page of no bytes
    /// removes what is stored of it.
    ///
    /// # Errors
    /// It cannot be written.
    fn write_checkpoint(
        &self,
        space: SpaceNumber,
        changed: &Checkpoint,
    ) -> Result<(), DerivedError>;

    /// The whole checkpoint of a space: all pages, merged over the writes.
    ///
    /// # Errors
    /// It cannot be read.
    fn checkpoint(&self, space: SpaceNumber) -> Result<Option<Checkpoint>, DerivedError>;

    /// Forgets all that is derived of a space.
    ///
    /// # Errors
    /// It cannot be written.
    fn forget(&self, space: SpaceNumber) -> Result<(), DerivedError>;

    /// Writes (or writes again) a chunk of a trajectory.
    ///
    /// # Errors
    /// It cannot be written.
    fn put_chunk(
        &self,
        space: SpaceNumber,
        key: ChunkKey,
        bytes: &[u8],
    ) -> Result<(), DerivedError>;

    /// Chunks of an agent's session, in order, from the last one that begins at or before
    /// `from_ns`.
    ///
    /// # Errors
    /// They cannot be read.
    fn chunks(
        &self,
        space: SpaceNumber,
        agent: u32,
        session: u64,
        from_ns: i64,
        limit: usize,
    ) -> Result<Vec<StoredChunk>, DerivedError>;
}

/// Both ports.
pub trait Store: Journal + Derived {}

impl<T: Journal + Derived> Store for T {}
