//! The store on object storage: S3, GCS, Azure, anything that speaks S3, or a directory; by
//! [SlateDB](https://docs.rs/slatedb).
//!
//! ```text
//! object below the prefix of the URL      holds
//! store.json                              format of the layout, and how many shards there are
//! shards/{shard}/                         the database of a shard
//! cluster/                                what nodes say of themselves (`registry.rs`)
//! ```
//!
//! Numbers in keys of a database are big-endian, so that the order of the bytes is the order of the
//! numbers; numbers in values are little-endian.
//!
//! ```text
//! key                                     value
//! 0: u8                                   format of the store: u32
//! 1: u8                                   number that the next space gets: u32
//! 2: u8, space: u32                       length of the name: u32, name, settings
//! 3: u8, space: u32, block: u64           samples up to its end: u64, the block
//! 4: u8, space: u32, key                  what is derived; `key` as in `derived/mod.rs`
//! 5: u8, space: u32                       nothing: the space is deleted or not finished, but keys
//!                                         of it may be there
//! ```
//!
//! What is put survives the process with the next [`Journal::sync`], not before. While the storage
//! cannot be reached, a sync waits: the watermark stands still, and nothing is lost or refused.
//!
//! Whoever opens a database last owns it: whatever owned it before is *fenced*, its writes fail
//! with [`StoreError::Fenced`], and nothing of them is there.

mod database;
mod derived;
mod draft;
mod keys;
mod location;
mod reading;
mod registry;
mod runtime;
mod storage;

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use slatedb::WriteBatch;
use slatedb::config::FlushType;

use super::{Blocks, Draft, Extent, Journal, OpenJournal, SpaceNumber, StoreError, StoredSpace};
use database::Database;
use draft::ObjectDraft;
use reading::Reading;

pub use registry::{NodeId, NodeRecord, OwnerRecord, Registry, Seen};
pub use storage::ObjectStorage;

/// Format that this build reads and writes.
const FORMAT: u32 = 1;

/// A shard of a store on object storage, owned by this process until another one opens it.
#[derive(Debug)]
pub struct ObjectStore {
    database: Database,
    /// Held while the list of spaces changes, so that two creations cannot take the same name.
    changing: Mutex<()>,
    /// Journals that are open, and what they hold.
    open: Mutex<BTreeMap<SpaceNumber, Extent>>,
}

impl ObjectStore {
    fn over(database: Database) -> Result<Self, StoreError> {
        let store = Self::reading(database);
        store.check_format()?;
        store.finish_deletions()?;
        Ok(store)
    }

    /// The store as another process writes it.
    fn reading(database: Database) -> Self {
        Self {
            database,
            changing: Mutex::default(),
            open: Mutex::default(),
        }
    }

    /// Writes the format, or refuses one of a newer build.
    fn check_format(&self) -> Result<(), StoreError> {
        let format = self.database.get(keys::FORMAT)?;
        match format.as_deref().map(keys::number) {
            None => {
                let mut batch = WriteBatch::new();
                batch.put(keys::FORMAT, FORMAT.to_le_bytes());
                self.database.commit(batch)
            }
            Some(Some(FORMAT)) => Ok(()),
            Some(Some(found)) => Err(StoreError::NewerFormat {
                found,
                supported: FORMAT,
            }),
            Some(None) => Err(self.database.corrupt("the format of the store")),
        }
    }

    /// Removes what is left of spaces that were being deleted.
    fn finish_deletions(&self) -> Result<(), StoreError> {
        let mut deleted = Vec::new();
        self.database.scan(&keys::DELETED, |key, _| {
            deleted.extend(keys::space_of(key));
            Ok(())
        })?;
        deleted
            .into_iter()
            .try_for_each(|space| self.remove_keys(space))
    }

    /// Removes all keys of a deleted space, and then the note that there may be some.
    fn remove_keys(&self, space: SpaceNumber) -> Result<(), StoreError> {
        for prefix in [keys::blocks(space), keys::derived(space)] {
            self.database.remove_below(&prefix)?;
        }
        let mut batch = WriteBatch::new();
        batch.delete(keys::deleted(space));
        self.database.commit(batch)
    }

    fn refuse_taken(&self, name: &str) -> Result<(), StoreError> {
        if self.spaces()?.iter().any(|space| space.name == name) {
            return Err(StoreError::SpaceExists(name.to_owned()));
        }
        Ok(())
    }

    /// The number of a new space, and a batch that takes it; whoever calls holds the list of
    /// spaces.
    fn take_number(&self) -> Result<(SpaceNumber, WriteBatch), StoreError> {
        let next = match self.database.get(keys::NEXT_SPACE)? {
            None => 0,
            Some(value) => keys::number(&value)
                .ok_or_else(|| self.database.corrupt("the number of the next space"))?,
        };
        let after = next
            .checked_add(1)
            .ok_or_else(|| StoreError::Io("all space numbers are used up".to_owned()))?;
        let mut batch = WriteBatch::new();
        batch.put(keys::NEXT_SPACE, after.to_le_bytes());
        Ok((SpaceNumber(next), batch))
    }

    fn lock_spaces(&self) -> MutexGuard<'_, ()> {
        // The lock guards no data of its own, so a panic under it leaves nothing half done.
        self.changing.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn lock_open(&self) -> MutexGuard<'_, BTreeMap<SpaceNumber, Extent>> {
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What a journal holds, by its last block.
    fn extent(&self, space: SpaceNumber) -> Result<Extent, StoreError> {
        let blocks = keys::blocks(space).len();
        let last = self
            .database
            .last_of(keys::block(space, 0), keys::block(space, u64::MAX))?;
        let Some(last) = last else {
            return Ok(Extent::default());
        };
        let number = keys::block_of(&last.key[blocks..]);
        let samples = keys::samples_of(&last.value);
        let (Some(number), Some(samples)) = (number, samples) else {
            return Err(self
                .database
                .corrupt(&format!("the last block of space {}", space.0)));
        };
        Ok(Extent {
            blocks: number + 1,
            samples,
        })
    }
}

impl Journal for ObjectStore {
    fn term(&self) -> u64 {
        self.database.term()
    }

    fn spaces(&self) -> Result<Vec<StoredSpace>, StoreError> {
        let mut spaces = Vec::new();
        self.database.scan(&keys::SPACES, |key, value| {
            let space = keys::space_from(key, value);
            spaces.push(space.ok_or_else(|| self.database.corrupt("the record of a space"))?);
            Ok(())
        })?;
        Ok(spaces)
    }

    fn create_space(&self, name: &str, settings: &[u8]) -> Result<SpaceNumber, StoreError> {
        let _changing = self.lock_spaces();
        self.refuse_taken(name)?;
        let (number, mut batch) = self.take_number()?;
        batch.put(keys::space(number), keys::space_value(name, settings)?);
        self.database.commit(batch)?;
        Ok(number)
    }

    fn draft<'a>(&'a self, name: &str, settings: &[u8]) -> Result<Box<dyn Draft + 'a>, StoreError> {
        Ok(Box::new(ObjectDraft::begin(self, name, settings)?))
    }

    fn delete_space(&self, space: SpaceNumber) -> Result<(), StoreError> {
        let _changing = self.lock_spaces();
        if self.database.get(keys::space(space))?.is_none() {
            return Ok(());
        }
        // One step decides: before it the space is whole, after it the space is gone.
        self.lock_open().remove(&space);
        let mut batch = WriteBatch::new();
        batch.delete(keys::space(space));
        batch.put(keys::deleted(space), []);
        self.database.commit(batch)?;
        self.remove_keys(space)
    }

    fn open_journal(&self, space: SpaceNumber) -> Result<OpenJournal, StoreError> {
        let known = self.lock_open().get(&space).copied();
        let extent = if let Some(extent) = known {
            extent
        } else if self.database.followed_to().is_some() {
            // Its owner goes on writing it.
            self.extent(space)?
        } else {
            let extent = self.extent(space)?;
            *self.lock_open().entry(space).or_insert(extent)
        };
        // What was not durable was never acknowledged, and is not there: nothing is cut.
        Ok(OpenJournal {
            extent,
            cut: None,
            mark_lost: false,
        })
    }

    fn append(
        &self,
        space: SpaceNumber,
        block: u64,
        samples: u64,
        bytes: &[u8],
    ) -> Result<(), StoreError> {
        let mut open = self.lock_open();
        let extent = open.get_mut(&space).filter(|extent| extent.blocks == block);
        let Some(extent) = extent else {
            let what = format!("block {block} is not the next one of space {}", space.0);
            return Err(StoreError::Io(what));
        };
        extent.blocks += 1;
        extent.samples += samples;
        let value = keys::block_value(extent.samples, bytes);
        drop(open);
        let mut batch = WriteBatch::new();
        batch.put(keys::block(space, block), value);
        self.database.put(batch)
    }

    fn sync(&self) -> Result<(), StoreError> {
        if self.database.followed_to().is_some() {
            // What can be read is durable.
            return Ok(());
        }
        self.database.flush(FlushType::Wal)
    }

    fn journal(&self, space: SpaceNumber, from: u64) -> Blocks<'_> {
        let end = self
            .lock_open()
            .get(&space)
            .map_or(u64::MAX, |open| open.blocks);
        match Reading::begin(&self.database, space, from, end) {
            Ok(reading) => Box::new(reading),
            Err(error) => Box::new(std::iter::once(Err(error))),
        }
    }

    fn check_ownership(&self) -> Result<(), StoreError> {
        self.database.check_ownership()
    }

    fn progress(&self) -> u64 {
        self.database.followed_to().unwrap_or(0)
    }

    fn give_up(&self) {
        self.database.close();
    }
}
