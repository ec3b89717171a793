//! Mean views of cells of space, and how alike a view is to what was seen about each.

use nalgebra::{Point3, Vector3};
use state::{Counted, PagedVec, state_of_struct};

use super::index::{CellIndex, Key};
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
    /// The cells with views about each, and their weights by the kernel; derived.
    near: PagedVec<Vec<(u32, f32)>, 64>,
    /// The cells by channel and key; derived.
    index: CellIndex,
}

/// Tells the channel and key of a numbered cell.
fn place_in(cells: &PagedVec<Cell, 16>) -> impl Fn(u32) -> Option<(u8, Key)> + '_ {
    move |number| {
        let cell = cells.get(number as usize)?;
        Some((cell.channel, cell.key))
    }
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
        let is_first = cell.sum.is_empty();
        if is_first {
            cell.sum = vec![0.0; vector.len()].into();
        }
        for (sum, number) in cell.sum.iter_mut().zip(vector) {
            *sum += weight * number;
        }
        cell.weight += weight;
        cell.height_m += (height_m - cell.height_m) * weight / cell.weight;
        cell.length = dot(&cell.sum, &cell.sum).sqrt();
        if is_first {
            for (about, kernel) in self.about(channel, key) {
                if let Some(near) = self.near.get_mut(about as usize, revision) {
                    let at = near.partition_point(|(number, _)| *number < own);
                    near.insert(at, (own, kernel));
                }
            }
        }
    }

    /// Takes a view of a cell into the sums about its neighbours.
    fn grow_about(&mut self, own: u32, vector: &[f32], weight: f32, revision: u64) {
        let Some(cell) = self.all.get(own as usize) else {
            return;
        };
        let about = self.about(cell.channel, cell.key);
        let mut dots: Vec<(u32, f32)> = Vec::new();
        for (other, kernel) in about {
            let near = self.near.get(other as usize);
            let mut along = 0.0;
            for &(number, share) in near.into_iter().flatten() {
                let known = dots.iter().find(|(known, _)| *known == number).copied();
                let (_, product) = known.unwrap_or_else(|| {
                    let sum = self.all.get(number as usize).map(|cell| &*cell.sum);
                    let sum = sum.filter(|sum| !sum.is_empty());
                    let product = (number, sum.map_or(0.0, |sum| dot(sum, vector)));
                    dots.push(product);
                    product
                });
                along += share * product;
            }
            let step = weight * kernel;
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
        let near = self.near_of(channel, key);
        let first = near
            .first()
            .and_then(|(first, _)| self.all.get(*first as usize));
        let mut mean = vec![0.0; first.map_or(0, |cell| cell.sum.len())];
        let mut about_weight = 0.0;
        for (other, kernel) in &near {
            let Some(cell) = self.all.get(*other as usize) else {
                continue;
            };
            about_weight += kernel * cell.weight;
            for (mean, number) in mean.iter_mut().zip(&cell.sum) {
                *mean += kernel * number;
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
        self.near.push(near, revision);
        self.index.insert(number, channel, key, place_in(&self.all));
        Some(number)
    }

    /// The number of the cell of a channel at a key.
    pub(super) fn find(&self, channel: u8, key: Key) -> Option<u32> {
        self.index.find(channel, key, place_in(&self.all))
    }

    pub(super) fn get(&self, number: u32) -> Option<&Cell> {
        self.all.get(number as usize)
    }

    /// The cells about a key, with their weights by the kernel.
    fn about(&self, channel: u8, key: Key) -> Vec<(u32, f32)> {
        let reach = tuning::REACH;
        let offsets = (-reach..=reach).flat_map(|x| (-reach..=reach).map(move |y| (x, y)));
        let found = offsets.filter_map(|(x, y)| {
            let kernel = kernel(x * x + y * y)?;
            let number = self.find(channel, [key[0] + x, key[1] + y, key[2]])?;
            Some((number, kernel))
        });
        found.collect()
    }

    /// Those of them that have views, by number: sums have one order, whoever derives them.
    fn near_of(&self, channel: u8, key: Key) -> Vec<(u32, f32)> {
        let mut about = self.about(channel, key);
        about.retain(|(number, _)| self.get(*number).is_some_and(|cell| !cell.sum.is_empty()));
        about.sort_unstable_by_key(|(number, _)| *number);
        about
    }

    /// How alike a view is to what was seen about each cell of its channel.
    pub(super) fn alike(&self, channel: u8, vector: &[f32]) -> Vec<Alike> {
        let mut products = vec![[0.0; 2]; self.all.len()];
        simd::dispatch(
            #[inline(always)]
            || {
                for (product, cell) in products.iter_mut().zip(self.all.iter()) {
                    if cell.channel == channel && cell.sum.len() == vector.len() {
                        product[0] = dot_inline(&cell.sum, vector);
                    }
                }
            },
        );
        for ([product, density], cell) in products.iter_mut().zip(self.all.iter()) {
            if cell.channel == channel && cell.sum.len() == vector.len() {
                let cosine = *product / cell.length.max(f32::MIN_POSITIVE);
                *density = cell.weight * (tuning::SHARPNESS * (cosine - 1.0)).exp();
            }
        }
        let pairs = (0_u32..).zip(self.all.iter()).zip(self.near.iter());
        let own = pairs.filter(|((_, cell), _)| cell.channel == channel);
        own.map(|((number, cell), near)| {
            let [product, density] = weighted_sums(near, &products);
            let length = cell.about_squared.max(f32::MIN_POSITIVE).sqrt();
            let open = cell.about_weight + tuning::OPEN;
            let features = [product / length, ((density + tuning::LEAST) / open).ln()];
            Alike {
                cell: number,
                features,
            }
        })
        .collect()
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
        self.index = CellIndex::default();
        self.near = PagedVec::default();
        for number in 0..self.all.len() {
            if let (Some(cell), Ok(at)) = (self.all.get(number), u32::try_from(number)) {
                let (channel, key) = (cell.channel, cell.key);
                self.index.insert(at, channel, key, place_in(&self.all));
            }
        }
        for number in 0..self.all.len() {
            let near = self.all.get(number);
            let near = near.map_or_else(Vec::new, |cell| self.near_of(cell.channel, cell.key));
            self.near.push(near, revision);
        }
    }

    /// Bytes of memory that they take.
    pub(super) fn bytes(&self) -> usize {
        let numbers: usize = self.all.iter().map(|cell| cell.sum.len()).sum();
        let near: usize = self.near.iter().map(Vec::len).sum();
        self.all.bytes() + self.near.bytes() + 4 * numbers + 8 * near + self.index.bytes()
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
pub(super) fn beside(key: Key) -> impl Iterator<Item = Key> {
    let offsets = (-1..=1).flat_map(|x| (-1..=1).map(move |y| (x, y)));
    let offsets = offsets.filter(|offset| *offset != (0, 0));
    offsets.map(move |(x, y)| [key[0] + x, key[1] + y, key[2]])
}

/// Sums over the cells about one, weighted by the kernel: four side by side, since each sum has an
/// order of additions that it has to keep.
fn weighted_sums(near: &[(u32, f32)], all: &[[f32; 2]]) -> [f32; 2] {
    let mut sums = [[0.0; 2]; 4];
    let (fours, rest) = near.as_chunks::<4>();
    for near in fours.iter().map(|four| &four[..]).chain([rest]) {
        for (sum, &(number, kernel)) in sums.iter_mut().zip(near) {
            let own = &all[number as usize];
            sum[0] += kernel * own[0];
            sum[1] += kernel * own[1];
        }
    }
    let [a, b, c, d] = sums;
    [0, 1].map(|k| (a[k] + b[k]) + (c[k] + d[k]))
}

/// Weight of a cell so many squared sides away; `None` beyond the reach.
fn kernel(squared: i32) -> Option<f32> {
    let reach = tuning::REACH;
    #[expect(clippy::cast_possible_truncation, reason = "1 at most")]
    let weight =
        (-0.5 * f64::from(squared) * (tuning::SIDE_M / tuning::KERNEL_M).powi(2)).exp() as f32;
    (squared <= reach * reach).then_some(weight)
}
