//! A vector with gaps in copy-on-write pages: what has been removed takes next to no memory.

#[cfg(test)]
mod tests;

use std::sync::Arc;

use crate::page_version::PageVersion;
use crate::{CorruptState, State, StateReader, StateWriter};

/// Pages per chunk.
const CHUNK: usize = 64;

/// Items by index, of which most may be missing, in pages of `N` indices, 64 at most.
///
/// A page holds its items one behind the other and a bit for each index; a page without items takes
/// 16 bytes, and 64 of them side by side take 16 bytes together. A clone shares all pages; the
/// first change after that copies a page, a chunk of 64 pages and the list of chunks.
#[derive(Clone, Debug)]
pub struct SparseVec<T, const N: usize> {
    chunks: Arc<Vec<Slot<Chunk<T>>>>,
    len: usize,
    next: usize,
}

/// Pages side by side.
type Chunk<T> = [Slot<Page<T>>; CHUNK];

/// A chunk or page that holds something, or the revision at which the last item left it; 0 where
/// there never was one.
#[derive(Debug)]
enum Slot<T> {
    Live(Arc<T>),
    Gone(u64),
}

/// One page, with an item at least.
#[derive(Clone, Debug)]
struct Page<T> {
    /// Bit i is set where there is an item at index i of the page.
    mask: u64,
    items: Vec<T>,
    version: PageVersion,
}

/// What a page holds, for a checkpoint.
#[derive(Debug)]
pub struct PageItems<'a, T> {
    mask: u64,
    items: &'a [T],
}

impl<T> Clone for Slot<T> {
    fn clone(&self) -> Self {
        match self {
            Self::Live(live) => Self::Live(Arc::clone(live)),
            Self::Gone(changed) => Self::Gone(*changed),
        }
    }
}

impl<T, const N: usize> Default for SparseVec<T, N> {
    fn default() -> Self {
        Self {
            chunks: Arc::default(),
            len: 0,
            next: 0,
        }
    }
}

impl<T> Page<T> {
    /// Where the item at an index of the page is among the items, or would be.
    fn rank(&self, index: usize) -> usize {
        (self.mask & ((1 << index) - 1)).count_ones() as usize
    }

    /// Whether there is an item at an index of the page.
    fn holds(&self, index: usize) -> bool {
        (self.mask >> index) & 1 == 1
    }

    /// The items with their indices, the first index of the page being `first`.
    fn iter(&self, first: usize) -> impl Iterator<Item = (usize, &T)> {
        self.iter_from(first, 0)
    }

    /// The same from an index of the page on.
    fn iter_from(&self, first: usize, start: usize) -> impl Iterator<Item = (usize, &T)> {
        let mut left = self.mask & (u64::MAX << start);
        self.items[self.rank(start)..].iter().map(move |item| {
            let index = left.trailing_zeros() as usize;
            left &= left - 1;
            (first + index, item)
        })
    }
}

impl<T, const N: usize> SparseVec<T, N> {
    /// Number of items.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The index after the largest one that has ever been used.
    pub fn next_index(&self) -> usize {
        self.next
    }

    /// Bytes of memory that it takes, reserved ones included, without what the items own.
    pub fn bytes(&self) -> usize {
        let counts = 2 * size_of::<usize>();
        let pages = self.pages().map(|(_, page)| {
            size_of::<Page<T>>() + counts + page.items.capacity() * size_of::<T>()
        });
        let chunks = self.chunks.iter().map(|chunk| match chunk {
            Slot::Live(_) => size_of::<Chunk<T>>() + counts,
            Slot::Gone(_) => 0,
        });
        let list = self.chunks.capacity() * size_of::<Slot<Chunk<T>>>();
        pages.sum::<usize>() + chunks.sum::<usize>() + list
    }

    /// The item at an index.
    pub fn get(&self, index: usize) -> Option<&T> {
        let page = self.page(index / N)?;
        let within = index % N;
        if page.holds(within) {
            page.items.get(page.rank(within))
        } else {
            None
        }
    }

    /// The items from an index on, with their indices, in order.
    pub fn iter_from(&self, start: usize) -> impl Iterator<Item = (usize, &T)> {
        self.pages_from(start / N).flat_map(move |(at, page)| {
            let first = at * N;
            page.iter_from(first, start.saturating_sub(first))
        })
    }

    /// The items with their indices, in order.
    pub fn iter(&self) -> impl Iterator<Item = (usize, &T)> {
        self.iter_from(0)
    }

    /// The items of a page, with their indices.
    pub fn iter_page(&self, page: usize) -> impl Iterator<Item = (usize, &T)> {
        let found = self.page(page);
        found
            .into_iter()
            .flat_map(move |items| items.iter(page * N))
    }

    /// The pages that changed after a revision, with their indices; those that lost their last item
    /// are empty.
    pub fn changed_pages(&self, since: u64) -> impl Iterator<Item = (usize, PageItems<'_, T>)> {
        let chunks = self.chunks.iter().enumerate();
        let slots = chunks.flat_map(|(at, chunk)| {
            let (pages, gone) = match chunk {
                Slot::Live(chunk) => (&chunk[..], 0),
                Slot::Gone(changed) => (&[][..], *changed),
            };
            let first = at * CHUNK;
            let live = (first..).zip(pages).map(|(page, slot)| match slot {
                Slot::Live(items) => (page, items.version.changed(), Some(items)),
                Slot::Gone(changed) => (page, *changed, None),
            });
            let emptied = if gone == 0 { 0 } else { CHUNK };
            live.chain((first..first + emptied).map(move |page| (page, gone, None)))
        });
        slots
            .filter(move |(_, changed, _)| *changed > since)
            .map(|(page, _, items)| {
                let (mask, items) = items.map_or((0, &[][..]), |page| (page.mask, &page.items[..]));
                (page, PageItems { mask, items })
            })
    }

    /// A page that holds something.
    fn page(&self, page: usize) -> Option<&Page<T>> {
        let Slot::Live(chunk) = self.chunks.get(page / CHUNK)? else {
            return None;
        };
        match &chunk[page % CHUNK] {
            Slot::Live(page) => Some(page),
            Slot::Gone(_) => None,
        }
    }

    /// The pages from one on that hold something, with their indices.
    fn pages_from(&self, start: usize) -> impl Iterator<Item = (usize, &Page<T>)> {
        let chunks = self.chunks.get(start / CHUNK..).unwrap_or_default();
        let chunks = (start / CHUNK..).zip(chunks);
        chunks.flat_map(move |(at, chunk)| {
            let pages = match chunk {
                Slot::Live(chunk) => &chunk[..],
                Slot::Gone(_) => &[],
            };
            let skipped = start.saturating_sub(at * CHUNK).min(pages.len());
            let pages = (at * CHUNK + skipped..).zip(&pages[skipped..]);
            pages.filter_map(|(at, page)| match page {
                Slot::Live(page) => Some((at, &**page)),
                Slot::Gone(_) => None,
            })
        })
    }

    /// The pages that hold something, with their indices.
    fn pages(&self) -> impl Iterator<Item = (usize, &Page<T>)> {
        self.pages_from(0)
    }
}

impl<T: Clone, const N: usize> SparseVec<T, N> {
    /// Appends an item and returns its index, which nothing has had before.
    pub fn push(&mut self, item: T, revision: u64) -> usize {
        let index = self.next;
        self.insert(index, item, revision);
        index
    }

    /// Puts an item at an index, in the place of what is there.
    pub fn insert(&mut self, index: usize, item: T, revision: u64) {
        const { assert!(0 < N && N <= 64, "a page has a bit for each index") };
        self.next = self.next.max(index + 1);
        let (at, within) = (index / N, index % N);
        let chunks = Arc::make_mut(&mut self.chunks);
        if chunks.len() <= at / CHUNK {
            chunks.resize(at / CHUNK + 1, Slot::Gone(0));
        }
        let chunk = &mut chunks[at / CHUNK];
        if let Slot::Gone(changed) = *chunk {
            *chunk = Slot::Live(Arc::new(std::array::from_fn(|_| Slot::Gone(changed))));
        }
        let Slot::Live(chunk) = chunk else { return };
        let slot = &mut Arc::make_mut(chunk)[at % CHUNK];
        if let Slot::Gone(_) = slot {
            *slot = Slot::Live(Arc::new(Page {
                mask: 0,
                items: Vec::new(),
                version: PageVersion::default(),
            }));
        }
        let Slot::Live(page) = slot else { return };
        let page = Arc::make_mut(page);
        page.version.touch(revision);
        let rank = page.rank(within);
        if page.holds(within) {
            page.items[rank] = item;
        } else {
            page.items.insert(rank, item);
            page.mask |= 1 << within;
            self.len += 1;
        }
    }

    /// The item at an index, to be changed.
    pub fn get_mut(&mut self, index: usize, revision: u64) -> Option<&mut T> {
        self.get(index)?; // before the pages are copied for nothing
        let (at, within) = (index / N, index % N);
        let Slot::Live(chunk) = &mut Arc::make_mut(&mut self.chunks)[at / CHUNK] else {
            return None;
        };
        let Slot::Live(page) = &mut Arc::make_mut(chunk)[at % CHUNK] else {
            return None;
        };
        let page = Arc::make_mut(page);
        page.version.touch(revision);
        let rank = page.rank(within);
        page.items.get_mut(rank)
    }

    /// Removes the item at an index.
    pub fn remove(&mut self, index: usize, revision: u64) -> Option<T> {
        self.get(index)?; // before the pages are copied for nothing
        let (at, within) = (index / N, index % N);
        let chunk_slot = &mut Arc::make_mut(&mut self.chunks)[at / CHUNK];
        let Slot::Live(chunk) = chunk_slot else {
            return None;
        };
        let chunk = Arc::make_mut(chunk);
        let Slot::Live(page) = &mut chunk[at % CHUNK] else {
            return None;
        };
        let page = Arc::make_mut(page);
        page.version.touch(revision);
        let item = page.items.remove(page.rank(within));
        page.mask &= !(1 << within);
        self.len -= 1;
        if page.mask == 0 {
            chunk[at % CHUNK] = Slot::Gone(revision);
            if chunk.iter().all(|page| matches!(page, Slot::Gone(_))) {
                *chunk_slot = Slot::Gone(revision);
            }
        } else if page.items.len() * 2 <= page.items.capacity() {
            page.items.shrink_to_fit();
        }
        Some(item)
    }

    /// Sets the index of the next item that is appended, beyond all that have been used.
    pub fn skip_to(&mut self, next: usize) {
        self.next = self.next.max(next);
    }
}

impl<T: State, const N: usize> SparseVec<T, N> {
    /// Writes the digest of each page that holds something; only pages that changed since the last
    /// time are hashed anew.
    pub fn write_digests(&self, out: &mut StateWriter) {
        (self.len as u64).write(out);
        for (at, page) in self.pages() {
            (at as u64).write(out);
            let (mask, items) = (page.mask, &page.items[..]);
            let digest = page
                .version
                .digest(|out| PageItems { mask, items }.write(out));
            digest.0.write(out);
        }
    }
}

impl<T: State + Clone, const N: usize> SparseVec<T, N> {
    /// Adds the items of a checkpoint's page, of which there is nothing yet.
    ///
    /// # Errors
    /// The bytes are no page of such items, or some of the page are there already.
    pub fn restore_page(
        &mut self,
        page: usize,
        bytes: &[u8],
        revision: u64,
    ) -> Result<(), CorruptState> {
        let mut input = StateReader::new(bytes);
        let mask = u64::read(&mut input)?;
        let legal = N == 64 || mask >> N == 0;
        if mask == 0 || !legal || self.page(page).is_some() {
            return Err(CorruptState::Invalid);
        }
        for within in (0..N).filter(|within| (mask >> within) & 1 == 1) {
            self.insert(page * N + within, T::read(&mut input)?, revision);
        }
        input.end()
    }
}

impl<T: State> PageItems<'_, T> {
    /// Writes the items; nothing if there are none.
    pub fn write(&self, out: &mut StateWriter) {
        if self.mask == 0 {
            return;
        }
        self.mask.write(out);
        for item in self.items {
            item.write(out);
        }
    }
}
