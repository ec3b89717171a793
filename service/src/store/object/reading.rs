//! Blocks of a journal, as they are read.

use slatedb::DbIterator;

use super::super::{SpaceNumber, StoreError};
use super::database::Database;
use super::keys;

/// Blocks of a journal, up to the first that is missing.
pub(super) struct Reading<'a> {
    database: &'a Database,
    space: SpaceNumber,
    /// None after the end or an error.
    items: Option<DbIterator>,
    /// Number of the next block.
    next: u64,
    /// Number of the block that was next when the reading began.
    end: u64,
}

impl<'a> Reading<'a> {
    /// Reads the blocks of a space from `from` up to `end`.
    pub(super) fn begin(
        database: &'a Database,
        space: SpaceNumber,
        from: u64,
        end: u64,
    ) -> Result<Self, StoreError> {
        let items = Some(database.items(&keys::blocks(space), from)?);
        let next = from;
        Ok(Self {
            database,
            space,
            items,
            next,
            end,
        })
    }
}

impl Iterator for Reading<'_> {
    type Item = Result<(u64, Vec<u8>), StoreError>;

    fn next(&mut self) -> Option<Self::Item> {
        let mut items = self.items.take()?;
        let item = match self.database.next(&mut items) {
            Ok(item) => item.filter(|_| self.next < self.end)?,
            Err(error) => return Some(Err(error)),
        };
        let key = &item.key[keys::blocks(self.space).len()..];
        let bytes = keys::bytes_of(&item.value);
        let Some(bytes) = bytes.filter(|_| keys::block_of(key) == Some(self.next)) else {
            let what = format!("block {} of space {}", self.next, self.space.0);
            return Some(Err(self.database.corrupt(&what)));
        };
        let block = (self.next, bytes.to_vec());
        self.next += 1;
        self.items = Some(items);
        Some(Ok(block))
    }
}
