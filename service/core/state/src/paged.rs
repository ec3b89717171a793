//! A vector in copy-on-write pages: a clone is a snapshot, and costs only what changes after it.

use std::sync::Arc;

use crate::page_version::PageVersion;
use crate::{CorruptState, State, StateReader, StateWriter};

/// A vector in pages of `N` items.
///
/// A clone shares all pages; the first change of a page after that copies the page, and the first
/// change of any page also copies the list of pages.
#[derive(Clone, Debug)]
pub struct PagedVec<T, const N: usize> {
    /// All pages are full but the last one that holds something, and empty behind it.
    pages: Arc<Vec<Arc<Page<T>>>>,
    len: usize,
}

/// One page.
#[derive(Clone, Debug)]
struct Page<T> {
    items: Vec<T>,
    version: PageVersion,
}

impl<T, const N: usize> Default for PagedVec<T, N> {
    fn default() -> Self {
        Self {
            pages: Arc::default(),
            len: 0,
        }
    }
}

impl<T, const N: usize> PagedVec<T, N> {
    /// Number of items.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of pages.
    pub fn page_count(&self) -> usize {
        self.pages.len()
    }

    /// Bytes of memory that it takes, reserved ones included, without what the items own.
    pub fn bytes(&self) -> usize {
        let items: usize = self.pages.iter().map(|page| page.items.capacity()).sum();
        let page = size_of::<Page<T>>() + size_of::<Arc<Page<T>>>() + 16;
        items * size_of::<T>() + self.pages.capacity() * page
    }

    /// The item at an index.
    pub fn get(&self, index: usize) -> Option<&T> {
        self.pages.get(index / N)?.items.get(index % N)
    }

    /// The items from an index on, in order.
    pub fn iter_from(&self, start: usize) -> impl Iterator<Item = &T> {
        let pages = self.pages.get(start / N..).unwrap_or_default();
        pages.iter().flat_map(|page| &page.items).skip(start % N)
    }

    /// The items, in order.
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        self.iter_from(0)
    }

    /// The pages that changed after a revision: index of the page, index of its first item, items.
    pub fn changed_pages(&self, since: u64) -> impl Iterator<Item = (usize, usize, &[T])> {
        let pages = self.pages.iter().enumerate();
        pages
            .filter(move |(_, page)| page.version.changed() > since)
            .map(|(index, page)| (index, index * N, page.items.as_slice()))
    }
}

impl<T: Clone, const N: usize> PagedVec<T, N> {
    /// Appends an item.
    pub fn push(&mut self, item: T, revision: u64) {
        let pages = Arc::make_mut(&mut self.pages);
        if self.len / N == pages.len() {
            pages.push(Arc::new(Page {
                items: Vec::new(),
                version: PageVersion::default(),
            }));
        }
        let page = Arc::make_mut(&mut pages[self.len / N]);
        page.items.push(item);
        page.version.touch(revision);
        self.len += 1;
    }

    /// Removes the last item. The page that it leaves empty stays, and says in a checkpoint that it
    /// is.
    pub fn pop(&mut self, revision: u64) -> Option<T> {
        let last = self.len.checked_sub(1)?;
        let page = Arc::make_mut(&mut Arc::make_mut(&mut self.pages)[last / N]);
        page.version.touch(revision);
        self.len = last;
        let item = page.items.pop();
        if page.items.is_empty() {
            page.items = Vec::new();
        }
        item
    }

    /// The item at an index, to be changed.
    pub fn get_mut(&mut self, index: usize, revision: u64) -> Option<&mut T> {
        if index >= self.len {
            return None; // before the pages are copied for nothing
        }
        let page = Arc::make_mut(&mut self.pages).get_mut(index / N)?;
        let page = Arc::make_mut(page);
        page.version.touch(revision);
        page.items.get_mut(index % N)
    }
}

impl<T: State, const N: usize> PagedVec<T, N> {
    /// Writes the digest of each page; only pages that changed since the last time are hashed anew.
    pub fn write_digests(&self, out: &mut StateWriter) {
        (self.len as u64).write(out);
        for page in &self.pages[..self.len.div_ceil(N)] {
            let digest = page.version.digest(|out| write_page(&page.items, out));
            digest.0.write(out);
        }
    }
}

impl<T: State + Clone, const N: usize> PagedVec<T, N> {
    /// Appends the items of a checkpoint's page, the next one in order.
    ///
    /// # Errors
    /// The bytes are no page of such items, or the page before it is not full.
    pub fn push_page(&mut self, bytes: &[u8], revision: u64) -> Result<(), CorruptState> {
        let mut input = StateReader::new(bytes);
        let count = u16::read(&mut input)?;
        if usize::from(count) > N || !self.len.is_multiple_of(N) {
            return Err(CorruptState::Invalid);
        }
        for _ in 0..count {
            self.push(T::read(&mut input)?, revision);
        }
        input.end()
    }
}

/// Writes the items of a page; nothing if there are none.
///
/// # Panics
/// There are 65,536 or more.
pub fn write_page<T: State>(items: &[T], out: &mut StateWriter) {
    if items.is_empty() {
        return;
    }
    u16::try_from(items.len())
        .expect("pages are far shorter than 65536 items")
        .write(out);
    for item in items {
        item.write(out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Digest;
    use proptest::prelude::*;

    type Numbers = PagedVec<u64, 4>;

    fn digest(numbers: &Numbers) -> Digest {
        let mut out = StateWriter::default();
        numbers.write_digests(&mut out);
        out.digest()
    }

    fn changed(numbers: &Numbers, since: u64) -> Vec<usize> {
        numbers
            .changed_pages(since)
            .map(|(page, ..)| page)
            .collect()
    }

    proptest! {
        /// Against a plain vector; `Some(i)` changes an item or, beyond 40, removes the last one,
        /// `None` appends one, and the snapshot taken on the way must stay as it was.
        #[test]
        fn behaves_like_a_vector(
            steps in prop::collection::vec(prop::option::of(0usize..60), 0..60),
            snapshot_at in 0usize..60,
        ) {
            let mut plain = Vec::new();
            let mut paged = Numbers::default();
            let mut snapshot = None;
            for (step, revision) in steps.iter().zip(1u64..) {
                if snapshot_at as u64 == revision {
                    snapshot = Some((plain.clone(), paged.clone(), digest(&paged)));
                }
                match step {
                    None => {
                        plain.push(revision);
                        paged.push(revision, revision);
                    }
                    Some(40..) => prop_assert_eq!(paged.pop(revision), plain.pop()),
                    Some(index) => {
                        let before = digest(&paged);
                        let item = paged.get_mut(*index, revision);
                        prop_assert_eq!(item.is_some(), *index < plain.len());
                        if let Some(item) = item {
                            *item += 100;
                            plain[*index] += 100;
                            prop_assert_ne!(before, digest(&paged));
                        } else {
                            prop_assert_eq!(before, digest(&paged));
                        }
                    }
                }
                prop_assert_eq!(paged.iter().copied().collect::<Vec<_>>(), plain.clone());
            }
            for start in 0..=plain.len() + 5 {
                let rest: Vec<_> = paged.iter_from(start).copied().collect();
                prop_assert_eq!(&rest[..], plain.get(start..).unwrap_or_default());
            }
            if let Some((plain, paged, before)) = snapshot {
                prop_assert_eq!(paged.iter().copied().collect::<Vec<_>>(), plain);
                prop_assert_eq!(digest(&paged), before);
            }
        }
    }

    #[test]
    fn only_changed_pages_are_reported() {
        let mut numbers = Numbers::default();
        for revision in 1..=10 {
            numbers.push(revision, revision);
        }
        assert_eq!(changed(&numbers, 0), [0, 1, 2]);
        assert_eq!(changed(&numbers, 8), [2]);
        assert_eq!(changed(&numbers, 10), [0usize; 0]);
        *numbers.get_mut(5, 11).unwrap() = 0;
        assert_eq!(changed(&numbers, 10), [1]);
    }

    #[test]
    fn pages_are_restored() {
        let mut numbers = Numbers::default();
        for revision in 1..=10 {
            numbers.push(revision * 7, revision);
        }
        let mut restored = Numbers::default();
        for (.., items) in numbers.changed_pages(0) {
            let mut out = StateWriter::default();
            write_page(items, &mut out);
            restored.push_page(&out.into_bytes(), 10).unwrap();
        }
        assert_eq!(digest(&restored), digest(&numbers));
        assert_eq!(
            restored.push_page(&[1, 0], 10),
            Err(CorruptState::Invalid),
            "last page not full"
        );
        assert_eq!(
            Numbers::default().push_page(&[5, 0], 10),
            Err(CorruptState::Invalid)
        );
        assert_eq!(
            Numbers::default().push_page(&[1, 0, 9], 10),
            Err(CorruptState::Truncated)
        );
    }
}
