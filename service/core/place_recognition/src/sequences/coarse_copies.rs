//! Coarse copies of the views of a channel: they rule out most of those that are not alike, and
//! say about how alike others are.
//!
//! A copy is in numbers of eight bits, v ≈ s c, beside the length δ of what that leaves out. For a
//! query q with its own copy q̂ and rest δ',
//!
//! ```text
//! q·v ≤ q̂·(s c) + δ' |v| + (|q| + δ') δ
//! ```
//!
//! so a view below a cosine by that is below it; the others are compared as they are. Which views
//! are alike is therefore answered as by a comparison with all. Angles by the copies are not exact.

use state::PagedVec;

/// Views of a block.
const VIEWS: usize = 64;
/// Largest number of a coarse copy.
const LARGEST: f32 = 127.0;
/// Products of coarse numbers that are summed at a time, in registers of one kind.
const PRODUCTS: usize = 32;
/// More than the rounding errors of scalar products and angles of up to 4096 numbers.
const ROUNDING: f32 = 1e-4;

/// The coarse copies of the views of a channel, in the order of their numbers.
#[derive(Clone, Debug, Default)]
pub(super) struct CoarseCopies {
    blocks: PagedVec<Block, 1>,
    len: usize,
}

/// The next copies in order, each part of all of them one behind the other.
#[derive(Clone, Debug, Default)]
struct Block {
    numbers: Vec<u32>,
    codes: Vec<i8>,
    /// s: what a step of a code stands for.
    scales: Vec<f32>,
    /// |v|, and δ: an upper bound of each.
    lengths: Vec<f32>,
    rests: Vec<f32>,
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

impl CoarseCopies {
    /// Adds the copy of the view of a number, the highest so far, with as many numbers as those
    /// before.
    pub(super) fn push(&mut self, number: u32, vector: &[f32], revision: u64) {
        if self.len.is_multiple_of(VIEWS) {
            self.blocks.push(Block::default(), revision);
        }
        self.len += 1;
        let last = self.blocks.len() - 1;
        if let Some(block) = self.blocks.get_mut(last, revision) {
            let coarse = Coarse::of(vector);
            // All at once, and again after it was copied.
            let room = VIEWS.saturating_sub(block.numbers.len());
            block.numbers.reserve_exact(room);
            block.codes.reserve_exact(room * vector.len());
            for parts in [&mut block.scales, &mut block.lengths, &mut block.rests] {
                parts.reserve_exact(room);
            }
            block.numbers.push(number);
            block.codes.extend(coarse.codes);
            block.scales.push(coarse.scale);
            block.lengths.push(coarse.length);
            block.rests.push(coarse.rest);
        }
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// The numbers of the views, in order.
    pub(super) fn numbers(&self) -> impl Iterator<Item = usize> {
        let numbers = self.blocks.iter().flat_map(|block| &block.numbers);
        numbers.map(|number| *number as usize)
    }

    /// Angles of every so many views with a vector \[rad\], from one on, by their copies; each with
    /// the number of the view.
    pub(super) fn angles_rad(
        &self,
        vector: &[f32],
        first: usize,
        step: usize,
    ) -> impl Iterator<Item = (usize, f64)> {
        let query = Query::of(vector);
        let every = (first..self.len).step_by(step.max(1));
        every.filter_map(move |at| {
            let block = self.blocks.get(at / VIEWS)?;
            let cosine = f64::from(query.cosine(block, at % VIEWS)?);
            let number = *block.numbers.get(at % VIEWS)? as usize;
            Some((number, cosine.clamp(-1.0, 1.0).acos()))
        })
    }

    /// The numbers of the views from a number on that may have at least a cosine with a vector, in
    /// order.
    pub(super) fn alike(&self, vector: &[f32], cosine: f32, from: usize) -> Vec<usize> {
        let query = Query::of(vector);
        let mut bounds = [0.0; VIEWS];
        let mut alike = Vec::new();
        for block in self.blocks.iter_from(self.block_of(from)) {
            simd::dispatch(
                #[inline(always)]
                || query.bound(block, &mut bounds),
            );
            for (number, bound) in block.numbers.iter().zip(&bounds) {
                // Of what is no number nothing is ruled out.
                let is_less = *bound < cosine - ROUNDING;
                let number = *number as usize;
                if !is_less && number >= from {
                    alike.push(number);
                }
            }
        }
        alike
    }

    /// The first block with a view of a number or of a later one.
    fn block_of(&self, number: usize) -> usize {
        let (mut before, mut after) = (0, self.blocks.len());
        while before < after {
            let middle = before.midpoint(after);
            let last = { self.blocks.get(middle) }.and_then(|block| block.numbers.last());
            if last.is_some_and(|last| (*last as usize) < number) {
                before = middle + 1;
            } else {
                after = middle;
            }
        }
        before
    }

    /// Bytes of memory that they take.
    pub(super) fn bytes(&self) -> usize {
        let own = |block: &Block| {
            let numbers = block.numbers.capacity() + 3 * block.scales.capacity();
            block.codes.capacity() + 4 * numbers
        };
        self.blocks.bytes() + self.blocks.iter().map(own).sum::<usize>()
    }
}

/// A vector that is compared with copies.
struct Query {
    own: Coarse,
    /// Its numbers, as they are multiplied.
    wide: Vec<i16>,
}

impl Query {
    fn of(vector: &[f32]) -> Self {
        let own = Coarse::of(vector);
        let wide = own.codes.iter().map(|code| i16::from(*code)).collect();
        Self { own, wide }
    }

    /// The cosine with the copy of one view of a block.
    fn cosine(&self, block: &Block, index: usize) -> Option<f32> {
        let codes = block
            .codes
            .chunks_exact(self.wide.len().max(1))
            .nth(index)?;
        Some(self.scaled(*block.scales.get(index)?, product(&self.wide, codes)))
    }

    /// What a product of coarse numbers stands for.
    #[expect(
        clippy::inline_always,
        reason = "compiled for the vectors of a dispatch"
    )]
    #[inline(always)]
    #[expect(
        clippy::cast_precision_loss,
        reason = "off by less than rounding errors"
    )]
    fn scaled(&self, scale: f32, product: i32) -> f32 {
        self.own.scale * scale * product as f32
    }

    /// The largest cosine that each view of a block may have with the vector.
    #[expect(
        clippy::inline_always,
        reason = "compiled for the vectors of a dispatch"
    )]
    #[inline(always)]
    fn bound(&self, block: &Block, bounds: &mut [f32; VIEWS]) {
        let mut products = [0; VIEWS];
        let codes = block.codes.chunks_exact(self.wide.len().max(1));
        for (sum, codes) in products.iter_mut().zip(codes) {
            *sum = product(&self.wide, codes);
        }
        let beyond = self.own.length + self.own.rest;
        let parts = block.scales.iter().zip(&block.lengths).zip(&block.rests);
        for ((bound, product), ((scale, length), rest)) in
            bounds.iter_mut().zip(&products).zip(parts)
        {
            *bound = self.scaled(*scale, *product) + (self.own.rest * length + beyond * rest);
        }
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
    let (a, a_rest) = a.as_chunks::<PRODUCTS>();
    let (b, b_rest) = b.as_chunks::<PRODUCTS>();
    let mut sum = 0_i32;
    for (a, b) in a.iter().zip(b) {
        let mut part = 0_i32;
        for k in 0..PRODUCTS {
            part = part.wrapping_add(i32::from(a[k]).wrapping_mul(i32::from(b[k])));
        }
        sum = sum.wrapping_add(part);
    }
    for (a, b) in a_rest.iter().zip(b_rest) {
        sum = sum.wrapping_add(i32::from(*a).wrapping_mul(i32::from(*b)));
    }
    sum
}

#[cfg(test)]
mod tests;
