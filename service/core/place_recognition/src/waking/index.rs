//! Numbers by channel and key: open addressing, rebuilt when it is half full.

use std::sync::Arc;

/// Place of a cell, or of a tile of cells, in its lattice.
pub(super) type Key = [i32; 3];

/// An empty slot.
const NONE: u32 = u32::MAX;
/// Slots of the smallest index.
const SLOTS_MIN: usize = 64;

/// Numbers by channel and key.
#[derive(Clone, Debug, Default)]
pub(super) struct KeyIndex {
    slots: Arc<Vec<u32>>,
    len: usize,
}

impl KeyIndex {
    /// The number of what is on a channel at a key; `place` tells both of a number.
    pub(super) fn find(
        &self,
        channel: u8,
        key: Key,
        place: impl Fn(u32) -> Option<(u8, Key)>,
    ) -> Option<u32> {
        let mask = self.slots.len().checked_sub(1)?;
        let mut slot = hash(channel, key) & mask;
        loop {
            let number = self.slots[slot];
            if place(number)? == (channel, key) {
                return Some(number);
            }
            slot = (slot + 1) & mask;
        }
    }

    /// Inserts a number of which `place` tells, but which is not here.
    pub(super) fn insert(
        &mut self,
        number: u32,
        channel: u8,
        key: Key,
        place: impl Fn(u32) -> Option<(u8, Key)>,
    ) {
        if 2 * (self.len + 1) > self.slots.len() {
            let slots = (2 * self.slots.len()).max(SLOTS_MIN);
            let old = std::mem::replace(&mut self.slots, Arc::new(vec![NONE; slots]));
            for number in old.iter().filter(|number| **number != NONE) {
                if let Some((channel, key)) = place(*number) {
                    self.put(*number, hash(channel, key));
                }
            }
        }
        self.put(number, hash(channel, key));
        self.len += 1;
    }

    fn put(&mut self, number: u32, hash: usize) {
        let slots = Arc::make_mut(&mut self.slots);
        let mask = slots.len() - 1;
        let mut slot = hash & mask;
        while slots[slot] != NONE {
            slot = (slot + 1) & mask;
        }
        slots[slot] = number;
    }

    pub(super) fn bytes(&self) -> usize {
        4 * self.slots.len()
    }
}

/// Mixes a key: the lower bits depend on all of it.
fn hash(channel: u8, [x, y, z]: Key) -> usize {
    let keys = [u64::from(x.cast_unsigned()), u64::from(y.cast_unsigned())];
    let seed = u64::from(channel) << 32 | u64::from(z.cast_unsigned());
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the lower bits are as good"
    )]
    let hash = random::bits(seed, [keys[0], keys[1], 0]) as usize;
    hash
}
