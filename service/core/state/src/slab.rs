//! Items that keep their number while they live, and leave it to others after.

use crate::PagedVec;
use crate::{CorruptState, State, StateReader, StateWriter};

/// The number of no item.
pub const NONE: u32 = u32::MAX;

/// Items by number, in copy-on-write pages. The number of a removed one goes to the next that
/// comes, so that memory does not grow with what has been.
#[derive(Clone, Debug)]
pub struct Slab<T, const N: usize> {
    /// The slots, by number.
    pub pages: PagedVec<Slot<T>, N>,
    /// The first vacant number, which names the next one.
    vacant: u32,
    len: u32,
}

/// A number with its item, or the vacant number after it.
#[derive(Clone, Debug, PartialEq)]
pub enum Slot<T> {
    /// An item.
    Taken(T),
    /// The next vacant number; [`NONE`] after the last.
    Vacant(u32),
}

impl<T, const N: usize> Default for Slab<T, N> {
    fn default() -> Self {
        Self {
            pages: PagedVec::default(),
            vacant: NONE,
            len: 0,
        }
    }
}

impl<T: Clone, const N: usize> Slab<T, N> {
    /// How many items there are.
    pub fn len(&self) -> usize {
        self.len as usize
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// How many numbers have been given out.
    pub fn numbers(&self) -> u32 {
        u32::try_from(self.pages.len()).unwrap_or(NONE)
    }

    /// The item of a number.
    pub fn get(&self, number: u32) -> Option<&T> {
        match self.pages.get(number as usize)? {
            Slot::Taken(item) => Some(item),
            Slot::Vacant(_) => None,
        }
    }

    /// The item of a number, to be changed.
    pub fn get_mut(&mut self, number: u32, revision: u64) -> Option<&mut T> {
        match self.pages.get_mut(number as usize, revision)? {
            Slot::Taken(item) => Some(item),
            Slot::Vacant(_) => None,
        }
    }

    /// Gives an item a number; [`NONE`] if there is none left.
    pub fn insert(&mut self, item: T, revision: u64) -> u32 {
        let number = self.vacant;
        if number == NONE {
            let number = self.numbers();
            if number != NONE {
                self.pages.push(Slot::Taken(item), revision);
                self.len += 1;
            }
            return number;
        }
        if let Some(slot) = self.pages.get_mut(number as usize, revision) {
            if let Slot::Vacant(next) = *slot {
                self.vacant = next;
            }
            *slot = Slot::Taken(item);
            self.len += 1;
        }
        number
    }

    /// Takes an item out; its number is vacant.
    pub fn remove(&mut self, number: u32, revision: u64) -> Option<T> {
        let slot = self.pages.get_mut(number as usize, revision)?;
        if matches!(slot, Slot::Vacant(_)) {
            return None;
        }
        let removed = std::mem::replace(slot, Slot::Vacant(self.vacant));
        self.vacant = number;
        self.len -= 1;
        match removed {
            Slot::Taken(item) => Some(item),
            Slot::Vacant(_) => None,
        }
    }

    /// The items with their numbers, by number.
    pub fn iter(&self) -> impl Iterator<Item = (u32, &T)> {
        let slab = (0..).zip(self.pages.iter());
        slab.filter_map(|(number, slot)| match slot {
            Slot::Taken(item) => Some((number, item)),
            Slot::Vacant(_) => None,
        })
    }

    /// What a checkpoint's header holds: the first vacant number, and how many items there
    /// are.
    pub fn vacancy(&self) -> (u32, u32) {
        (self.vacant, self.len)
    }

    /// Sets what a checkpoint's header held.
    pub fn set_vacancy(&mut self, (vacant, len): (u32, u32)) {
        self.vacant = vacant;
        self.len = len;
    }

    /// Whether the vacant numbers are those that the chain of vacancies names, each once.
    pub fn is_sound(&self) -> bool {
        let vacancies = self.pages.len().checked_sub(self.len as usize);
        let Some(vacancies) = vacancies else {
            return false;
        };
        let mut number = self.vacant;
        for _ in 0..vacancies {
            match self.pages.get(number as usize) {
                Some(Slot::Vacant(next)) => number = *next,
                _ => return false,
            }
        }
        number == NONE && self.iter().count() == self.len as usize
    }
}

impl<T: State> State for Slot<T> {
    fn write(&self, out: &mut StateWriter) {
        match self {
            Self::Taken(item) => {
                true.write(out);
                item.write(out);
            }
            Self::Vacant(next) => {
                false.write(out);
                next.write(out);
            }
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        if bool::read(input)? {
            T::read(input).map(Self::Taken)
        } else {
            u32::read(input).map(Self::Vacant)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_used_again() {
        let mut slab = Slab::<u64, 4>::default();
        for item in 0..6_u32 {
            assert_eq!(slab.insert(u64::from(item), 1), item);
        }
        assert_eq!(slab.remove(1, 2), Some(1));
        assert_eq!(slab.remove(1, 2), None);
        assert_eq!(slab.remove(4, 2), Some(4));
        assert_eq!((slab.get(4), slab.len(), slab.numbers()), (None, 4, 6));
        assert!(slab.is_sound());
        assert_eq!(slab.insert(7, 3), 4);
        assert_eq!(slab.insert(8, 3), 1);
        assert_eq!(slab.insert(9, 3), 6);
        let all: Vec<_> = slab.iter().map(|(number, item)| (number, *item)).collect();
        assert_eq!(
            all,
            [(0, 0), (1, 8), (2, 2), (3, 3), (4, 7), (5, 5), (6, 9)]
        );
        assert!(slab.is_sound());
        slab.set_vacancy((3, 6));
        assert!(!slab.is_sound());
    }
}
