//! What is derived from the journals, in the same database.

use cognitive_map::CheckpointPage;
use slatedb::WriteBatch;
use slatedb::config::FlushType;

use super::super::derived::keys as of_derived;
use super::super::{
    Checkpoint, ChunkKey, Derived, DerivedError, SpaceNumber, StoreError, StoredChunk,
};
use super::{ObjectStore, keys};

impl From<StoreError> for DerivedError {
    fn from(error: StoreError) -> Self {
        Self(error.to_string())
    }
}

impl ObjectStore {
    /// Whether another process writes what is derived here.
    fn is_others(&self) -> bool {
        self.database.followed_to().is_some()
    }
}

impl Derived for ObjectStore {
    fn write_checkpoint(
        &self,
        space: SpaceNumber,
        changed: &Checkpoint,
    ) -> Result<(), DerivedError> {
        if self.is_others() {
            return Ok(());
        }
        let mut batch = WriteBatch::new();
        for page in &changed.pages {
            let key = keys::derived_key(space, &of_derived::page(page.kind, page.index));
            if page.bytes.is_empty() {
                batch.delete(key);
            } else {
                batch.put(key, &page.bytes);
            }
        }
        let value = of_derived::checkpoint_value(changed.next_block, &changed.recorders);
        batch.put(keys::derived_key(space, &of_derived::CHECKPOINT), value);
        self.database.put(batch)?;
        // Tables take the place of the log, which the next opening would have to read.
        Ok(self.database.flush(FlushType::MemTable)?)
    }

    fn checkpoint(&self, space: SpaceNumber) -> Result<Option<Checkpoint>, DerivedError> {
        let key = keys::derived_key(space, &of_derived::CHECKPOINT);
        let Some(value) = self.database.get(key)? else {
            return Ok(None);
        };
        let nonsense = || DerivedError("its bytes do not make sense".to_owned());
        let (next_block, recorders) = of_derived::checkpoint_from(&value).ok_or_else(nonsense)?;
        let mut pages = Vec::new();
        let below = keys::derived(space).len();
        let mut items = self
            .database
            .items(&keys::derived_key(space, &of_derived::PAGES), 0)?;
        while let Some(item) = self.database.next(&mut items)? {
            let (kind, index) = of_derived::page_from(&item.key[below..]).ok_or_else(nonsense)?;
            let bytes = item.value.to_vec();
            pages.push(CheckpointPage { kind, index, bytes });
        }
        Ok(Some(Checkpoint {
            next_block,
            pages,
            recorders,
        }))
    }

    fn forget(&self, space: SpaceNumber) -> Result<(), DerivedError> {
        if self.is_others() {
            return Ok(());
        }
        self.database.remove_below(&keys::derived(space))?;
        Ok(self.database.flush(FlushType::Wal)?)
    }

    fn put_chunk(
        &self,
        space: SpaceNumber,
        key: ChunkKey,
        bytes: &[u8],
    ) -> Result<(), DerivedError> {
        if self.is_others() {
            return Ok(());
        }
        let mut batch = WriteBatch::new();
        batch.put(keys::derived_key(space, &of_derived::chunk(key)), bytes);
        Ok(self.database.put(batch)?)
    }

    fn chunks(
        &self,
        space: SpaceNumber,
        agent: u32,
        session: u64,
        from_ns: i64,
        limit: usize,
    ) -> Result<Vec<StoredChunk>, DerivedError> {
        let key_at = |first_stamp_ns| {
            let key = ChunkKey {
                agent,
                session,
                first_stamp_ns,
            };
            keys::derived_key(space, &of_derived::chunk(key))
        };
        let below = keys::derived(space).len();
        let nonsense = || DerivedError("its bytes do not make sense".to_owned());
        let chunk_of = |key: &[u8]| of_derived::chunk_from(&key[below..]).ok_or_else(nonsense);
        let earlier = self.database.last_of(key_at(i64::MIN), key_at(from_ns))?;
        let first_ns = match earlier {
            Some(item) => chunk_of(&item.key)?.first_stamp_ns,
            None => from_ns,
        };
        let mut items = self.database.between(key_at(first_ns), key_at(i64::MAX))?;
        let mut chunks = Vec::new();
        while chunks.len() < limit
            && let Some(item) = self.database.next(&mut items)?
        {
            chunks.push((chunk_of(&item.key)?, item.value.to_vec()));
        }
        Ok(chunks)
    }
}
