//! The embedded end of the store: one directory, written by [fjall](https://docs.rs/fjall).
//!
//! # Format 1
//!
//! Numbers in keys are big-endian, so that the order of the bytes is the order of the numbers.
//!
//! ```text
//! keyspace    key                                                   value
//! meta        "format"                                              format of the store: u32
//!             "next_space"                                          u32
//!             "space/" number, in decimal                           1: u8, name length: u32, name, settings
//!             "deleted/" number, in decimal                         empty
//! journal     space: u32, block: u64                                the block
//! checkpoint  space: u32                                            1: u8, next block: u64, recorders
//! entities    space: u32, kind: u8, page: u32                       the page
//! trajectory  space: u32, agent: u32, session: u64, first stamp     the chunk
//! ```
//!
//! The stamp is an i64 \[ns\] with its sign bit flipped, so that stamps before zero come first. Blocks,
//! pages, chunks, settings and recorders are the engine's, which versions its own bytes; what the
//! store composes itself begins with a version byte. The engine beneath guards every value with a
//! checksum.
//!
//! A space marked `deleted/` is gone for every reader; the mark stays until the last of its keys has
//! been removed, and opening the store finishes what a crash has interrupted.

mod deletion;
mod fault;
mod keys;
mod opening;

#[cfg(test)]
mod chunk_tests;
#[cfg(test)]
mod disk_tests;
#[cfg(test)]
mod fixture;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use ::fjall::{Database, Keyspace, PersistMode, Readable};
use cognitive_map::CheckpointPage;

use super::{Blocks, Checkpoint, ChunkKey, SpaceNumber, Store, StoreError, StoredSpace};

/// Newest disk format that this build reads, and the one it writes.
pub const FORMAT_VERSION: u32 = 1;

/// Sealed write buffers of a keyspace at which its writers wait for the disk.
///
/// At four the engine itself would wait, without looking whether the threads that write the buffers
/// out are still alive: on a full disk it would wait for ever. Below that we wait ourselves and look.
const SEALED_BUFFERS_MAX: usize = 3;

/// Time between two looks at the sealed write buffers.
const BUFFER_POLL: Duration = Duration::from_millis(5);

/// The store in a directory of this machine. One process has it open at a time.
pub struct FjallStore {
    directory: PathBuf,
    database: Database,
    meta: Keyspace,
    journal: Keyspace,
    entities: Keyspace,
    checkpoint: Keyspace,
    trajectory: Keyspace,
    /// Held while the list of spaces changes, so that two creations cannot take the same name.
    spaces: Mutex<()>,
    /// Set by the first failed write.
    broken: AtomicBool,
}

impl std::fmt::Debug for FjallStore {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FjallStore")
            .field("directory", &self.directory)
            .field("broken", &self.broken)
            .finish_non_exhaustive()
    }
}

impl FjallStore {
    /// Opens the store in `directory`, and creates both where they are absent.
    ///
    /// # Errors
    /// [`StoreError::Locked`] when another process has it open, [`StoreError::NewerFormat`] when a
    /// newer version has written it, [`StoreError::Corrupt`] when its bytes do not make sense, and
    /// [`StoreError::Io`] when the directory holds something else than a store.
    pub fn open(directory: &Path) -> Result<Self, StoreError> {
        opening::open(directory)
    }

    /// Runs a write, unless one has failed before.
    fn write(&self, write: impl FnOnce() -> ::fjall::Result<()>) -> Result<(), StoreError> {
        if self.broken.load(Ordering::Acquire) {
            return Err(StoreError::Broken);
        }
        write().map_err(|error| {
            self.broken.store(true, Ordering::Release);
            fault::on_write(&error, &self.directory)
        })
    }

    /// Writes one value, after the disk has caught up.
    fn insert(&self, keyspace: &Keyspace, key: &[u8], value: &[u8]) -> Result<(), StoreError> {
        self.write(|| {
            self.wait_for_buffers(keyspace, SEALED_BUFFERS_MAX)?;
            keyspace.insert(key, value)
        })
    }

    /// Waits until fewer than `limit` sealed write buffers of a keyspace are left to be written out.
    fn wait_for_buffers(&self, keyspace: &Keyspace, limit: usize) -> ::fjall::Result<()> {
        while keyspace.sealed_memtable_count() >= limit {
            // Fails once one of the engine's threads has failed.
            self.database.persist(PersistMode::Buffer)?;
            std::thread::sleep(BUFFER_POLL);
        }
        Ok(())
    }

    fn lock_spaces(&self) -> MutexGuard<'_, ()> {
        // The lock guards no data of its own, so a panic under it leaves nothing half done.
        self.spaces.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn next_space(&self) -> Result<u32, StoreError> {
        match self.meta.get(keys::NEXT_SPACE).map_err(fault::on_read)? {
            Some(value) => keys::number_from(&value, "next_space"),
            None => Ok(0),
        }
    }
}

impl Store for FjallStore {
    fn spaces(&self) -> Result<Vec<StoredSpace>, StoreError> {
        let mut spaces = Vec::new();
        for entry in self.meta.prefix(keys::SPACE) {
            let (key, value) = entry.into_inner().map_err(fault::on_read)?;
            let number = keys::meta_number(&key, keys::SPACE)?;
            spaces.push(keys::space_from(number, &value)?);
        }
        // In decimal, 10 comes before 9.
        spaces.sort_by_key(|space| space.number);
        Ok(spaces)
    }

    fn create_space(&self, name: &str, settings: &[u8]) -> Result<SpaceNumber, StoreError> {
        let _changing = self.lock_spaces();
        if self.spaces()?.iter().any(|space| space.name == name) {
            return Err(StoreError::SpaceExists(name.to_owned()));
        }
        let number = SpaceNumber(self.next_space()?);
        let next = number
            .0
            .checked_add(1)
            .ok_or_else(|| StoreError::Io("all space numbers are used up".to_owned()))?;
        // The journal is one file that the engine has made durable on creating it, so that syncing
        // its data (fdatasync, which includes the length) is enough. The same holds below.
        let mut batch = (self.database.batch()).durability(Some(PersistMode::SyncData));
        batch.insert(&self.meta, keys::NEXT_SPACE, next.to_be_bytes());
        let value = keys::space_value(name, settings)?;
        batch.insert(&self.meta, keys::meta_key(keys::SPACE, number), value);
        self.write(|| batch.commit())?;
        Ok(number)
    }

    fn delete_space(&self, space: SpaceNumber) -> Result<(), StoreError> {
        let _changing = self.lock_spaces();
        let record = keys::meta_key(keys::SPACE, space);
        if !self.meta.contains_key(&record).map_err(fault::on_read)? {
            return Ok(());
        }
        // One step decides: before it the space is whole, after it the space is gone, and what is
        // left are keys that nobody reads.
        let mut batch = (self.database.batch()).durability(Some(PersistMode::SyncData));
        batch.remove(&self.meta, record);
        batch.insert(&self.meta, keys::meta_key(keys::DELETED, space), []);
        self.write(|| batch.commit())?;
        self.remove_keys(space)
    }

    fn append(&self, space: SpaceNumber, block: u64, bytes: &[u8]) -> Result<(), StoreError> {
        self.insert(&self.journal, &keys::journal(space, block), bytes)
    }

    fn sync(&self) -> Result<(), StoreError> {
        self.write(|| self.database.persist(PersistMode::SyncData))
    }

    fn journal(&self, space: SpaceNumber, from: u64) -> Blocks<'_> {
        let range = keys::journal(space, from)..=keys::journal(space, u64::MAX);
        let blocks = self.database.snapshot().range(&self.journal, range);
        Box::new(blocks.map(|entry| {
            let (key, value) = entry.into_inner().map_err(fault::on_read)?;
            Ok((keys::block_from(&key)?, value.to_vec()))
        }))
    }

    fn write_checkpoint(&self, space: SpaceNumber, changed: &Checkpoint) -> Result<(), StoreError> {
        let mut batch = self.database.batch();
        for page in &changed.pages {
            let key = keys::page(space, page.kind, page.index);
            if page.bytes.is_empty() {
                batch.remove(&self.entities, key);
            } else {
                batch.insert(&self.entities, key, page.bytes.as_slice());
            }
        }
        let value = keys::checkpoint_value(changed.next_block, &changed.recorders);
        batch.insert(&self.checkpoint, keys::checkpoint(space), value);
        self.write(|| {
            self.wait_for_buffers(&self.entities, SEALED_BUFFERS_MAX)?;
            batch.commit()
        })
    }

    fn checkpoint(&self, space: SpaceNumber) -> Result<Option<Checkpoint>, StoreError> {
        // Of one instant, so that a write between the two reads cannot mix its pages in.
        let snapshot = self.database.snapshot();
        let value = snapshot.get(&self.checkpoint, keys::checkpoint(space));
        let Some(value) = value.map_err(fault::on_read)? else {
            return Ok(None);
        };
        let (next_block, recorders) = keys::checkpoint_from(&value)?;
        let mut pages = Vec::new();
        for entry in snapshot.prefix(&self.entities, keys::prefix(space)) {
            let (key, bytes) = entry.into_inner().map_err(fault::on_read)?;
            let (kind, index) = keys::page_from(&key)?;
            let bytes = bytes.to_vec();
            pages.push(CheckpointPage { kind, index, bytes });
        }
        Ok(Some(Checkpoint {
            next_block,
            pages,
            recorders,
        }))
    }

    fn drop_checkpoint(&self, space: SpaceNumber) -> Result<(), StoreError> {
        // In one step: a page that outlived its checkpoint would be merged into the next one.
        let mut batch = self.database.batch();
        batch.remove(&self.checkpoint, keys::checkpoint(space));
        for entry in self.entities.prefix(keys::prefix(space)) {
            batch.remove(&self.entities, entry.key().map_err(fault::on_read)?);
        }
        self.write(|| batch.commit())
    }

    fn put_chunk(&self, space: SpaceNumber, key: ChunkKey, bytes: &[u8]) -> Result<(), StoreError> {
        self.insert(&self.trajectory, &keys::chunk(space, key), bytes)
    }

    fn chunks(
        &self,
        space: SpaceNumber,
        agent: u32,
        session: u64,
        from_ns: i64,
        limit: usize,
    ) -> Result<Vec<(ChunkKey, Vec<u8>)>, StoreError> {
        let key_at = |first_stamp_ns| {
            let key = ChunkKey {
                agent,
                session,
                first_stamp_ns,
            };
            keys::chunk(space, key)
        };
        let snapshot = self.database.snapshot();
        let earlier = key_at(i64::MIN)..=key_at(from_ns);
        let first = match snapshot.range(&self.trajectory, earlier).next_back() {
            Some(entry) => entry.key().map_err(fault::on_read)?.to_vec(),
            None => key_at(from_ns).to_vec(),
        };
        let onward = first..=key_at(i64::MAX).to_vec();
        let entries = snapshot.range(&self.trajectory, onward).take(limit);
        let mut chunks = Vec::new();
        for entry in entries {
            let (key, value) = entry.into_inner().map_err(fault::on_read)?;
            chunks.push((keys::chunk_from(&key)?, value.to_vec()));
        }
        Ok(chunks)
    }
}
