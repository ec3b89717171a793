//! Numbers of the cells of a box, most of which hold none, in little memory.

/// No number.
pub(super) const NONE: u16 = u16::MAX;

/// Cells of a brick along each axis, as powers of two: the numbers of a brick fill a line of a processor's cache.
const EDGES: [u32; 3] = [2, 2, 1];
/// Cells of a brick, and the same as a power of two.
const CELLS: usize = 1 << CELLS_LOG;
const CELLS_LOG: u32 = EDGES[0] + EDGES[1] + EDGES[2];

/// The numbers of a brick.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Brick([u16; CELLS]);

/// Numbers by cell, brick by brick: neighbours are mostly in one. All bricks without a number are the same one, since a surface goes through
/// few of its box: what is left comes from memory sooner, and stays in the processor's caches.
#[derive(Clone, Debug)]
pub(super) struct Bricks {
    /// Which of those that are kept each brick is.
    kept: Vec<u16>,
    /// The empty one, and those that hold a number.
    bricks: Vec<Brick>,
}

impl Bricks {
    /// Bricks of a box of so many cells along each axis.
    pub(super) fn along(cells: [u32; 3]) -> [u32; 3] {
        std::array::from_fn(|axis| cells[axis].div_ceil(1 << EDGES[axis]))
    }

    /// Cells of so many bricks.
    pub(super) fn cells(bricks: [u32; 3]) -> usize {
        bricks
            .iter()
            .map(|along| *along as usize)
            .product::<usize>()
            * CELLS
    }

    /// Of the numbers of the cells of whole bricks, in the order of [`cell`]; of 65,535 bricks at most.
    pub(super) fn new(numbers: &[u16]) -> Self {
        let (all, _) = numbers.as_chunks::<CELLS>();
        let mut bricks = vec![Brick([NONE; CELLS])];
        let mut kept = Vec::with_capacity(all.len());
        for numbers in all {
            let is_empty = numbers.iter().all(|number| *number == NONE);
            let next = u16::try_from(bricks.len()).unwrap_or(0);
            kept.push(if is_empty { 0 } else { next });
            if !is_empty {
                bricks.push(Brick(*numbers));
            }
        }
        bricks.shrink_to_fit();
        Self { kept, bricks }
    }

    /// Puts its number in place of each cell.
    pub(super) fn read(&self, cells: &mut [u32]) {
        if cells.len() > self.bricks.len() {
            // All bricks in a row come from memory sooner than those that are needed do one by one.
            let all = self.bricks.iter().fold(0, |all, brick| all | brick.0[0]);
            std::hint::black_box(all);
        }
        for cell in cells {
            let (brick, within) = (*cell as usize / CELLS, *cell as usize % CELLS);
            let brick = usize::from(self.kept[brick]);
            *cell = self.bricks[brick].0[within].into();
        }
    }
}

/// The number of a cell by its place along each axis, where there are so many bricks along the second and the third.
#[expect(
    clippy::inline_always,
    reason = "only what is inlined into a dispatched closure is compiled for the vectors that it chose"
)]
#[inline(always)]
pub(super) fn cell([i, j, k]: [u32; 3], [rows, columns]: [u32; 2]) -> u32 {
    let [a, b, c] = EDGES;
    let within = |at: u32, power: u32| at & ((1 << power) - 1);
    let brick = ((i >> a) * rows + (j >> b)) * columns + (k >> c);
    brick << CELLS_LOG | within(i, a) << (b + c) | within(j, b) << c | within(k, c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cell_has_the_number_that_was_put_there() {
        let along = Bricks::along([5, 9, 6]);
        assert_eq!(along, [2, 3, 3]);
        let mut numbers = vec![NONE; Bricks::cells(along)];
        let count = u32::try_from(numbers.len()).unwrap();
        // Most bricks hold nothing, and one a single number.
        numbers[CELLS] = 7;
        for (number, own) in (0..).zip(&mut numbers[4 * CELLS..6 * CELLS]) {
            *own = number;
        }
        let bricks = Bricks::new(&numbers);
        assert_eq!(bricks.bricks.len(), 1 + 3);
        let expected: Vec<u32> = numbers.iter().map(|number| u32::from(*number)).collect();
        let mut all: Vec<u32> = (0..count).collect();
        bricks.read(&mut all);
        assert_eq!(all, expected);
        let mut few = [32, 3, count - 1];
        bricks.read(&mut few);
        assert_eq!(few, [7, NONE.into(), NONE.into()]);
    }

    #[test]
    fn every_cell_of_a_box_has_a_place_of_its_own() {
        let along = Bricks::along([5, 9, 6]);
        let [a, b, c]: [u32; 3] = std::array::from_fn(|axis| along[axis] << EDGES[axis]);
        let mut cells = Vec::new();
        for i in 0..a {
            for j in 0..b {
                cells.extend((0..c).map(|k| cell([i, j, k], [along[1], along[2]])));
            }
        }
        cells.sort_unstable();
        let count = u32::try_from(Bricks::cells(along)).unwrap();
        assert!(cells.into_iter().eq(0..count));
    }
}
