//! Coarse copies of the views of a channel: they rule out most of those that are not alike.
//!
//! A copy is in numbers of eight bits, v ≈ s c, beside the length δ of what that leaves out. For a
//! query q with its own copy q̂ and rest δ',
//!
//! ```text
//! q·v ≤ q̂·(s c) + δ' |v| + (|q| + δ') δ
//! ```
//!
//! so a view below a cosine by that is below it; the others are compared as they are. Answers are
//! therefore those of a comparison with all.

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

    /// Compares the copies of the views from a number on with a vector; `visit` takes them in
    /// order, block by block.
    pub(super) fn compare(&self, vector: &[f32], from: usize, mut visit: impl FnMut(Compared<'_>)) {
        let query = Coarse::of(vector);
        let wide: Vec<i16> = query.codes.iter().map(|code| i16::from(*code)).collect();
        let (mut cosines, mut most) = ([0.0; VIEWS], [0.0; VIEWS]);
        for block in self.blocks.iter() {
            let is_before = |number: &u32| (*number as usize) < from;
            let first = block.numbers.partition_point(is_before);
            let end = block.numbers.len();
            if first == end {
                continue;
            }
            simd::dispatch(
                #[inline(always)]
                || block.compare(&query, &wide, &mut cosines, &mut most),
            );
            visit(Compared {
                numbers: &block.numbers[first..],
                cosines: &cosines[first..end],
                most: &most[first..end],
            });
        }
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

impl Block {
    /// The cosines of the copies with that of a vector, and the largest that the views themselves
    /// may have.
    #[expect(
        clippy::inline_always,
        reason = "compiled for the vectors of a dispatch"
    )]
    #[inline(always)]
    fn compare(
        &self,
        query: &Coarse,
        wide: &[i16],
        cosines: &mut [f32; VIEWS],
        most: &mut [f32; VIEWS],
    ) {
        let mut products = [0; VIEWS];
        let codes = self.codes.chunks_exact(wide.len().max(1));
        for (sum, codes) in products.iter_mut().zip(codes) {
            *sum = product(wide, codes);
        }
        let beyond = query.length + query.rest;
        let parts = self.scales.iter().zip(&self.lengths).zip(&self.rests);
        let out = cosines.iter_mut().zip(most.iter_mut()).zip(&products);
        for (((cosine, most), product), ((scale, length), rest)) in out.zip(parts) {
            #[expect(
                clippy::cast_precision_loss,
                reason = "off by less than rounding errors"
            )]
            let product = *product as f32;
            *cosine = query.scale * scale * product;
            *most = *cosine + (query.rest * length + beyond * rest);
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

/// The next views of a channel beside a vector, by their coarse copies.
#[derive(Clone, Copy, Debug)]
pub(super) struct Compared<'a> {
    pub(super) numbers: &'a [u32],
    /// Cosines of the copies.
    cosines: &'a [f32],
    /// The largest that the views themselves may have.
    most: &'a [f32],
}

impl Compared<'_> {
    /// Angle between the copies of one of the views and of the vector \[rad\].
    pub(super) fn angle_rad(&self, index: usize) -> f64 {
        f64::from(self.cosines[index]).clamp(-1.0, 1.0).acos()
    }

    /// Numbers of the views that may have at least a cosine.
    pub(super) fn alike(&self, cosine: f32) -> impl Iterator<Item = usize> {
        let views = self.numbers.iter().zip(self.most);
        let alike = views.filter(move |(_, most)| {
            // Of what is no number nothing is ruled out.
            let is_less = **most < cosine - ROUNDING;
            !is_less
        });
        alike.map(|(number, _)| *number as usize)
    }
}

#[cfg(test)]
mod tests;
