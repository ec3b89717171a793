//! A whole store: all its shards, each open.

use std::sync::Arc;

use super::{ShardNumber, Shards, Store};

/// All shards of a store.
#[derive(Clone, Debug)]
pub struct WholeStore {
    shards: Shards,
    /// By number.
    stores: Vec<Arc<dyn Store>>,
}

impl WholeStore {
    /// A store that is not divided.
    pub fn undivided(store: Arc<dyn Store>) -> Self {
        Self {
            shards: Shards::ONE,
            stores: vec![store],
        }
    }

    /// Opens every shard of a store.
    ///
    /// # Errors
    /// The first one of `open`.
    pub fn open<E>(
        shards: Shards,
        open: impl FnMut(ShardNumber) -> Result<Arc<dyn Store>, E>,
    ) -> Result<Self, E> {
        let stores = shards.all().map(open).collect::<Result<_, E>>()?;
        Ok(Self { shards, stores })
    }

    /// How many shards there are.
    pub fn shards(&self) -> Shards {
        self.shards
    }

    /// The shards, each with its number.
    pub fn iter(&self) -> impl Iterator<Item = (ShardNumber, &Arc<dyn Store>)> {
        self.shards.all().zip(&self.stores)
    }

    /// The shard that a space of a name is in.
    pub fn of(&self, space: &str) -> &dyn Store {
        &*self.stores[self.shards.of(space).0 as usize]
    }
}
