//! Spaces that are written before they are in the store.

use slatedb::WriteBatch;

use super::super::{Draft, Extent, SpaceNumber, StoreError};
use super::{ObjectStore, keys};

/// A new space whose record comes last. Until then its number is one of a deleted space, so that
/// the next opening removes what a crash leaves.
#[derive(Debug)]
pub(super) struct ObjectDraft<'a> {
    store: &'a ObjectStore,
    number: SpaceNumber,
    name: String,
    settings: Vec<u8>,
    extent: Extent,
    is_finished: bool,
}

impl<'a> ObjectDraft<'a> {
    /// Begins one.
    pub(super) fn begin(
        store: &'a ObjectStore,
        name: &str,
        settings: &[u8],
    ) -> Result<Self, StoreError> {
        let _changing = store.lock_spaces();
        store.refuse_taken(name)?;
        let (number, mut batch) = store.take_number()?;
        batch.put(keys::deleted(number), []);
        store.database.commit(batch)?;
        Ok(Self {
            store,
            number,
            name: name.to_owned(),
            settings: settings.to_vec(),
            extent: Extent::default(),
            is_finished: false,
        })
    }
}

impl Draft for ObjectDraft<'_> {
    fn append(&mut self, samples: u64, bytes: &[u8]) -> Result<(), StoreError> {
        let mut batch = WriteBatch::new();
        self.extent.samples += samples;
        let value = keys::block_value(self.extent.samples, bytes);
        batch.put(keys::block(self.number, self.extent.blocks), value);
        self.extent.blocks += 1;
        self.store.database.put(batch)?;
        Ok(())
    }

    fn finish(mut self: Box<Self>) -> Result<SpaceNumber, StoreError> {
        let _changing = self.store.lock_spaces();
        self.store.refuse_taken(&self.name)?;
        let mut batch = WriteBatch::new();
        let value = keys::space_value(&self.name, &self.settings)?;
        batch.put(keys::space(self.number), value);
        batch.delete(keys::deleted(self.number));
        self.store.database.commit(batch)?;
        self.is_finished = true;
        Ok(self.number)
    }
}

impl Drop for ObjectDraft<'_> {
    fn drop(&mut self) {
        if self.is_finished {
            return;
        }
        // What is left goes at the next opening at the latest.
        if let Err(error) = self.store.remove_keys(self.number) {
            tracing::warn!(%error, space = self.name, "remove a space that was not finished");
        }
    }
}
