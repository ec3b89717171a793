//! What is derived from the journals, kept by [fjall](https://docs.rs/fjall).
//!
//! A keyspace for each space, named by its number, so that deleting the space drops the keyspace.
//! Numbers in keys are big-endian, so that the order of the bytes is the order of the numbers.
//!
//! ```text
//! key                                                     value
//! 0: u8                                                   1: u8, next block: u64, recorders
//! 1: u8, kind: u8, page: u32                              the page
//! 2: u8, agent: u32, session: u64, first stamp: i64       the chunk
//! ```
//!
//! The stamp is in nanoseconds, with its sign bit flipped, so that stamps before zero come first.
//!
//! Nothing here is worth more than the time in which it is made again. Whatever cannot be opened or
//! read, and whatever the engine panics on, is dropped: at once when the store is opened, else by a
//! marker beside the directory that the next opening finds. A full disk leaves no marker: what was
//! written before is whole, and a checkpoint that is some blocks older costs a longer replay only.

mod fault;
pub(super) mod keys;

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};
use std::fs::File;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Duration;

use ::fjall::{CompressionType, Database, Keyspace, KeyspaceCreateOptions, PersistMode, Readable};
use cognitive_map::CheckpointPage;

use super::local::files;
use super::{Checkpoint, ChunkKey, Derived, DerivedError, SpaceNumber, StoreError, StoredChunk};
use crate::metrics as names;

/// Sealed write buffers of a keyspace at which its writers wait for the disk.
///
/// At four the engine itself would wait, without looking whether the threads that write the buffers
/// out are still alive: on a full disk it would wait for ever. Below that we wait ourselves and
/// look.
const SEALED_BUFFERS_MAX: usize = 3;
/// Time between two looks at the sealed write buffers.
const BUFFER_POLL: Duration = Duration::from_millis(5);
/// Size of a space's write buffer \[bytes\]: there is one for each of up to hundreds of spaces.
const WRITE_BUFFER_BYTES: u64 = 16 << 20;
/// Most files that the engine keeps open: descriptors are for the journals and for connections.
pub(super) const CACHED_FILES_MAX: usize = 64;
/// Most bytes of chunks that are held in memory after a failed write, until the restart.
const UNWRITTEN_BYTES_MAX: usize = 64 << 20;

/// Ending of the marker by which the next opening drops the directory.
const MARKER_ENDING: &str = "damaged";

/// Derived state in a directory of this machine.
pub(super) struct FjallDerived {
    directory: PathBuf,
    database: Database,
    keyspaces: Mutex<BTreeMap<SpaceNumber, Keyspace>>,
    /// The first failed write.
    failure: OnceLock<DerivedError>,
    /// Chunks that came after it, so that trajectories have no holes.
    unwritten: Mutex<Unwritten>,
}

/// Chunks in memory.
#[derive(Debug, Default)]
struct Unwritten {
    chunks: BTreeMap<(SpaceNumber, ChunkKey), Vec<u8>>,
    bytes: usize,
    /// Set when there were too many: what is there has holes.
    overflown: bool,
}

impl std::fmt::Debug for FjallDerived {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FjallDerived")
            .field("directory", &self.directory)
            .field("failure", &self.failure)
            .finish_non_exhaustive()
    }
}

impl FjallDerived {
    /// Opens the derived state of `spaces`, and drops that of others. What is damaged is dropped
    /// whole.
    ///
    /// # Errors
    /// Not even an empty directory can be opened.
    pub(super) fn open(
        directory: &Path,
        spaces: impl Iterator<Item = SpaceNumber>,
    ) -> Result<Self, StoreError> {
        let spaces: BTreeSet<_> = spaces.collect();
        let marker = directory.with_extension(MARKER_ENDING);
        let opened = if marker.exists() {
            Err("it was damaged before the restart".to_owned())
        } else {
            Self::try_open(directory, &spaces)
        };
        let reason = match opened {
            Ok(derived) => return Ok(derived),
            Err(reason) => reason,
        };
        tracing::warn!(
            reason,
            "checkpoints and trajectories are dropped and made again from the journals"
        );
        metrics::counter!(names::DERIVED_REBUILDS).increment(1);
        let on_disk = |error| StoreError::on_disk(&error, directory);
        files::remove_tree(directory).map_err(on_disk)?;
        files::remove(&marker).map_err(on_disk)?;
        let reopened = Self::try_open(directory, &spaces);
        reopened.map_err(|reason| StoreError::Io(format!("{}: {reason}", directory.display())))
    }

    fn try_open(directory: &Path, spaces: &BTreeSet<SpaceNumber>) -> Result<Self, String> {
        let open = || -> ::fjall::Result<_> {
            // Compressed, the engine's journal can only be recovered by the very release of the
            // compressor that wrote it: the checksum is over the compressed bytes, and recovery
            // compresses again to compare.
            let database = Database::builder(directory)
                .journal_compression(CompressionType::None)
                .max_cached_files(Some(CACHED_FILES_MAX))
                .open()?;
            for name in database.list_keyspace_names() {
                let space = keys::space_of(&name);
                if !space.is_some_and(|space| spaces.contains(&space)) {
                    drop_keyspace(&database, database.keyspace(&name, options)?)?;
                }
            }
            Ok(database)
        };
        let database = guarded(open)?.map_err(|error| error.to_string())?;
        Ok(Self {
            directory: directory.to_owned(),
            database,
            keyspaces: Mutex::default(),
            failure: OnceLock::new(),
            unwritten: Mutex::default(),
        })
    }

    /// Runs a write, unless one has failed before.
    fn write(
        &self,
        space: SpaceNumber,
        write: impl FnOnce(&Keyspace) -> ::fjall::Result<()>,
    ) -> Result<(), DerivedError> {
        if let Some(failure) = self.failure.get() {
            return Err(failure.clone());
        }
        let result = guarded(|| write(&self.keyspace(space)?));
        let (reason, damaged) = match result {
            Ok(Ok(())) => return Ok(()),
            Ok(Err(error)) if fault::is_disk_full(&error, &self.directory) => {
                ("no space left on the disk".to_owned(), false)
            }
            Ok(Err(error)) => (error.to_string(), true),
            Err(panic) => (panic, true),
        };
        if damaged {
            self.mark_damaged();
        }
        let failure = DerivedError(reason);
        Err(self.failure.get_or_init(|| failure).clone())
    }

    /// Runs a read. A failed one is a sign of damage.
    fn read<T>(
        &self,
        space: SpaceNumber,
        read: impl FnOnce(&Keyspace) -> ::fjall::Result<Option<T>>,
    ) -> Result<T, DerivedError> {
        let reason = match guarded(|| read(&self.keyspace(space)?)) {
            Ok(Ok(Some(value))) => return Ok(value),
            Ok(Ok(None)) => "its bytes do not make sense".to_owned(),
            Ok(Err(error)) => error.to_string(),
            Err(panic) => panic,
        };
        metrics::counter!(names::DERIVED_FAILURES).increment(1);
        self.mark_damaged();
        Err(DerivedError(reason))
    }

    /// Lets the next opening drop everything.
    fn mark_damaged(&self) {
        let marker = self.directory.with_extension(MARKER_ENDING);
        if let Err(error) = File::create(&marker) {
            tracing::warn!(%error, marker = %marker.display(),
                "mark checkpoints and trajectories as damaged");
        }
    }

    /// The keyspace of a space, created where it is absent.
    fn keyspace(&self, space: SpaceNumber) -> ::fjall::Result<Keyspace> {
        let mut keyspaces = self.keyspaces();
        if let Some(keyspace) = keyspaces.get(&space) {
            return Ok(keyspace.clone());
        }
        let keyspace = self.database.keyspace(&keys::keyspace(space), options)?;
        keyspaces.insert(space, keyspace.clone());
        Ok(keyspace)
    }

    /// Waits until there is room for another write.
    fn wait_for_buffers(&self, keyspace: &Keyspace) -> ::fjall::Result<()> {
        while keyspace.sealed_memtable_count() >= SEALED_BUFFERS_MAX {
            // Fails once one of the engine's threads has failed.
            self.database.persist(PersistMode::Buffer)?;
            std::thread::sleep(BUFFER_POLL);
        }
        Ok(())
    }

    fn keyspaces(&self) -> MutexGuard<'_, BTreeMap<SpaceNumber, Keyspace>> {
        (self.keyspaces.lock()).unwrap_or_else(PoisonError::into_inner)
    }

    fn unwritten(&self) -> MutexGuard<'_, Unwritten> {
        (self.unwritten.lock()).unwrap_or_else(PoisonError::into_inner)
    }
}

impl Derived for FjallDerived {
    fn write_checkpoint(
        &self,
        space: SpaceNumber,
        changed: &Checkpoint,
    ) -> Result<(), DerivedError> {
        self.write(space, |keyspace| {
            let mut batch = self.database.batch();
            for page in &changed.pages {
                let key = keys::page(page.kind, page.index);
                if page.bytes.is_empty() {
                    batch.remove(keyspace, key);
                } else {
                    batch.insert(keyspace, key, page.bytes.as_slice());
                }
            }
            let value = keys::checkpoint_value(changed.next_block, &changed.recorders);
            batch.insert(keyspace, keys::CHECKPOINT, value);
            self.wait_for_buffers(keyspace)?;
            batch.commit()?;
            // After a power cut this checkpoint is the latest one at worst.
            self.database.persist(PersistMode::SyncData)
        })
    }

    fn checkpoint(&self, space: SpaceNumber) -> Result<Option<Checkpoint>, DerivedError> {
        self.read(space, |keyspace| {
            let snapshot = self.database.snapshot();
            let Some(value) = snapshot.get(keyspace, keys::CHECKPOINT)? else {
                return Ok(Some(None));
            };
            let Some((next_block, recorders)) = keys::checkpoint_from(&value) else {
                return Ok(None);
            };
            let mut pages = Vec::new();
            for entry in snapshot.prefix(keyspace, keys::PAGES) {
                let (key, bytes) = entry.into_inner()?;
                let Some((kind, index)) = keys::page_from(&key) else {
                    return Ok(None);
                };
                let bytes = bytes.to_vec();
                pages.push(CheckpointPage { kind, index, bytes });
            }
            Ok(Some(Some(Checkpoint {
                next_block,
                pages,
                recorders,
            })))
        })
    }

    fn forget(&self, space: SpaceNumber) -> Result<(), DerivedError> {
        self.unwritten().chunks.retain(|(of, _), _| *of != space);
        self.write(space, |keyspace| {
            self.keyspaces().remove(&space);
            drop_keyspace(&self.database, keyspace.clone())
        })
    }

    fn put_chunk(
        &self,
        space: SpaceNumber,
        key: ChunkKey,
        bytes: &[u8],
    ) -> Result<(), DerivedError> {
        let written = self.write(space, |keyspace| {
            self.wait_for_buffers(keyspace)?;
            keyspace.insert(keys::chunk(key), bytes)
        });
        written.inspect_err(|_| self.unwritten().put(space, key, bytes))
    }

    fn chunks(
        &self,
        space: SpaceNumber,
        agent: u32,
        session: u64,
        from_ns: i64,
        limit: usize,
    ) -> Result<Vec<StoredChunk>, DerivedError> {
        let of_session = |first_stamp_ns| ChunkKey {
            agent,
            session,
            first_stamp_ns,
        };
        let key_at = |first_stamp_ns| keys::chunk(of_session(first_stamp_ns));
        let mut chunks = self.read(space, |keyspace| {
            let snapshot = self.database.snapshot();
            let earlier = key_at(i64::MIN)..=key_at(from_ns);
            let first = match snapshot.range(keyspace, earlier).next_back() {
                Some(entry) => entry.key()?.to_vec(),
                None => key_at(from_ns).to_vec(),
            };
            let onward = first..=key_at(i64::MAX).to_vec();
            let mut chunks = Vec::new();
            for entry in snapshot.range(keyspace, onward).take(limit) {
                let (key, value) = entry.into_inner()?;
                let Some(key) = keys::chunk_from(&key) else {
                    return Ok(None);
                };
                chunks.push((key, value.to_vec()));
            }
            Ok(Some(chunks))
        })?;
        let unwritten = self.unwritten();
        if unwritten.overflown {
            let failure = self.failure.get().cloned();
            return Err(failure.unwrap_or_else(|| DerivedError("chunks are missing".to_owned())));
        }
        unwritten.append_to(&mut chunks, space, of_session(from_ns), limit);
        Ok(chunks)
    }
}

impl Unwritten {
    fn put(&mut self, space: SpaceNumber, key: ChunkKey, bytes: &[u8]) {
        if self.overflown || self.bytes + bytes.len() > UNWRITTEN_BYTES_MAX {
            *self = Self {
                overflown: true,
                ..Self::default()
            };
            return;
        }
        self.bytes += bytes.len();
        self.chunks.insert((space, key), bytes.to_vec());
    }

    /// Adds what belongs behind the written chunks of a session. Chunks come in the order of their
    /// stamps, so all of these are later than the written ones.
    fn append_to(
        &self,
        chunks: &mut Vec<StoredChunk>,
        space: SpaceNumber,
        from: ChunkKey,
        limit: usize,
    ) {
        let at = |first_stamp_ns| {
            let key = ChunkKey {
                first_stamp_ns,
                ..from
            };
            (space, key)
        };
        let earlier = self.chunks.range(at(i64::MIN)..=at(from.first_stamp_ns));
        let first = earlier.map(|((_, key), _)| key.first_stamp_ns).next_back();
        let first = first.unwrap_or(from.first_stamp_ns);
        for ((_, key), bytes) in self.chunks.range(at(first)..=at(i64::MAX)) {
            if chunks.len() < limit {
                chunks.push((*key, bytes.clone()));
            }
        }
    }
}

/// Drops a keyspace with its files.
fn drop_keyspace(database: &Database, keyspace: Keyspace) -> ::fjall::Result<()> {
    // The engine keeps the files of a deleted keyspace as long as its journal mentions it.
    keyspace.clear()?;
    database.delete_keyspace(keyspace)
}

/// Runs what may panic on bytes that nobody expects.
fn guarded<T>(run: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(run)).map_err(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
        format!("the engine panicked: {}", text.unwrap_or("without a word"))
    })
}

fn options() -> KeyspaceCreateOptions {
    KeyspaceCreateOptions::default().max_memtable_size(WRITE_BUFFER_BYTES)
}
