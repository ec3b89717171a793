//! Items that keep their number while they live, and leave it to others after.

use crate::paged::PagedVec;
use crate::state::{CorruptState, State, StateReader, StateWriter};

/// The number of no item.
pub(super) const NONE: u32 = u32::MAX;

/// Items by number, in copy-on-write pages. The number of a removed one goes to the next that comes, so that memory
/// does not grow with what has been.
#[derive(Clone, Debug)]
pub(super) struct Slots<T, const N: usize> {
    pub(super) pages: PagedVec<Slot<T>, N>,
    /// The first vacant number, which names the next one.
    vacant: u32,
    len: u32,
}

/// A number with its item, or the vacant number after it.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Slot<T> {
    Taken(T),
    Vacant(u32),
}

impl<T, const N: usize> Default for Slots<T, N> {
    fn default() -> Self {
        Self {
            pages: PagedVec::default(),
            vacant: NONE,
            len: 0,
        }
    }
}

impl<T: Clone, const N: usize> Slots<T, N> {
    /// How many items there are.
    pub(super) fn len(&self) -> usize {
        self.len as usize
    }

    /// How many numbers have been given out.
    pub(super) fn numbers(&self) -> u32 {
        u32::try_from(self.pages.len()).unwrap_or(NONE)
    }

    pub(super) fn get(&self, number: u32) -> Option<&T> {
        match self.pages.get(number as usize)? {
            Slot::Taken(item) => Some(item),
            Slot::Vacant(_) => None,
        }
    }

    pub(super) fn get_mut(&mut self, number: u32, revision: u64) -> Option<&mut T> {
        match self.pages.get_mut(number as usize, revision)? {
            Slot::Taken(item) => Some(item),
            Slot::Vacant(_) => None,
        }
    }

    /// Gives an item a number; [`NONE`] if there is none left.
    pub(super) fn insert(&mut self, item: T, revision: u64) -> u32 {
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

    pub(super) fn remove(&mut self, number: u32, revision: u64) -> Option<T> {
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
    pub(super) fn iter(&self) -> impl Iterator<Item = (u32, &T)> {
        let slots = (0..).zip(self.pages.iter());
        slots.filter_map(|(number, slot)| match slot {
            Slot::Taken(item) => Some((number, item)),
            Slot::Vacant(_) => None,
        })
    }

    /// What a checkpoint's header has to tell: the first vacant number, and how many items there are.
    pub(super) fn vacancy(&self) -> (u32, u32) {
        (self.vacant, self.len)
    }

    /// Takes over what a checkpoint's header told.
    pub(super) fn set_vacancy(&mut self, (vacant, len): (u32, u32)) {
        self.vacant = vacant;
        self.len = len;
    }

    /// Whether the vacant numbers are those that the chain of vacancies names, each once.
    pub(super) fn is_sound(&self) -> bool {
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
        let mut slots = Slots::<u64, 4>::default();
        for item in 0..6_u32 {
            assert_eq!(slots.insert(u64::from(item), 1), item);
        }
        assert_eq!(slots.remove(1, 2), Some(1));
        assert_eq!(slots.remove(1, 2), None);
        assert_eq!(slots.remove(4, 2), Some(4));
        assert_eq!((slots.get(4), slots.len(), slots.numbers()), (None, 4, 6));
        assert!(slots.is_sound());
        assert_eq!(slots.insert(7, 3), 4);
        assert_eq!(slots.insert(8, 3), 1);
        assert_eq!(slots.insert(9, 3), 6);
        let all: Vec<_> = slots.iter().map(|(number, item)| (number, *item)).collect();
        assert_eq!(
            all,
            [(0, 0), (1, 8), (2, 2), (3, 3), (4, 7), (5, 5), (6, 9)]
        );
        assert!(slots.is_sound());
        slots.set_vacancy((3, 6));
        assert!(!slots.is_sound());
    }
}
