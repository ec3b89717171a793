//! The store: where the journal and what is derived from it are kept.
//!
//! A port ([`Store`]) and its embedded end ([`FjallStore`]). Everything else of the service speaks
//! to the port, and only the ends know a disk format.

mod error;
mod fjall;

use cognitive_map::CheckpointPage;

/// Most files of tables that the store keeps open to read.
const CACHED_FILES_MAX: usize = 256;
/// Most files that it has open, those of journals and of merges among them.
pub const OPEN_FILES_MAX: usize = CACHED_FILES_MAX + 128;

pub use error::StoreError;
pub use fjall::{FORMAT_VERSION, FjallStore};

/// A space as the store knows it. The number is never used again, the name may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SpaceNumber(pub u32);

/// A space that the store holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredSpace {
    /// Its number.
    pub number: SpaceNumber,
    /// Its name.
    pub name: String,
    /// Its settings, as the engine wrote them.
    pub settings: Vec<u8>,
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

/// Blocks of the journal, with their numbers, in order.
pub type Blocks<'a> = Box<dyn Iterator<Item = Result<(u64, Vec<u8>), StoreError>> + 'a>;

/// The port. All methods may be called from any thread; each space has one writer.
///
/// What [`Store::append`] and [`Store::put_chunk`] have written survives the process at once and a
/// power cut after the next [`Store::sync`] has returned. After any error of a writing method the
/// store refuses further writes ([`StoreError::Broken`]); reading goes on.
pub trait Store: std::fmt::Debug + Send + Sync + 'static {
    /// The spaces, by number.
    ///
    /// # Errors
    /// The store cannot be read.
    fn spaces(&self) -> Result<Vec<StoredSpace>, StoreError>;

    /// Creates a space durably, under a new number.
    ///
    /// # Errors
    /// The name is taken, or the store cannot be written.
    fn create_space(&self, name: &str, settings: &[u8]) -> Result<SpaceNumber, StoreError>;

    /// Deletes a space durably, with all that belongs to it.
    ///
    /// # Errors
    /// The store cannot be written.
    fn delete_space(&self, space: SpaceNumber) -> Result<(), StoreError>;

    /// Appends block number `block` to the journal of a space.
    ///
    /// # Errors
    /// The store cannot be written.
    fn append(&self, space: SpaceNumber, block: u64, bytes: &[u8]) -> Result<(), StoreError>;

    /// Makes durable all that was written before the call.
    ///
    /// # Errors
    /// The store cannot be written.
    fn sync(&self) -> Result<(), StoreError>;

    /// The journal of a space from block `from` on.
    fn journal(&self, space: SpaceNumber, from: u64) -> Blocks<'_>;

    /// Writes, in one atomic step, the pages that changed since the checkpoint before, the state of
    /// the trajectory recorders, and up to where in the journal they reach. A page of no bytes removes
    /// what is stored of it.
    ///
    /// # Errors
    /// The store cannot be written.
    fn write_checkpoint(&self, space: SpaceNumber, changed: &Checkpoint) -> Result<(), StoreError>;

    /// The whole checkpoint of a space: all pages, merged over the writes.
    ///
    /// # Errors
    /// The store cannot be read.
    fn checkpoint(&self, space: SpaceNumber) -> Result<Option<Checkpoint>, StoreError>;

    /// Forgets the checkpoint of a space: one from another version, which the journal rebuilds.
    ///
    /// # Errors
    /// The store cannot be written.
    fn drop_checkpoint(&self, space: SpaceNumber) -> Result<(), StoreError>;

    /// Writes (or writes again) a chunk of a trajectory.
    ///
    /// # Errors
    /// The store cannot be written.
    fn put_chunk(&self, space: SpaceNumber, key: ChunkKey, bytes: &[u8]) -> Result<(), StoreError>;

    /// Chunks of an agent's session, in order, from the last one that begins at or before `from_ns`.
    ///
    /// # Errors
    /// The store cannot be read.
    fn chunks(
        &self,
        space: SpaceNumber,
        agent: u32,
        session: u64,
        from_ns: i64,
        limit: usize,
    ) -> Result<Vec<(ChunkKey, Vec<u8>)>, StoreError>;
}
