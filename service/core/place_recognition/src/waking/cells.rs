//! Mean views of cells of space, and how alike a view is to what was seen about each.

use nalgebra::{Point3, Vector3};
use state::{Counted, PagedVec, state_of_struct};

use super::index::Key;
use super::tiles::{BESIDE, KERNEL, Tiles};
use crate::descriptor::{dot, dot_inline};
use crate::tuning::cells as tuning;

/// What was seen in a cell of space on a channel.
#[derive(Clone, Debug)]
pub(crate) struct Cell {
    pub(super) channel: u8,
    pub(super) key: Key,
    /// Mean height of the body at its views \[m\]; for a cell without any that of its neighbour.
    pub(super) height_m: f32,
    /// Weight of its views.
    weight: f32,
    /// Length of the sum of its views.
    length: f32,
    /// Squared length of the sums of the cells about it, weighted by the kernel.
    about_squared: f32,
    /// Their weight.
    about_weight: f32,
    /// Sum of its views; empty without any.
    sum: Box<[f32]>,
}

state_of_struct!(Cell {
    channel,
    key,
    height_m,
    weight,
    length,
    about_squared,
    about_weight,
    sum as Counted<u16>,
});

/// Cells of all channels. Those beside a cell with views are there, too.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cells {
    pub(crate) all: PagedVec<Cell, 16>,
    /// Where they are; derived.
    tiles: Tiles,
}

/// How alike a view is to what was seen about a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Alike {
    /// The cell.
    pub(super) cell: u32,
    /// Cosine with the mean view about it, and the log density of views like it there.
    pub(super) features: [f32; 2],
}

impl Cells {
    /// Adds a view that was taken at a position.
    pub(super) fn add(
        &mut self,
        channel: u8,
        at: &Point3<f64>,
        (vector, weight): (&[f32], f32),
        revision: u64,
    ) {
        let key = key_of(at);
        #[expect(clippy::cast_possible_truncation, reason = "a height of at most 1e6 m")]
        let height_m = at.z as f32;
        let Some(own) = self.at(channel, key, height_m, revision) else {
            return;
        };
        for beside in beside(key) {
            self.at(channel, beside, height_m, revision);
        }
        self.grow_about(own, vector, weight, revision);
        let Some(cell) = self.all.get_mut(own as usize, revision) else {
            return;
        };
        if cell.sum.is_empty() {
            cell.sum = vec![0.0; vector.len()].into();
        }
        for (sum, number) in cell.sum.iter_mut().zip(vector) {
            *sum += weight * number;
        }
        cell.weight += weight;
        cell.height_m += (height_m - cell.height_m) * weight / cell.weight;
        cell.length = dot(&cell.sum, &cell.sum).sqrt();
    }

    /// Takes a view of a cell into the sums about its neighbours.
    fn grow_about(&mut self, own: u32, vector: &[f32], weight: f32, revision: u64) {
        /// Cells that count for a neighbour, from that of the view, along each side.
        const REACH: i32 = 2 * tuning::REACH;
        const WIDTH: usize = 2 * REACH as usize + 1;
        let Some(cell) = self.all.get(own as usize) else {
            return;
        };
        let (channel, [x, y, z]) = (cell.channel, cell.key);
        let at =
            |[by_x, by_y]: [i32; 2]| [by_x, by_y].map(|by| (by + REACH).unsigned_abs() as usize);
        let mut products = [[0.0; WIDTH]; WIDTH];
        for offset in (-REACH..=REACH).flat_map(|i| (-REACH..=REACH).map(move |j| [i, j])) {
            let [i, j] = offset;
            if i * i + j * j > REACH * REACH {
                continue;
            }
            let number = self.find(channel, [x + i, y + j, z]);
            let cell = number.and_then(|number| self.get(number));
            if let Some(cell) = cell.filter(|cell| cell.sum.len() == vector.len()) {
                let [row, column] = at(offset);
                products[row][column] = dot(&cell.sum, vector);
            }
        }
        for ([i, j], share) in KERNEL.iter() {
            let Some(other) = self.find(channel, [x + i, y + j, z]) else {
                continue;
            };
            let near = KERNEL.iter().map(|([k, l], share)| {
                let [row, column] = at([i + k, j + l]);
                share * products[row][column]
            });
            let along: f32 = near.sum();
            let step = weight * share;
            if let Some(cell) = self.all.get_mut(other as usize, revision) {
                // |m + s u|² = |m|² + 2 s m·u + s², of a unit vector u.
                cell.about_squared += step * (2.0 * along + step);
                cell.about_weight += step;
            }
        }
    }

    /// The cell of a channel at a key; a new one if there is room.
    fn at(&mut self, channel: u8, key: Key, height_m: f32, revision: u64) -> Option<u32> {
        if let Some(known) = self.find(channel, key) {
            return Some(known);
        }
        if self.all.len() >= tuning::CELLS_MAX {
            return None;
        }
        let number = u32::try_from(self.all.len()).ok()?;
        let mut mean = Vec::new();
        let mut about_weight = 0.0;
        for ([x, y], share) in KERNEL.iter() {
            let other = self.find(channel, [key[0] + x, key[1] + y, key[2]]);
            let other = other.and_then(|other| self.get(other));
            let Some(cell) = other.filter(|cell| !cell.sum.is_empty()) else {
                continue;
            };
            about_weight += share * cell.weight;
            mean.resize(cell.sum.len(), 0.0);
            for (mean, number) in mean.iter_mut().zip(&cell.sum) {
                *mean += share * number;
            }
        }
        self.all.push(
            Cell {
                channel,
                key,
                height_m,
                weight: 0.0,
                length: 0.0,
                about_squared: dot(&mean, &mean),
                about_weight,
                sum: Box::default(),
            },
            revision,
        );
        self.tiles.insert(number, channel, key, revision);
        Some(number)
    }

    /// The number of the cell of a channel at a key.
    pub(super) fn find(&self, channel: u8, key: Key) -> Option<u32> {
        self.tiles.find(channel, key)
    }

    pub(super) fn get(&self, number: u32) -> Option<&Cell> {
        self.all.get(number as usize)
    }

    /// How alike a view is to what was seen about each cell of its channel.
    pub(super) fn alike(&self, channel: u8, vector: &[f32]) -> Vec<Alike> {
        let is_seen = |cell: &Cell| cell.channel == channel && cell.sum.len() == vector.len();
        let mut values = vec![[0.0; 2]; self.all.len()];
        simd::dispatch(
            #[inline(always)]
            || {
                for (value, cell) in values.iter_mut().zip(self.all.iter()) {
                    if is_seen(cell) {
                        value[0] = dot_inline(&cell.sum, vector);
                    }
                }
            },
        );
        let seen = self.all.iter().zip(&values).map(|(cell, [product, _])| {
            let cosine = product / cell.length.max(f32::MIN_POSITIVE);
            tuning::SHARPNESS * (cosine - 1.0)
        });
        let mut densities: Vec<f32> = seen.collect();
        simd::exp(&mut densities);
        for ((value, cell), density) in values.iter_mut().zip(self.all.iter()).zip(densities) {
            if is_seen(cell) {
                value[1] = cell.weight * density;
            }
        }
        let sums = self.tiles.sums(channel, &KERNEL, &values);
        let cells = || { self.all.iter().zip(&sums) }.filter(|(cell, _)| cell.channel == channel);
        let shares = cells().map(|(cell, [_, density])| {
            (density + tuning::LEAST) / (cell.about_weight + tuning::OPEN)
        });
        let mut logs: Vec<f32> = shares.collect();
        simd::ln(&mut logs);
        let numbered = { (0..).zip(self.all.iter()) }.filter(|(_, cell)| cell.channel == channel);
        let alike = numbered.zip(cells()).zip(logs);
        alike
            .map(|(((number, _), (cell, [product, _])), log)| {
                let length = cell.about_squared.max(f32::MIN_POSITIVE).sqrt();
                Alike {
                    cell: number,
                    features: [product / length, log],
                }
            })
            .collect()
    }

    /// The cell of a channel in and beside which most weight is, of weights by cell; `None` where
    /// there is none.
    pub(super) fn heaviest(&self, channel: u8, weights: &[[f32; 1]]) -> Option<&Cell> {
        let sums = self.tiles.sums(channel, &BESIDE, weights);
        let cells = self.all.iter().zip(sums);
        let own = cells.filter(|(cell, [sum])| cell.channel == channel && *sum > 0.0);
        let most = own.max_by(|(_, a), (_, b)| a[0].total_cmp(&b[0]));
        most.map(|(cell, _)| cell)
    }

    /// Whether a channel has so many cells.
    pub(super) fn has_at_least(&self, channel: u8, count: usize) -> bool {
        let own = self.all.iter().filter(|cell| cell.channel == channel);
        own.take(count).count() == count
    }

    /// Whether cells are of channels, with as many numbers as a channel has, each once.
    pub(super) fn are_sound(&self, length: impl Fn(u8) -> Option<usize>) -> bool {
        let mut keys: Vec<(u8, Key)> = Vec::with_capacity(self.all.len());
        let mut is_sound = self.all.len() <= tuning::CELLS_MAX;
        for cell in self.all.iter() {
            let length = length(cell.channel);
            let floats = [cell.weight, cell.length, cell.about_squared, cell.height_m];
            is_sound &= length.is_some()
                && (cell.sum.is_empty() || length == Some(cell.sum.len()))
                && floats
                    .iter()
                    .chain(&cell.sum)
                    .all(|number| number.is_finite());
            keys.push((cell.channel, cell.key));
        }
        keys.sort_unstable();
        is_sound && keys.windows(2).all(|pair| pair[0] != pair[1])
    }

    /// Rebuilds what is derived.
    pub(super) fn rebuild(&mut self, revision: u64) {
        self.tiles = Tiles::default();
        for (number, cell) in (0..).zip(self.all.iter()) {
            self.tiles.insert(number, cell.channel, cell.key, revision);
        }
    }

    /// Bytes of memory that they take.
    pub(super) fn bytes(&self) -> usize {
        let numbers: usize = self.all.iter().map(|cell| cell.sum.len()).sum();
        self.all.bytes() + 4 * numbers + self.tiles.bytes()
    }
}

impl Cell {
    /// Middle of the cell, at the height of its views.
    pub(super) fn middle(&self) -> Vector3<f64> {
        let [x, y, _] = self.key.map(|k| f64::from(k) * tuning::SIDE_M);
        Vector3::new(x, y, f64::from(self.height_m))
    }
}

/// The key of the cell with a point.
#[expect(
    clippy::inline_always,
    reason = "compiled for the vectors of a dispatch"
)]
#[inline(always)]
pub(super) fn key_of(at: &Point3<f64>) -> Key {
    #[expect(clippy::cast_possible_truncation, reason = "bounded before")]
    let number = |x: f64| (x / tuning::SIDE_M).round().clamp(-1e9, 1e9) as i32;
    [number(at.x), number(at.y), number(at.z)]
}

/// The keys beside one in its layer.
fn beside(key: Key) -> impl Iterator<Item = Key> {
    let offsets = (-1..=1).flat_map(|x| (-1..=1).map(move |y| (x, y)));
    let offsets = offsets.filter(|offset| *offset != (0, 0));
    offsets.map(move |(x, y)| [key[0] + x, key[1] + y, key[2]])
}
