//! Shards: the parts of a store, each with a database, an owner and spaces of its own.

use std::num::NonZeroU32;

use xxhash_rust::xxh3::xxh3_64;

/// A part of a store.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ShardNumber(pub u32);

impl std::fmt::Display for ShardNumber {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

/// How many parts a store has. Fixed when it is created, because it says where each space is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shards(NonZeroU32);

impl From<NonZeroU32> for Shards {
    fn from(count: NonZeroU32) -> Self {
        Self(count)
    }
}

impl Shards {
    /// A store that is not divided.
    pub const ONE: Self = Self(NonZeroU32::MIN);

    /// So many shards; there is at least one.
    pub fn new(count: u32) -> Option<Self> {
        NonZeroU32::new(count).map(Self)
    }

    /// How many there are.
    pub fn count(self) -> u32 {
        self.0.get()
    }

    /// The shard of a space, by its name: always the same one.
    ///
    /// # Panics
    /// Never: a remainder is below the number of shards.
    pub fn of(self, space: &str) -> ShardNumber {
        let hash = xxh3_64(space.as_bytes()) % u64::from(self.count());
        ShardNumber(u32::try_from(hash).expect("a remainder is below the count"))
    }

    /// All of them.
    pub fn all(self) -> impl Iterator<Item = ShardNumber> {
        (0..self.count()).map(ShardNumber)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spaces_spread_over_all_shards_and_stay_where_they_are() {
        let shards = Shards::new(8).expect("a count");
        let mut spaces = [0_u32; 8];
        for number in 0..8000 {
            spaces[shards.of(&format!("hall-{number}")).0 as usize] += 1;
        }
        // Each has a thousand on average, with a standard deviation of 30.
        assert!(
            spaces.iter().all(|count| (850..1150).contains(count)),
            "{spaces:?}"
        );
        // Stores on disk depend upon it.
        assert_eq!(
            ["hall", "lab", "default"].map(|name| shards.of(name).0),
            [7, 4, 2]
        );
        assert_eq!(Shards::ONE.of("hall"), ShardNumber(0));
        assert_eq!(Shards::new(0), None);
    }
}
