//! A vector with gaps in copy-on-write pages: what has been removed takes next to no memory.

use std::sync::{Arc, OnceLock};

use crate::digest::Digest;
use crate::state::{CorruptState, State, StateReader, StateWriter};

/// Pages per chunk.
const CHUNK: usize = 64;

/// Items by index, of which most may be missing, in pages of `N` indices, 64 at most.
///
/// A page holds its items one behind the other and a bit for each index; a page without items takes
/// 16 bytes, and [`CHUNK`] of them side by side take 16 bytes together. A clone shares all pages; the
/// first change after that copies a page, a chunk of 64 pages and the list of chunks.
#[derive(Clone, Debug)]
pub(crate) struct SparseVec<T, const N: usize> {
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
#[derive(Debug)]
struct Page<T> {
    /// Bit i is set where there is an item at index i of the page.
    mask: u64,
    items: Vec<T>,
    /// Revision of the latest change. It serves checkpoints only and is not part of the digest.
    changed: u64,
    /// Digest of the items, once asked for.
    digest: OnceLock<Digest>,
}

/// What a page holds, for a checkpoint.
#[derive(Debug)]
pub(crate) struct PageItems<'a, T> {
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

impl<T: Clone> Clone for Page<T> {
    fn clone(&self) -> Self {
        // A page is copied in order to be changed, so its digest is not worth copying.
        Self {
            mask: self.mask,
            items: self.items.clone(),
            changed: self.changed,
            digest: OnceLock::new(),
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

    /// Notes that the items are about to change.
    fn touch(&mut self, revision: u64) {
        self.changed = revision;
        self.digest.take();
    }

    /// The items with their indices, the first index of the page being `first`.
    fn iter(&self, first: usize) -> impl Iterator<Item = (usize, &T)> {
        let mut left = self.mask;
        self.items.iter().map(move |item| {
            let index = left.trailing_zeros() as usize;
            left &= left - 1;
            (first + index, item)
        })
    }
}

impl<T, const N: usize> SparseVec<T, N> {
    /// Number of items.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// The index after the largest one that has ever been used.
    pub(crate) fn next_index(&self) -> usize {
        self.next
    }

    /// Bytes of memory that it takes, reserved ones included, without what the items own.
    pub(crate) fn bytes(&self) -> usize {
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
    pub(crate) fn get(&self, index: usize) -> Option<&T> {
        let page = self.page(index / N)?;
        let within = index % N;
        if page.holds(within) {
            page.items.get(page.rank(within))
        } else {
            None
        }
    }

    /// The items from an index on, with their indices, in order.
    pub(crate) fn iter_from(&self, start: usize) -> impl Iterator<Item = (usize, &T)> {
        self.pages_from(start / N)
            .flat_map(|(at, page)| page.iter(at * N))
            .skip_while(move |(index, _)| *index < start)
    }

    /// The items with their indices, in order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (usize, &T)> {
        self.iter_from(0)
    }

    /// The items of a page, with their indices.
    pub(crate) fn iter_page(&self, page: usize) -> impl Iterator<Item = (usize, &T)> {
        let found = self.page(page);
        found
            .into_iter()
            .flat_map(move |items| items.iter(page * N))
    }

    /// The pages that changed after a revision, with their indices; those that lost their last item
    /// are empty.
    pub(crate) fn changed_pages(
        &self,
        since: u64,
    ) -> impl Iterator<Item = (usize, PageItems<'_, T>)> {
        let chunks = self.chunks.iter().enumerate();
        let slots = chunks.flat_map(|(at, chunk)| {
            let (pages, gone) = match chunk {
                Slot::Live(chunk) => (&chunk[..], 0),
                Slot::Gone(changed) => (&[][..], *changed),
            };
            let first = at * CHUNK;
            let live = (first..).zip(pages).map(|(page, slot)| match slot {
                Slot::Live(items) => (page, items.changed, Some(items)),
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
            let pages = (at * CHUNK..)
                .zip(pages)
                .skip_while(move |(page, _)| *page < start);
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
    pub(crate) fn push(&mut self, item: T, revision: u64) -> usize {
        let index = self.next;
        self.insert(index, item, revision);
        index
    }

    /// Puts an item at an index, in the place of what is there.
    pub(crate) fn insert(&mut self, index: usize, item: T, revision: u64) {
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
                changed: 0,
                digest: OnceLock::new(),
            }));
        }
        let Slot::Live(page) = slot else { return };
        let page = Arc::make_mut(page);
        page.touch(revision);
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
    pub(crate) fn get_mut(&mut self, index: usize, revision: u64) -> Option<&mut T> {
        self.get(index)?; // before the pages are copied for nothing
        let (at, within) = (index / N, index % N);
        let Slot::Live(chunk) = &mut Arc::make_mut(&mut self.chunks)[at / CHUNK] else {
            return None;
        };
        let Slot::Live(page) = &mut Arc::make_mut(chunk)[at % CHUNK] else {
            return None;
        };
        let page = Arc::make_mut(page);
        page.touch(revision);
        let rank = page.rank(within);
        page.items.get_mut(rank)
    }

    /// Removes the item at an index.
    pub(crate) fn remove(&mut self, index: usize, revision: u64) -> Option<T> {
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
        page.touch(revision);
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
    pub(crate) fn skip_to(&mut self, next: usize) {
        self.next = self.next.max(next);
    }
}

impl<T: State, const N: usize> SparseVec<T, N> {
    /// Writes the digest of each page that holds something; only pages that changed since the last
    /// time are hashed anew.
    pub(crate) fn write_digests(&self, out: &mut StateWriter) {
        (self.len as u64).write(out);
        for (at, page) in self.pages() {
            (at as u64).write(out);
            page.digest().0.write(out);
        }
    }
}

impl<T: State + Clone, const N: usize> SparseVec<T, N> {
    /// Adds the items of a checkpoint's page, of which there is nothing yet.
    pub(crate) fn restore_page(
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

impl<T: State> Page<T> {
    /// Digest of the items.
    fn digest(&self) -> Digest {
        *self.digest.get_or_init(|| {
            let (mask, items) = (self.mask, &self.items[..]);
            let mut out = StateWriter::default();
            PageItems { mask, items }.write(&mut out);
            out.digest()
        })
    }
}

impl<T: State> PageItems<'_, T> {
    /// Writes the items; nothing if there are none.
    pub(crate) fn write(&self, out: &mut StateWriter) {
        if self.mask == 0 {
            return;
        }
        self.mask.write(out);
        for item in self.items {
            item.write(out);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    type Numbers = SparseVec<u64, 4>;

    fn digest(numbers: &Numbers) -> Digest {
        let mut out = StateWriter::default();
        numbers.write_digests(&mut out);
        out.digest()
    }

    fn contents(numbers: &Numbers) -> BTreeMap<usize, u64> {
        numbers.iter().map(|(index, item)| (index, *item)).collect()
    }

    fn pages(numbers: &Numbers, since: u64) -> Vec<(usize, Vec<u8>)> {
        let pages = numbers.changed_pages(since);
        let written = pages.map(|(page, items)| {
            let mut out = StateWriter::default();
            items.write(&mut out);
            (page, out.into_bytes())
        });
        written.collect()
    }

    #[derive(Clone, Copy, Debug)]
    enum Step {
        Push,
        Change(usize),
        Remove(usize),
        RemoveBelow(usize),
    }

    fn step() -> impl Strategy<Value = Step> {
        prop_oneof![
            6 => Just(Step::Push),
            2 => (0usize..600).prop_map(Step::Change),
            2 => (0usize..600).prop_map(Step::Remove),
            1 => (0usize..600).prop_map(Step::RemoveBelow),
        ]
    }

    proptest! {
        /// Against an ordered map. The snapshot taken on the way stays as it was, and what was stored
        /// page by page, laid over one another, is always the whole.
        #[test]
        fn behaves_like_a_map(
            filled in prop::sample::select(vec![0u64, 3, 250, 520]),
            steps in prop::collection::vec(step(), 0..60),
            snapshot_at in 0u64..60,
        ) {
            let mut plain = BTreeMap::new();
            let mut sparse = Numbers::default();
            for number in 0..filled {
                plain.insert(sparse.push(number, 1), number);
            }
            let mut stored: BTreeMap<_, _> = pages(&sparse, 0).into_iter().collect();
            let mut snapshot = None;
            for (step, revision) in steps.into_iter().zip(2u64..) {
                if snapshot_at + 2 == revision {
                    snapshot = Some((plain.clone(), sparse.clone(), digest(&sparse)));
                }
                match step {
                    Step::Push => {
                        let index = sparse.next_index();
                        prop_assert_eq!(sparse.push(revision, revision), index);
                        prop_assert_eq!(plain.insert(index, revision), None);
                    }
                    Step::Change(index) => {
                        let item = sparse.get_mut(index, revision);
                        prop_assert_eq!(item.as_deref(), plain.get(&index));
                        if let Some(item) = item {
                            *item += 1000;
                            *plain.entry(index).or_default() += 1000;
                        }
                    }
                    Step::Remove(index) => {
                        prop_assert_eq!(sparse.remove(index, revision), plain.remove(&index));
                    }
                    Step::RemoveBelow(end) => {
                        for index in 0..end {
                            sparse.remove(index, revision);
                        }
                        plain.retain(|index, _| *index >= end);
                    }
                }
                prop_assert_eq!(contents(&sparse), plain.clone());
                prop_assert_eq!(sparse.len(), plain.len());
                stored.extend(pages(&sparse, revision - 1));
            }
            for start in (0..sparse.next_index() + 5).step_by(3) {
                let rest: Vec<_> = sparse.iter_from(start).map(|(index, _)| index).collect();
                prop_assert_eq!(rest, plain.range(start..).map(|(i, _)| *i).collect::<Vec<_>>());
                prop_assert_eq!(sparse.get(start), plain.get(&start));
            }
            if let Some((plain, sparse, before)) = snapshot {
                prop_assert_eq!(contents(&sparse), plain);
                prop_assert_eq!(digest(&sparse), before);
            }
            let mut restored = Numbers::default();
            for (page, bytes) in stored.iter().filter(|(_, bytes)| !bytes.is_empty()) {
                restored.restore_page(*page, bytes, 99).unwrap();
            }
            prop_assert_eq!(contents(&restored), contents(&sparse));
            prop_assert_eq!(digest(&restored), digest(&sparse));
        }
    }

    #[test]
    fn what_is_gone_takes_next_to_no_memory() {
        let mut numbers = SparseVec::<[u64; 16], 64>::default();
        for index in 0..1_000_000 {
            numbers.push([index; 16], index);
            if let Some(old) = usize::try_from(index).unwrap().checked_sub(500) {
                numbers.remove(old, index);
            }
        }
        assert_eq!(numbers.len(), 500);
        let bytes = numbers.bytes();
        assert!(bytes < 500 * 128 + 20_000, "{bytes}");
    }

    #[test]
    fn damaged_pages_are_refused() {
        let restore = |bytes: &[u8]| Numbers::default().restore_page(0, bytes, 1);
        let page = |mask: u64| [&mask.to_le_bytes()[..], &[7; 8]].concat();
        assert_eq!(restore(&page(0b100)), Ok(()));
        assert_eq!(restore(&page(0)), Err(CorruptState::Invalid), "empty");
        assert_eq!(restore(&page(0b1_0000)), Err(CorruptState::Invalid));
        assert_eq!(restore(&page(0b11)), Err(CorruptState::Truncated));
        assert_eq!(restore(&[1, 0]), Err(CorruptState::Truncated));
    }
}
