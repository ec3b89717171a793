//! Block grid: numbers of the cells of a box, most of which have none, in little memory.

/// No number.
pub(crate) const NONE: u16 = u16::MAX;

/// Cells of a block along each axis, as powers of two: the numbers of a block fill a cache line.
const EDGES: [u32; 3] = [2, 2, 1];
/// Cells of a block, and the same as a power of two.
const CELLS: usize = 1 << CELLS_LOG;
const CELLS_LOG: u32 = EDGES[0] + EDGES[1] + EDGES[2];

/// The numbers of a block.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Block([u16; CELLS]);

/// A two-level grid: numbers by cell, block by block, so that neighbours are mostly in one block.
/// All blocks without a number share one, since a surface passes through few blocks of its box, and
/// the rest stays in the processor's caches.
#[derive(Clone, Debug)]
pub(crate) struct BlockGrid {
    /// Index of each block in `blocks`.
    kept: Vec<u16>,
    /// The empty block, then those that hold a number.
    blocks: Vec<Block>,
}

impl BlockGrid {
    /// Blocks along each axis of a box of `cells`.
    pub(crate) fn along(cells: [u32; 3]) -> [u32; 3] {
        std::array::from_fn(|axis| cells[axis].div_ceil(1 << EDGES[axis]))
    }

    /// Cells of so many blocks.
    pub(crate) fn cells(blocks: [u32; 3]) -> usize {
        blocks
            .iter()
            .map(|along| *along as usize)
            .product::<usize>()
            * CELLS
    }

    /// Of the numbers of all cells, in the order of [`cell`]; at most 65,535 blocks.
    pub(crate) fn new(numbers: &[u16]) -> Self {
        let (all, _) = numbers.as_chunks::<CELLS>();
        let mut blocks = vec![Block([NONE; CELLS])];
        let mut kept = Vec::with_capacity(all.len());
        for numbers in all {
            let is_empty = numbers.iter().all(|number| *number == NONE);
            let next = u16::try_from(blocks.len()).unwrap_or(0);
            kept.push(if is_empty { 0 } else { next });
            if !is_empty {
                blocks.push(Block(*numbers));
            }
        }
        blocks.shrink_to_fit();
        Self { kept, blocks }
    }

    /// Replaces each cell by its number.
    pub(crate) fn read(&self, cells: &mut [u32]) {
        if cells.len() > self.blocks.len() {
            // A sequential pass prefetches all blocks sooner than single misses would.
            let all = self.blocks.iter().fold(0, |all, block| all | block.0[0]);
            std::hint::black_box(all);
        }
        for cell in cells {
            let (block, within) = (*cell as usize / CELLS, *cell as usize % CELLS);
            let block = usize::from(self.kept[block]);
            *cell = self.blocks[block].0[within].into();
        }
    }
}

/// Index of a cell by its indices along each axis; `rows` and `columns` are the blocks along the
/// second and the third.
#[expect(
    clippy::inline_always,
    reason = "inlined into dispatched closures: compiled for their vectors"
)]
#[inline(always)]
pub(crate) fn cell([i, j, k]: [u32; 3], [rows, columns]: [u32; 2]) -> u32 {
    let [a, b, c] = EDGES;
    let within = |at: u32, power: u32| at & ((1 << power) - 1);
    let block = ((i >> a) * rows + (j >> b)) * columns + (k >> c);
    block << CELLS_LOG | within(i, a) << (b + c) | within(j, b) << c | within(k, c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_has_the_number_that_was_put_there() {
        let along = BlockGrid::along([5, 9, 6]);
        assert_eq!(along, [2, 3, 3]);
        let mut numbers = vec![NONE; BlockGrid::cells(along)];
        let count = u32::try_from(numbers.len()).unwrap();
        // Most blocks hold nothing, and one a single number.
        numbers[CELLS] = 7;
        for (number, own) in (0..).zip(&mut numbers[4 * CELLS..6 * CELLS]) {
            *own = number;
        }
        let blocks = BlockGrid::new(&numbers);
        assert_eq!(blocks.blocks.len(), 1 + 3);
        let expected: Vec<u32> = numbers.iter().map(|number| u32::from(*number)).collect();
        let mut all: Vec<u32> = (0..count).collect();
        blocks.read(&mut all);
        assert_eq!(all, expected);
        let mut few = [32, 3, count - 1];
        blocks.read(&mut few);
        assert_eq!(few, [7, NONE.into(), NONE.into()]);
    }

    #[test]
    fn every_cell_of_a_box_has_a_place_of_its_own() {
        let along = BlockGrid::along([5, 9, 6]);
        let [a, b, c]: [u32; 3] = std::array::from_fn(|axis| along[axis] << EDGES[axis]);
        let mut cells = Vec::new();
        for i in 0..a {
            for j in 0..b {
                cells.extend((0..c).map(|k| cell([i, j, k], [along[1], along[2]])));
            }
        }
        cells.sort_unstable();
        let count = u32::try_from(BlockGrid::cells(along)).unwrap();
        assert!(cells.into_iter().eq(0..count));
    }
}
