//! An index of the stored views: it rules out most of those that a question is not about.
//!
//! Views lie in blocks in the order in which they were stored, so that those of a block are mostly
//! near one another. Beside that, each channel has the coarse copies of its own.

use std::ops::RangeInclusive;

use nalgebra::Point3;
use state::PagedVec;

use super::coarse_copies::CoarseCopies;
use crate::keyframes::SampleKey;
use crate::views::StoredView;

/// Views of a block.
const VIEWS: usize = 64;

/// An index of views by number.
#[derive(Clone, Debug, Default)]
pub(super) struct ViewIndex {
    blocks: PagedVec<Block, 1>,
    len: usize,
    channels: Vec<CoarseCopies>,
}

/// The next views in order.
#[derive(Clone, Debug)]
struct Block {
    sources: Vec<Source>,
    /// Corners of the box of their positions in the map when they were stored.
    low: Point3<f64>,
    high: Point3<f64>,
    /// Lowest and highest ordinal.
    ordinals: [u32; 2],
}

/// Who took a view, and when.
#[derive(Clone, Copy, Debug)]
struct Source {
    agent: u32,
    session: u32,
    ordinal: u32,
}

impl ViewIndex {
    /// Of views from the first on.
    pub(super) fn of<'a>(views: impl Iterator<Item = &'a StoredView>, revision: u64) -> Self {
        let mut index = Self::default();
        for view in views {
            index.push(view, revision);
        }
        index
    }

    /// Adds the next view.
    pub(super) fn push(&mut self, view: &StoredView, revision: u64) {
        if self.len.is_multiple_of(VIEWS) {
            self.blocks.push(Block::of(view), revision);
        }
        let channel = usize::from(view.channel);
        if self.channels.len() <= channel {
            self.channels.resize_with(channel + 1, Default::default);
        }
        let number = u32::try_from(self.len).unwrap_or(u32::MAX); // far fewer are stored
        self.channels[channel].push(number, &view.vector, revision);
        self.len += 1;
        let last = self.blocks.len() - 1;
        if let Some(block) = self.blocks.get_mut(last, revision) {
            block.push(view);
        }
    }

    /// The coarse copies of the views of a channel, if it has any.
    pub(super) fn copies(&self, channel: u8) -> Option<&CoarseCopies> {
        self.channels.get(usize::from(channel))
    }

    /// Number of views of a channel.
    pub(super) fn count(&self, channel: u8) -> usize {
        self.copies(channel).map_or(0, CoarseCopies::len)
    }

    /// The numbers of the views of a channel, in order.
    pub(super) fn of_channel(&self, channel: u8) -> impl Iterator<Item = usize> {
        let copies = self.copies(channel).into_iter();
        copies.flat_map(CoarseCopies::numbers)
    }

    /// Whether a view was taken by the agent of a sample, in its session, and is of an ordinal or a
    /// later one.
    pub(super) fn is_recent(&self, number: usize, sample: &SampleKey, ordinal: u32) -> bool {
        let block = self.blocks.get(number / VIEWS);
        let source = block.and_then(|block| block.sources.get(number % VIEWS));
        source.is_some_and(|source| {
            (source.agent, source.session) == (sample.agent, sample.session)
                && source.ordinal >= ordinal
        })
    }

    /// The numbers of the views that may have been stored within the corners of a box, in order.
    pub(super) fn within(&self, [low, high]: [Point3<f64>; 2]) -> impl Iterator<Item = usize> {
        self.of_blocks(move |block| block.high >= low && block.low <= high)
    }

    /// The numbers of the views that may have ordinals of a range, in order.
    pub(super) fn among(&self, ordinals: RangeInclusive<u32>) -> impl Iterator<Item = usize> {
        self.of_blocks(move |block| {
            let [low, high] = block.ordinals;
            low <= *ordinals.end() && *ordinals.start() <= high
        })
    }

    fn of_blocks(&self, is_meant: impl Fn(&Block) -> bool) -> impl Iterator<Item = usize> {
        let blocks = self.blocks.iter().enumerate();
        let meant = blocks.filter(move |(_, block)| is_meant(block));
        meant.flat_map(|(number, block)| (number * VIEWS..).take(block.sources.len()))
    }

    /// Bytes of memory that it takes.
    pub(super) fn bytes(&self) -> usize {
        let blocks = self.blocks.iter();
        let own = |block: &Block| block.sources.capacity() * size_of::<Source>();
        let copies = self.channels.iter().map(CoarseCopies::bytes);
        self.blocks.bytes() + blocks.map(own).sum::<usize>() + copies.sum::<usize>()
    }
}

impl Block {
    /// Where a view is the first.
    fn of(view: &StoredView) -> Self {
        Self {
            sources: Vec::with_capacity(VIEWS),
            low: view.in_map,
            high: view.in_map,
            ordinals: [view.ordinal; 2],
        }
    }

    fn push(&mut self, view: &StoredView) {
        self.sources.push(Source {
            agent: view.sample.agent,
            session: view.sample.session,
            ordinal: view.ordinal,
        });
        self.low = self.low.inf(&view.in_map);
        self.high = self.high.sup(&view.in_map);
        let [low, high] = self.ordinals;
        self.ordinals = [low.min(view.ordinal), high.max(view.ordinal)];
    }
}

#[cfg(test)]
mod tests;
