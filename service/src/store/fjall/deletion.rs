//! Removal of what a deleted space has left.

use fjall::{Guard, Keyspace};

use super::super::{SpaceNumber, StoreError};
use super::{FjallStore, SEALED_BUFFERS_MAX, fault, keys};

/// Keys removed in one step: a few hundred kilobytes, whatever the size of the space.
const KEYS_PER_STEP: usize = 4096;

impl FjallStore {
    /// Removes all keys of the spaces that are marked as deleted.
    pub(super) fn finish_deletions(&self) -> Result<(), StoreError> {
        let mut marked = Vec::new();
        for entry in self.meta.prefix(keys::DELETED) {
            let key = entry.key().map_err(fault::on_read)?;
            marked.push(keys::meta_number(&key, keys::DELETED)?);
        }
        marked
            .into_iter()
            .try_for_each(|space| self.remove_keys(space))
    }

    /// Removes all keys of a space, and then the mark of its deletion.
    ///
    /// None of it is synced: a power cut brings back keys that nobody reads, and the mark with them,
    /// since the engine's journal loses later writes first.
    pub(super) fn remove_keys(&self, space: SpaceNumber) -> Result<(), StoreError> {
        let keyspaces = [
            &self.journal,
            &self.entities,
            &self.checkpoint,
            &self.trajectory,
        ];
        for keyspace in keyspaces {
            let mut keys = keyspace.prefix(keys::prefix(space)).map(Guard::key);
            while self.remove_step(keyspace, keys.by_ref().take(KEYS_PER_STEP))? == KEYS_PER_STEP {}
        }
        self.release_disk()?;
        let mark = keys::meta_key(keys::DELETED, space);
        self.write(|| {
            self.meta.remove(mark)?;
            // The engine lets go of files that no table refers to when a write buffer is sealed and
            // two writes have passed since; the smallest buffer will do.
            self.meta.remove(keys::DELETED)?;
            self.meta.rotate_memtable().map(drop)
        })
    }

    /// Gives the disk space of the removed blocks back.
    ///
    /// The engine would do so when it next merges the tables that hold their keys, and since the
    /// journal only grows at its end, that may be never. The first merge drops the keys and so learns
    /// which files of blocks are stale, the second copies what is left in those.
    fn release_disk(&self) -> Result<(), StoreError> {
        self.write(|| {
            if self.journal.rotate_memtable()? {
                self.wait_for_buffers(&self.journal, 1)?;
            }
            self.journal.major_compact()?;
            self.journal.major_compact()
        })
    }

    /// Removes `keys` in one step and returns how many there were.
    fn remove_step(
        &self,
        keyspace: &Keyspace,
        keys: impl Iterator<Item = fjall::Result<fjall::UserKey>>,
    ) -> Result<usize, StoreError> {
        let mut batch = self.database.batch();
        for key in keys {
            batch.remove(keyspace, key.map_err(fault::on_read)?);
        }
        let count = batch.len();
        self.write(|| {
            self.wait_for_buffers(keyspace, SEALED_BUFFERS_MAX)?;
            batch.commit()
        })?;
        Ok(count)
    }
}
