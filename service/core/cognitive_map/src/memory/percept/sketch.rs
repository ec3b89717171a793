//! Sketches of vectors: 256 bits each, to find the few of very many that may be near a cue.
//!
//! A bit is the sign of the vector along a random direction, so two vectors an angle θ apart differ
//! in 256 θ/π bits on average (Charikar 2002). The directions are those of a randomised Hadamard
//! transform: signs are flipped at random and the transform taken, twice (Ailon & Chazelle 2009),
//! which costs n log n and needs no matrix.

use std::sync::Arc;

use random::bits;

/// Words of a sketch.
const WORDS: usize = 4;
/// Bits of a sketch.
const BITS: usize = WORDS * u64::BITS as usize;
/// Sketches per page: a change after a snapshot copies one page.
const PAGE: usize = 128;
/// Times that signs are flipped and the transform is taken.
const ROUNDS: usize = 2;

/// A sketch.
pub(super) type Sketch = [u64; WORDS];

/// How vectors of one length are sketched. The same on every run.
#[derive(Clone, Debug)]
pub(super) struct Sketcher {
    /// −1 or 1, for each round and number of the vector, which is filled up with zeros to a power
    /// of two.
    flips: Arc<[Vec<f32>; ROUNDS]>,
}

/// The sketches of many vectors, by slot. A clone shares all pages.
#[derive(Clone, Debug, Default)]
pub(super) struct Sketches(Arc<Vec<Arc<[Sketch; PAGE]>>>);

impl Sketcher {
    /// For vectors of so many numbers.
    pub(super) fn new(dimension: usize) -> Self {
        let len = dimension.max(BITS).next_power_of_two();
        let sign = |round: usize, at: usize| {
            let heads = bits(dimension as u64, [0, round as u64, at as u64]) & 1 == 0;
            if heads { 1.0 } else { -1.0 }
        };
        let round = |round| (0..len).map(|at| sign(round, at)).collect();
        Self {
            flips: Arc::new(std::array::from_fn(round)),
        }
    }

    /// The sketch of a vector, which does not depend on the vector's length.
    pub(super) fn sketch(&self, vector: &[f32]) -> Sketch {
        let mut numbers = vec![0.0; self.flips[0].len()];
        numbers[..vector.len()].copy_from_slice(vector);
        for flips in self.flips.iter() {
            for (number, flip) in numbers.iter_mut().zip(flips) {
                *number *= flip;
            }
            transform(&mut numbers);
        }
        let mut sketch = Sketch::default();
        for (at, number) in numbers.iter().take(BITS).enumerate() {
            sketch[at / 64] |= u64::from(*number >= 0.0) << (at % 64);
        }
        sketch
    }
}

impl Sketches {
    /// Puts a sketch into a slot.
    pub(super) fn set(&mut self, slot: usize, sketch: Sketch) {
        let pages = Arc::make_mut(&mut self.0);
        if pages.len() <= slot / PAGE {
            pages.resize(slot / PAGE + 1, Arc::new([Sketch::default(); PAGE]));
        }
        Arc::make_mut(&mut pages[slot / PAGE])[slot % PAGE] = sketch;
    }

    /// Bytes of memory that they take, reserved ones included.
    pub(super) fn bytes(&self) -> usize {
        self.0.capacity() * size_of::<Arc<[Sketch; PAGE]>>()
            + self.0.len() * size_of::<[Sketch; PAGE]>()
    }

    /// The slots, of the first `len`, whose sketches are nearest to a cue's: `count` or, as equally
    /// near ones are all taken, more; in order.
    pub(super) fn nearest(&self, cue: &Sketch, len: usize, count: usize) -> Vec<usize> {
        let all = || self.0.iter().flat_map(|page| page.iter()).take(len);
        // A first pass counts how many are how near, which says how near the last one is.
        let mut counts = [0usize; BITS + 1];
        for sketch in all() {
            counts[distance(cue, sketch) as usize] += 1;
        }
        let mut sum = 0;
        let farthest = counts.iter().position(|at| {
            sum += at;
            sum >= count
        });
        let farthest = farthest.map_or(u32::MAX, |bits| u32::try_from(bits).unwrap_or(u32::MAX));
        let near = all()
            .enumerate()
            .filter(|(_, sketch)| distance(cue, sketch) <= farthest);
        near.map(|(slot, _)| slot).collect()
    }
}

/// Bits that differ.
fn distance(a: &Sketch, b: &Sketch) -> u32 {
    a.iter().zip(b).map(|(a, b)| (a ^ b).count_ones()).sum()
}

/// The Hadamard transform, in place, of as many numbers as a power of two.
fn transform(numbers: &mut [f32]) {
    let mut half = 1;
    while half < numbers.len() {
        for pair in numbers.chunks_exact_mut(2 * half) {
            let (left, right) = pair.split_at_mut(half);
            for (a, b) in left.iter_mut().zip(right) {
                (*a, *b) = (*a + *b, *a - *b);
            }
        }
        half *= 2;
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use super::*;

    fn noise(key: u64, at: usize) -> f32 {
        // A sum of uniform numbers is normal enough.
        let uniform = |k| random::uniform(7, [0, key, at as u64 * 8 + k]);
        #[expect(clippy::cast_possible_truncation, reason = "a few digits are enough")]
        let sum = (0..8).map(|k| uniform(k) - 0.5).sum::<f64>() as f32;
        sum
    }

    fn vector(key: u64, dimension: usize) -> Vec<f32> {
        (0..dimension).map(|at| noise(key, at)).collect()
    }

    fn angle(a: &[f32], b: &[f32]) -> f32 {
        let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
        (dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()).acos()
    }

    #[test]
    fn bits_differ_in_proportion_to_the_angle() {
        for dimension in [8, 100, 256, 1000] {
            let sketcher = Sketcher::new(dimension);
            for (part, spread) in [(0.0, 0), (0.2, 24), (0.5, 32), (1.0, 40)] {
                let mut off = 0.0;
                for key in 0..20 {
                    let a = vector(key, dimension);
                    let other = vector(key + 1000, dimension);
                    let mix = |(a, b): (&f32, &f32)| (1.0 - part) * a + part * b;
                    let b: Vec<f32> = a.iter().zip(&other).map(mix).collect();
                    let expected = angle(&a, &b) / PI * 256.0;
                    let found = distance(&sketcher.sketch(&a), &sketcher.sketch(&b)) as f32;
                    let error = if part > 0.0 { found - expected } else { found };
                    assert!(
                        error.abs() <= spread as f32 + 0.5,
                        "{dimension} {part} {error}"
                    );
                    off += error / 20.0;
                }
                assert!(
                    off.abs() < 8.0,
                    "{dimension} numbers, {part}: biased by {off}"
                );
            }
        }
    }

    #[test]
    fn length_says_nothing_and_the_opposite_differs_in_all() {
        let sketcher = Sketcher::new(300);
        let a = vector(3, 300);
        let scaled = |by: f32| a.iter().map(|x| by * x).collect::<Vec<_>>();
        let sketch = sketcher.sketch(&a);
        assert_eq!(sketcher.sketch(&scaled(7.5)), sketch);
        assert_eq!(distance(&sketcher.sketch(&scaled(-1.0)), &sketch), 256);
        // Vectors whose numbers are all of one sign are told apart as well as others.
        let positive = |key| vector(key, 300).iter().map(|x| x.abs()).collect::<Vec<_>>();
        let (a, b) = (positive(4), positive(5));
        let expected = angle(&a, &b) / PI * 256.0;
        let found = distance(&sketcher.sketch(&a), &sketcher.sketch(&b)) as f32;
        assert!((found - expected).abs() < 40.0, "{found} {expected}");
    }

    #[test]
    fn the_nearest_are_those_of_a_scan() {
        let sketcher = Sketcher::new(16);
        let sketch = |key: usize| sketcher.sketch(&vector(key as u64 / 2, 16));
        let mut sketches = Sketches::default();
        for slot in 0..500 {
            sketches.set(slot, sketch(slot));
        }
        let snapshot = sketches.clone();
        let cue = sketcher.sketch(&vector(777, 16));
        for (len, count) in [(0, 1), (1, 1), (500, 1), (500, 10), (300, 77), (500, 1000)] {
            let mut scan: Vec<_> = (0..len)
                .map(|slot| (distance(&cue, &sketch(slot)), slot))
                .collect();
            scan.sort_unstable();
            let last = scan.get(count - 1).map_or(u32::MAX, |last| last.0);
            let mut expected: Vec<_> = scan
                .iter()
                .filter(|near| near.0 <= last)
                .map(|near| near.1)
                .collect();
            expected.sort_unstable();
            assert_eq!(
                sketches.nearest(&cue, len, count),
                expected,
                "{count} of {len}"
            );
        }
        sketches.set(0, cue);
        assert_eq!(sketches.nearest(&cue, 500, 1)[0], 0);
        assert_eq!(snapshot.nearest(&sketch(0), 1, 1), [0]);
    }
}
