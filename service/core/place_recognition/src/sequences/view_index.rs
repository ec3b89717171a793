//! An index of the stored views: it rules out most of those that a question is not about.
//!
//! Views lie in blocks in the order in which they were stored, so that those of a block are mostly
//! near one another. Of each it has a coarse copy in numbers of eight bits, v ≈ s c, with the
//! length δ of what that leaves out. For a query q with its own copy q̂ and rest δ',
//!
//! ```text
//! q·v ≤ q̂·(s c) + δ' |v| + (|q| + δ') δ
//! ```
//!
//! so a view below a cosine by that is below it; the others are compared as they are. Answers are
//! therefore those of a comparison with all.

use std::ops::RangeInclusive;

use nalgebra::Point3;
use state::PagedVec;

use crate::views::StoredView;

/// Views of a block.
const VIEWS: usize = 64;
/// Largest number of a coarse copy.
const LARGEST: f32 = 127.0;
/// More than the rounding errors of scalar products and angles of up to 4096 numbers.
const ROUNDING: f32 = 1e-4;

/// An index of views by number.
#[derive(Clone, Debug, Default)]
pub(super) struct ViewIndex {
    blocks: PagedVec<Block, 1>,
    len: usize,
    /// Views of each channel.
    counts: Vec<usize>,
}

/// The next views in order.
#[derive(Clone, Debug)]
struct Block {
    rows: Vec<Row>,
    /// The coarse copies, one behind the other.
    codes: Vec<i8>,
    /// Corners of the box of their positions in the map when they were stored.
    low: Point3<f64>,
    high: Point3<f64>,
    /// Lowest and highest ordinal.
    ordinals: [u32; 2],
}

/// A view of a block.
#[derive(Clone, Debug)]
struct Row {
    channel: u8,
    /// Behind the last of its codes.
    end: u32,
    /// s: what a step of a code stands for.
    scale: f32,
    /// |v|, and δ: an upper bound of each.
    length: f32,
    rest: f32,
}

/// A vector in coarse numbers.
struct Coarse {
    codes: Vec<i8>,
    scale: f32,
    length: f32,
    rest: f32,
}

impl Coarse {
    fn of(vector: &[f32]) -> Self {
        let largest = vector.iter().fold(0.0_f32, |most, x| most.max(x.abs()));
        let scale = largest / LARGEST;
        #[expect(clippy::cast_possible_truncation, reason = "from −127 to 127")]
        let code = |x: &f32| (x / scale).round() as i8; // 0 of 0/0
        let codes: Vec<i8> = vector.iter().map(code).collect();
        let length = vector.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>();
        let rest = { vector.iter().zip(&codes) }
            .map(|(x, code)| (f64::from(*x) - f64::from(scale) * f64::from(*code)).powi(2))
            .sum::<f64>();
        #[expect(clippy::cast_possible_truncation, reason = "rounded up")]
        let above = |square: f64| (square.sqrt() * (1.0 + 1e-6)) as f32;
        Self {
            codes,
            scale,
            length: above(length),
            rest: above(rest),
        }
    }
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
        self.len += 1;
        let channel = usize::from(view.channel);
        if self.counts.len() <= channel {
            self.counts.resize(channel + 1, 0);
        }
        self.counts[channel] += 1;
        let last = self.blocks.len() - 1;
        if let Some(block) = self.blocks.get_mut(last, revision) {
            block.push(view);
        }
    }

    /// The numbers of the views of a channel from a number on that may have at least a cosine with
    /// a vector, in order.
    pub(super) fn alike(
        &self,
        channel: u8,
        vector: &[f32],
        cosine: f32,
        from: usize,
    ) -> Vec<usize> {
        let query = Coarse::of(vector);
        let wide: Vec<i16> = query.codes.iter().map(|code| i16::from(*code)).collect();
        let mut found = Vec::new();
        simd::dispatch(
            #[inline(always)]
            || {
                let first = from / VIEWS;
                for (block, number) in self.blocks.iter_from(first).zip(first..) {
                    let mut start = 0;
                    for (row, number) in block.rows.iter().zip(number * VIEWS..) {
                        let codes = &block.codes[start..row.end as usize];
                        start = row.end as usize;
                        if row.channel != channel || number < from {
                            continue;
                        }
                        let (about, beyond) = query.bound(row, product(&wide, codes));
                        // Of what is no number nothing is ruled out.
                        let is_less = about + beyond < cosine - ROUNDING;
                        if !is_less {
                            found.push(number);
                        }
                    }
                }
            },
        );
        found
    }

    /// Number of views of a channel.
    pub(super) fn count(&self, channel: u8) -> usize {
        self.counts.get(usize::from(channel)).copied().unwrap_or(0)
    }

    /// The numbers of the views of a channel, in order.
    pub(super) fn of_channel(&self, channel: u8) -> impl Iterator<Item = usize> {
        let rows = self.blocks.iter().flat_map(|block| &block.rows);
        let numbered = rows.enumerate();
        numbered.filter_map(move |(number, row)| (row.channel == channel).then_some(number))
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
        meant.flat_map(|(number, block)| (number * VIEWS..).take(block.rows.len()))
    }

    /// Bytes of memory that it takes.
    pub(super) fn bytes(&self) -> usize {
        let blocks = self.blocks.iter();
        let own = |block: &Block| block.codes.capacity() + block.rows.capacity() * size_of::<Row>();
        self.blocks.bytes() + blocks.map(own).sum::<usize>()
    }
}

impl Coarse {
    /// The cosine with a row by the scalar product of both copies, and how far it may be off.
    #[inline]
    fn bound(&self, row: &Row, product: i32) -> (f32, f32) {
        #[expect(
            clippy::cast_precision_loss,
            reason = "off by less than rounding errors"
        )]
        let about = self.scale * row.scale * product as f32;
        let beyond = self.rest * row.length + (self.length + self.rest) * row.rest;
        (about, beyond)
    }
}

impl Block {
    /// Where a view is the first.
    fn of(view: &StoredView) -> Self {
        Self {
            rows: Vec::with_capacity(VIEWS),
            codes: Vec::new(),
            low: view.in_map,
            high: view.in_map,
            ordinals: [view.ordinal; 2],
        }
    }

    fn push(&mut self, view: &StoredView) {
        let coarse = Coarse::of(&view.vector);
        self.codes.extend(coarse.codes);
        self.rows.push(Row {
            channel: view.channel,
            end: u32::try_from(self.codes.len()).unwrap_or(u32::MAX), // at most 64 × 4096
            scale: coarse.scale,
            length: coarse.length,
            rest: coarse.rest,
        });
        self.low = self.low.inf(&view.in_map);
        self.high = self.high.sup(&view.in_map);
        let [low, high] = self.ordinals;
        self.ordinals = [low.min(view.ordinal), high.max(view.ordinal)];
    }
}

/// Scalar product of two coarse vectors: no sum of at most 4096 products is too large for it, and
/// without checks of that the compiler may use vector registers.
#[expect(
    clippy::inline_always,
    reason = "compiled for the vectors of a dispatch"
)]
#[inline(always)]
fn product(a: &[i16], b: &[i8]) -> i32 {
    a.iter().zip(b).fold(0, |sum: i32, (a, b)| {
        sum.wrapping_add(i32::from(*a).wrapping_mul(i32::from(*b)))
    })
}

#[cfg(test)]
mod tests;
