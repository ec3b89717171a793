//! Tiles of cells: where a cell is, and sums over the cells about each.

use std::sync::LazyLock;

use state::PagedVec;

use super::index::{Key, KeyIndex};
use crate::tuning::cells as tuning;

/// Cells along the side of a tile.
const EDGE: usize = 8;
/// The same.
const SIDE: i32 = 8;
/// Cells about a tile that count for it, along each side.
const RIM: usize = tuning::REACH as usize;
/// Cells along the side of a tile and its rim.
const PATCH: usize = EDGE + 2 * RIM;
/// No cell.
const NONE: u32 = u32::MAX;

/// Cells by their offsets from one, at most those of the rim away, and the weight of each.
type Kernel = Vec<([i32; 2], f32)>;

/// The cells that count for one.
pub(super) static KERNEL: LazyLock<Kernel> = LazyLock::new(|| {
    let reach = tuning::REACH;
    let offsets = (-reach..=reach).flat_map(|x| (-reach..=reach).map(move |y| [x, y]));
    let near = offsets.filter_map(|[x, y]| {
        let squared = x * x + y * y;
        let width = tuning::SIDE_M / tuning::KERNEL_M;
        #[expect(clippy::cast_possible_truncation, reason = "1 at most")]
        let weight = (-0.5 * f64::from(squared) * width * width).exp() as f32;
        (squared <= reach * reach).then_some(([x, y], weight))
    });
    near.collect()
});

/// A cell and those beside it.
pub(super) static BESIDE: LazyLock<Kernel> = LazyLock::new(|| {
    let offsets = (-1..=1).flat_map(|x| (-1..=1).map(move |y| [x, y]));
    offsets.map(|offset| (offset, 1.0)).collect()
});

/// A square of cells of one layer.
#[derive(Clone, Debug)]
struct Tile {
    channel: u8,
    /// The key of its first cell, per side of a tile along the layer.
    key: Key,
    /// Numbers of its cells, row by row.
    cells: [[u32; EDGE]; EDGE],
}

/// The cells of all channels by tiles.
#[derive(Clone, Debug, Default)]
pub(super) struct Tiles {
    all: PagedVec<Tile, 8>,
    index: KeyIndex,
}

/// Values of a tile and its rim; zero where there is no cell.
type Patch = [[f32; PATCH]; PATCH];

/// The key of the tile of a cell, and its row and column there.
fn place(key: Key) -> (Key, [usize; 2]) {
    let within = [key[0], key[1]].map(|at| at.rem_euclid(SIDE).unsigned_abs() as usize);
    let [x, y] = [key[0], key[1]].map(|at| at.div_euclid(SIDE));
    ([x, y, key[2]], within)
}

impl Tiles {
    /// The number of the cell of a channel at a key.
    pub(super) fn find(&self, channel: u8, key: Key) -> Option<u32> {
        let (key, [row, column]) = place(key);
        let number = self.tile(channel, key)?.cells[row][column];
        (number != NONE).then_some(number)
    }

    /// Inserts a cell that is not here.
    pub(super) fn insert(&mut self, cell: u32, channel: u8, key: Key, revision: u64) {
        let (key, [row, column]) = place(key);
        let known = self.number(channel, key);
        let number = known.unwrap_or_else(|| {
            let number = u32::try_from(self.all.len()).unwrap_or(NONE);
            let cells = [[NONE; EDGE]; EDGE];
            let tile = Tile {
                channel,
                key,
                cells,
            };
            self.all.push(tile, revision);
            let all = &self.all;
            self.index
                .insert(number, channel, key, |of| place_of(all, of));
            number
        });
        if let Some(tile) = self.all.get_mut(number as usize, revision) {
            tile.cells[row][column] = cell;
        }
    }

    /// Sums of values over the cells about each cell of a channel, weighted by a kernel. Values and
    /// sums are by the number of the cell.
    pub(super) fn sums<const N: usize>(
        &self,
        channel: u8,
        kernel: &Kernel,
        values: &[[f32; N]],
    ) -> Vec<[f32; N]> {
        let mut sums = vec![[0.0; N]; values.len()];
        let mut patches = [[[0.0; PATCH]; PATCH]; N];
        for tile in self.all.iter().filter(|tile| tile.channel == channel) {
            self.read(tile, values, &mut patches);
            let tile_sums = patches.each_ref().map(|patch| stencil(patch, kernel));
            for (row, cells) in tile.cells.iter().enumerate() {
                for (column, cell) in cells.iter().enumerate().filter(|(_, cell)| **cell != NONE) {
                    sums[*cell as usize] = std::array::from_fn(|k| tile_sums[k][row][column]);
                }
            }
        }
        sums
    }

    /// Reads the values of a tile and its rim.
    fn read<const N: usize>(&self, tile: &Tile, values: &[[f32; N]], patches: &mut [Patch; N]) {
        *patches = [[[0.0; PATCH]; PATCH]; N];
        let [x, y, z] = tile.key;
        for (i, j) in (0..3_u8).flat_map(|i| (0..3_u8).map(move |j| (i, j))) {
            let key = [x + i32::from(i) - 1, y + i32::from(j) - 1, z];
            let Some(beside) = self.tile(tile.channel, key) else {
                continue;
            };
            // Where the first cell of that tile is in the patch, plus a tile: never negative.
            let [down, across] = [i, j].map(|at| usize::from(at) * EDGE + RIM);
            for (row, cells) in (down..).zip(&beside.cells) {
                let Some(row) = row.checked_sub(EDGE).filter(|row| *row < PATCH) else {
                    continue;
                };
                for (column, cell) in (across..).zip(cells) {
                    let column = column.checked_sub(EDGE).filter(|column| *column < PATCH);
                    let value = values.get(*cell as usize).zip(column);
                    for (patch, k) in patches.iter_mut().zip(0..) {
                        if let Some((value, column)) = value {
                            patch[row][column] = value[k];
                        }
                    }
                }
            }
        }
    }

    fn tile(&self, channel: u8, key: Key) -> Option<&Tile> {
        self.all.get(self.number(channel, key)? as usize)
    }

    fn number(&self, channel: u8, key: Key) -> Option<u32> {
        self.index.find(channel, key, |of| place_of(&self.all, of))
    }

    /// Bytes of memory that they take.
    pub(super) fn bytes(&self) -> usize {
        self.all.bytes() + self.index.bytes()
    }
}

/// The channel and key of a numbered tile.
fn place_of(all: &PagedVec<Tile, 8>, number: u32) -> Option<(u8, Key)> {
    let tile = all.get(number as usize)?;
    Some((tile.channel, tile.key))
}

/// Sums over the values about each of a tile, weighted by a kernel.
fn stencil(patch: &Patch, kernel: &Kernel) -> [[f32; EDGE]; EDGE] {
    let mut sums = [[0.0; EDGE]; EDGE];
    simd::dispatch(
        #[inline(always)]
        || {
            for (first, sums) in sums.iter_mut().enumerate() {
                let mut row = [0.0; EDGE];
                for ([x, y], weight) in kernel {
                    let [down, across] =
                        [x, y].map(|by| (by + tuning::REACH).unsigned_abs() as usize);
                    let values = patch[first + down][across..].first_chunk::<EDGE>();
                    for (sum, value) in row.iter_mut().zip(values.into_iter().flatten()) {
                        *sum += weight * value;
                    }
                }
                *sums = row;
            }
        },
    );
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_over_the_cells_of_the_channel_and_layer_that_are_near() {
        let noise = |k: u64| random::uniform(3, [0, 0, k]);
        let mut tiles = Tiles::default();
        let mut keys: Vec<(u8, Key)> = Vec::new();
        #[expect(clippy::cast_possible_truncation, reason = "a few cells")]
        let at = |k: u64, width: f64| ((noise(k) - 0.5) * width) as i32;
        for k in 0..900 {
            let key = [at(4 * k, 40.0), at(4 * k + 1, 40.0), at(4 * k + 2, 3.9)];
            let own = (u8::from(noise(4 * k + 3) < 0.3), key);
            if !keys.contains(&own) {
                tiles.insert(u32::try_from(keys.len()).unwrap(), own.0, key, 1);
                keys.push(own);
            }
        }
        for (number, (channel, key)) in (0..).zip(&keys) {
            assert_eq!(tiles.find(*channel, *key), Some(number));
        }
        assert_eq!(tiles.find(2, keys[0].1), None);
        let count = u64::try_from(keys.len()).unwrap();
        #[expect(clippy::cast_possible_truncation, reason = "numbers below one")]
        let values: Vec<[f32; 2]> = (5000..5000 + count)
            .map(|k| [noise(k) as f32, noise(2 * k) as f32])
            .collect();
        for channel in [0, 1] {
            let sums = tiles.sums(channel, &KERNEL, &values);
            for ((own, [x, y, z]), sum) in keys.iter().zip(&sums) {
                let near = keys
                    .iter()
                    .zip(&values)
                    .filter_map(|((other, key), value)| {
                        let is_own = *other == channel && *own == channel && key[2] == *z;
                        let offset = [key[0] - x, key[1] - y];
                        let (_, weight) = KERNEL.iter().find(|(at, _)| *at == offset)?;
                        is_own.then(|| value.map(|value| value * weight))
                    });
                let expected = near.fold([0.0; 2], |[a, b], [c, d]| [a + c, b + d]);
                for (sum, expected) in sum.iter().zip(expected) {
                    assert!((sum - expected).abs() < 1e-4, "{sum} {expected}");
                }
            }
        }
    }
}
