//! What places remember of a channel of descriptors, laid out for a scan.
//!
//! Directions lie one behind the other in blocks of 16 KiB. A search multiplies the cue with every
//! one of them: exact, the same on every run, and as fast as memory is read. Where there are so
//! many that this takes long, the cue is compared with sketches first, and multiplied with the
//! nearest.

use super::sketch::{Sketcher, Sketches};
use crate::memory::ids::PlaceId;
use place_recognition::dot;
use state::PagedVec;
use state::SparseVec;
use state::{CorruptState, State, StateReader, StateWriter, state_of_struct};

/// Numbers in a block: a change after a snapshot copies one block.
const BLOCK_LEN: usize = 4096;
/// Shortest descriptor; the longest fills a block.
const DIMENSION_MIN: usize = 8;

/// What a place remembers of the channel, besides the direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct DescriptorTrace {
    pub(super) place: PlaceId,
    pub(super) count: u64,
    pub(super) weight: f64,
    /// Latest stamp of a descriptor \[ns\].
    pub(super) last_stamp_ns: i64,
}

state_of_struct!(DescriptorTrace {
    place,
    count,
    weight,
    last_stamp_ns
});

/// A descriptor that a place sees.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen<'a> {
    /// The place.
    pub(crate) place: PlaceId,
    /// Its confidence.
    pub(crate) weight: f64,
    /// The descriptor's numbers.
    pub(crate) vector: &'a [f32],
    /// When \[ns\].
    pub(crate) stamp_ns: i64,
}

/// Some traces and their directions.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    dimension: usize,
    traces: Vec<DescriptorTrace>,
    /// Weighted sums of the descriptors, one behind the other.
    ///
    /// A sum of 10⁷ descriptors does not change by the next one in f32; by then it has settled.
    sums: Vec<f32>,
    /// One over the length of each sum; 0 where the sum is zero. Follows from the sums.
    scales: Vec<f32>,
}

/// What all places remember of the channel, in the order in which they first did, as long as none
/// is forgotten: then the last one takes its row.
#[derive(Clone, Debug)]
pub(super) struct DescriptorMemory {
    dimension: usize,
    /// All blocks but the last are full. A block is a page of its own.
    blocks: PagedVec<Block, 1>,
    len: usize,
    /// The slot of each place: its block's index times the rows of a block, plus its row.
    slots: SparseVec<u32, 64>,
    sketcher: Sketcher,
    /// Of the sums, by slot. They follow from them.
    sketches: Sketches,
}

impl DescriptorMemory {
    /// Nothing is remembered yet of a channel of descriptors of `dimension` numbers.
    pub(super) fn new(dimension: u16) -> Self {
        Self {
            dimension: dimension.into(),
            blocks: PagedVec::default(),
            len: 0,
            slots: SparseVec::default(),
            sketcher: Sketcher::new(dimension.into()),
            sketches: Sketches::default(),
        }
    }

    /// Number of places that remember something.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// The blocks.
    pub(super) fn blocks(&self) -> &PagedVec<Block, 1> {
        &self.blocks
    }

    /// The traces.
    pub(super) fn traces(&self) -> impl Iterator<Item = &DescriptorTrace> {
        self.blocks.iter().flat_map(|block| &block.traces)
    }

    /// What a place remembers: its trace, and the mean direction.
    pub(super) fn get(&self, place: PlaceId) -> Option<(&DescriptorTrace, Box<[f32]>)> {
        let (block, row) = self.row_of(place)?;
        let scale = block.scales[row];
        let direction = block.sum(row).iter().map(|x| x * scale).collect();
        Some((&block.traces[row], direction))
    }

    /// What a place remembers, without the direction.
    pub(super) fn trace(&self, place: PlaceId) -> Option<&DescriptorTrace> {
        let (block, row) = self.row_of(place)?;
        block.traces.get(row)
    }

    /// What a place remembers, against a descriptor: number of percepts, and the cosine.
    pub(super) fn compare(&self, place: PlaceId, vector: &[f32]) -> Option<(u64, f64)> {
        let (block, row) = self.row_of(place)?;
        Some((block.traces[row].count, block.cosine(row, vector)))
    }

    /// Strengthens the association of a place and a descriptor. Beyond `blocks_max` blocks no
    /// further place remembers anything.
    pub(super) fn strengthen(&mut self, seen: &Seen<'_>, blocks_max: usize, revision: u64) -> bool {
        let place = seen.place;
        let rows = rows_per_block(self.dimension);
        let slot = if let Some(slot) = self.slot_of(place) {
            slot
        } else {
            let slots_max = blocks_max.saturating_mul(rows);
            let Some(slot) = next_slot(self.len, slots_max) else {
                return false;
            };
            if self.len.is_multiple_of(rows) {
                self.blocks.push(Block::new(self.dimension), revision);
            }
            self.len += 1;
            self.slots.insert(place.0 as usize, slot, 0);
            slot as usize
        };
        let Some(block) = self.blocks.get_mut(slot / rows, revision) else {
            return false;
        };
        if slot % rows == block.traces.len() {
            block.push(place);
        }
        block.strengthen(slot % rows, seen);
        let sketch = self.sketcher.sketch(block.sum(slot % rows));
        self.sketches.set(slot, sketch);
        true
    }

    /// Forgets what a place remembers. The last trace takes its row, so that no gap is scanned.
    pub(super) fn forget(&mut self, place: PlaceId, revision: u64) {
        let Some(slot) = self.slots.remove(place.0 as usize, 0) else {
            return;
        };
        let rows = rows_per_block(self.dimension);
        let last_slot = self.len - 1;
        let last_block = last_slot / rows;
        let Some((trace, sum)) = self
            .blocks
            .get_mut(last_block, revision)
            .and_then(Block::pop)
        else {
            return;
        };
        self.len = last_slot;
        if last_slot.is_multiple_of(rows) {
            self.blocks.pop(revision);
        }
        if slot as usize != last_slot {
            self.slots.insert(trace.place.0 as usize, slot, 0);
            let slot = slot as usize;
            if let Some(block) = self.blocks.get_mut(slot / rows, revision) {
                block.replace(slot % rows, trace, &sum);
            }
            self.sketches.set(slot, self.sketcher.sketch(&sum));
        }
    }

    /// Whether a place remembers anything.
    pub(super) fn remembers(&self, place: PlaceId) -> bool {
        self.slot_of(place).is_some()
    }

    /// Bytes of memory that it takes, reserved ones included.
    pub(super) fn bytes(&self) -> usize {
        let numbers = size_of::<f32>();
        let blocks = self.blocks.iter().map(|block| {
            block.traces.capacity() * size_of::<DescriptorTrace>()
                + (block.sums.capacity() + block.scales.capacity()) * numbers
        });
        blocks.sum::<usize>() + self.blocks.bytes() + self.slots.bytes() + self.sketches.bytes()
    }

    /// Cosine of a unit vector and what each place remembers, in \[−1, 1\].
    pub(super) fn cosines<'a>(
        &'a self,
        vector: &'a [f32],
    ) -> impl Iterator<Item = (PlaceId, f64)> + 'a {
        self.blocks.iter().flat_map(move |block| {
            let rows = block
                .traces
                .iter()
                .zip(block.sums.chunks_exact(block.dimension));
            rows.zip(&block.scales)
                .map(move |((trace, sum), scale)| (trace.place, cosine(dot(sum, vector), *scale)))
        })
    }

    /// As [`Self::cosines`], of the `count` places whose sketches are nearest to the cue's, and of
    /// those that are equally near.
    pub(super) fn cosines_of_nearest<'a>(
        &'a self,
        vector: &'a [f32],
        count: usize,
    ) -> impl Iterator<Item = (PlaceId, f64)> + 'a {
        let rows = rows_per_block(self.dimension);
        let cue = self.sketcher.sketch(vector);
        let near = self.sketches.nearest(&cue, self.len, count);
        near.into_iter().filter_map(move |slot| {
            let (block, row) = (self.blocks.get(slot / rows)?, slot % rows);
            Some((block.traces.get(row)?.place, block.cosine(row, vector)))
        })
    }

    /// Appends a checkpoint's page. A place that comes twice is refused.
    pub(super) fn push_page(&mut self, bytes: &[u8], revision: u64) -> Result<(), CorruptState> {
        let rows = rows_per_block(self.dimension);
        if !self.len.is_multiple_of(rows) {
            return Err(CorruptState::Invalid);
        }
        let at = self.blocks.len();
        self.blocks.push_page(bytes, revision)?;
        let block = self.blocks.get(at).ok_or(CorruptState::Invalid)?;
        if block.dimension != self.dimension || block.traces.is_empty() {
            return Err(CorruptState::Invalid);
        }
        for (row, trace) in block.traces.iter().enumerate() {
            let slot = next_slot(self.len, usize::MAX).ok_or(CorruptState::Invalid)?;
            if self.slots.get(trace.place.0 as usize).is_some() {
                return Err(CorruptState::Invalid);
            }
            self.slots.insert(trace.place.0 as usize, slot, 0);
            let sketch = self.sketcher.sketch(block.sum(row));
            self.sketches.set(slot as usize, sketch);
            self.len += 1;
        }
        Ok(())
    }

    /// The slot of a place's trace.
    fn slot_of(&self, place: PlaceId) -> Option<usize> {
        self.slots.get(place.0 as usize).map(|&slot| slot as usize)
    }

    /// Where a place's trace lies.
    fn row_of(&self, place: PlaceId) -> Option<(&Block, usize)> {
        let slot = self.slot_of(place)?;
        let rows = rows_per_block(self.dimension);
        Some((self.blocks.get(slot / rows)?, slot % rows))
    }
}

impl Block {
    /// An empty block.
    fn new(dimension: usize) -> Self {
        Self {
            dimension,
            traces: Vec::new(),
            sums: Vec::new(),
            scales: Vec::new(),
        }
    }

    /// Appends a trace that nothing has taught yet.
    fn push(&mut self, place: PlaceId) {
        self.traces.push(DescriptorTrace {
            place,
            count: 0,
            weight: 0.0,
            last_stamp_ns: i64::MIN,
        });
        if self.sums.is_empty() {
            // What doubling would reserve beyond a full block is never used.
            self.sums
                .reserve_exact(rows_per_block(self.dimension) * self.dimension);
        }
        self.sums.resize(self.sums.len() + self.dimension, 0.0);
        self.scales.push(0.0);
    }

    /// Removes the last trace and its sum.
    fn pop(&mut self) -> Option<(DescriptorTrace, Vec<f32>)> {
        let trace = self.traces.pop()?;
        self.scales.pop();
        let sum = self.sums.split_off(self.sums.len() - self.dimension);
        Some((trace, sum))
    }

    /// Puts a trace and its sum into a row, in the place of what is there.
    fn replace(&mut self, row: usize, trace: DescriptorTrace, sum: &[f32]) {
        self.traces[row] = trace;
        self.sums[row * self.dimension..][..self.dimension].copy_from_slice(sum);
        self.scales[row] = scale(sum);
    }

    /// Adds a descriptor to a sum.
    fn strengthen(&mut self, row: usize, seen: &Seen<'_>) {
        let trace = &mut self.traces[row];
        trace.count += 1;
        trace.weight += seen.weight;
        // The clocks of two agents may differ, so a later one may carry an earlier stamp.
        trace.last_stamp_ns = trace.last_stamp_ns.max(seen.stamp_ns);
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a confidence needs no more digits"
        )]
        let weight = seen.weight as f32;
        let sum = &mut self.sums[row * self.dimension..][..self.dimension];
        for (sum, x) in sum.iter_mut().zip(seen.vector) {
            *sum += weight * x;
        }
        self.scales[row] = scale(sum);
    }

    /// The sum in a row.
    fn sum(&self, row: usize) -> &[f32] {
        &self.sums[row * self.dimension..][..self.dimension]
    }

    /// Cosine of a unit vector and a row.
    fn cosine(&self, row: usize, vector: &[f32]) -> f64 {
        cosine(dot(self.sum(row), vector), self.scales[row])
    }
}

impl State for Block {
    fn write(&self, out: &mut StateWriter) {
        let small = |len: usize| u16::try_from(len).expect("a block has 4096 numbers at most");
        small(self.dimension).write(out);
        small(self.traces.len()).write(out);
        for (trace, sum) in self
            .traces
            .iter()
            .zip(self.sums.chunks_exact(self.dimension))
        {
            trace.write(out);
            for x in sum {
                x.write(out);
            }
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let dimension = usize::from(u16::read(input)?);
        let rows = usize::from(u16::read(input)?);
        if !(DIMENSION_MIN..=BLOCK_LEN).contains(&dimension) || rows > rows_per_block(dimension) {
            return Err(CorruptState::Invalid);
        }
        let mut block = Self::new(dimension);
        for _ in 0..rows {
            block.traces.push(State::read(input)?);
            let start = block.sums.len();
            for _ in 0..dimension {
                block.sums.push(f32::read(input)?);
            }
            block.scales.push(scale(&block.sums[start..]));
        }
        Ok(block)
    }
}

/// The slot after `len` others, if there may be one.
fn next_slot(len: usize, slots_max: usize) -> Option<u32> {
    let slot = u32::try_from(len).ok();
    slot.filter(|_| len < slots_max)
}

/// Traces that fit a block.
fn rows_per_block(dimension: usize) -> usize {
    (BLOCK_LEN / dimension).max(1)
}

/// One over the length of a vector; 0 for the zero vector.
fn scale(vector: &[f32]) -> f32 {
    let length = dot(vector, vector).sqrt();
    if length > 0.0 { length.recip() } else { 0.0 }
}

/// The cosine, from the scalar product with a sum and one over the sum's length.
fn cosine(product: f32, scale: f32) -> f64 {
    f64::from(product * scale).clamp(-1.0, 1.0)
}
