//! Where to look for places near a point: cells of equal edge, hashed into shards.

use crate::memory::ids::PlaceId;
use std::sync::Arc;

use nalgebra::Point3;

/// Bits of the number of shards at first, how many more each split adds, and at most. The first
/// change after a snapshot copies the list of shards, and the first change of each shard the
/// entries of that one, which is one in 4096 of a large index; a small index with as many shards
/// would take more memory than its places.
const SHARD_BITS_MIN: u32 = 6;
const SHARD_BITS_STEP: u32 = 3;
const SHARD_BITS_MAX: u32 = 12;
/// Places per shard at which it is worth having more of them, counted in the larger number.
const PLACES_PER_SHARD: usize = 4;
/// 64-bit words of a shard's occupancy bits.
const OCCUPIED_WORDS: usize = 4;
/// Lowest bits of a tag: which of the cells of a block.
const BLOCK_BITS: u32 = 3;
/// A search over more cells than this along any axis is left to a scan.
const CELLS_PER_AXIS_MAX: i64 = 8;

/// Index of a cell along x, y, z.
type Cell = [i64; 3];

/// A place in a cell.
///
/// The position is rounded, and tells which places need not be looked at: most of the time of a
/// search goes into waiting for memory, and the places themselves lie all over it.
#[derive(Clone, Copy, Debug)]
struct Entry {
    /// Which of the cells in the shard, almost surely: bits of the cell's hash.
    tag: u32,
    place: PlaceId,
    near: [f32; 3],
}

/// Places by the cells that they lie in.
#[derive(Clone, Debug, Default)]
struct Shard {
    /// A bit for each of some classes of blocks, set where one of them holds a place. Most blocks
    /// beside a way are empty, and to find that out among the entries takes several times as long.
    occupied: [u64; OCCUPIED_WORDS],
    /// Sorted by tag and place, so the places of one cell lie side by side.
    entries: Arc<Vec<Entry>>,
}

/// The cells that hold places. A clone shares everything until one of both changes.
#[derive(Clone, Debug)]
pub(super) struct SpatialIndex {
    cell_edge_m: f64,
    /// 2^bits of them.
    shards: Arc<Vec<Shard>>,
    shard_bits: u32,
    places: usize,
    /// Least and largest coordinates of all positions so far: none lies farther out, whatever was
    /// removed.
    bounds: [[f64; 3]; 2],
}

impl SpatialIndex {
    /// An empty index. Searches are cheapest for distances up to `cell_edge_m`.
    pub(super) fn new(cell_edge_m: f64) -> Self {
        Self {
            cell_edge_m,
            shards: Arc::new(vec![Shard::default(); 1 << SHARD_BITS_MIN]),
            shard_bits: SHARD_BITS_MIN,
            places: 0,
            bounds: [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]],
        }
    }

    /// Adds a place.
    pub(super) fn insert(&mut self, place: PlaceId, position: &Point3<f64>) {
        self.places += 1;
        for (axis, x) in position.iter().enumerate() {
            self.bounds[0][axis] = self.bounds[0][axis].min(*x);
            self.bounds[1][axis] = self.bounds[1][axis].max(*x);
        }
        if self.shard_bits < SHARD_BITS_MAX
            && self.places >= PLACES_PER_SHARD << (self.shard_bits + SHARD_BITS_STEP)
        {
            self.split();
        }
        let (shard, tag) = self.slot(self.cell(position.coords.into()));
        let shard = &mut Arc::make_mut(&mut self.shards)[shard];
        shard.occupy(tag, self.shard_bits);
        let slot =
            { &shard.entries }.partition_point(|entry| (entry.tag, entry.place) < (tag, place));
        let near = rounded(position);
        Arc::make_mut(&mut shard.entries).insert(slot, Entry { tag, place, near });
    }

    /// Removes a place that was added at this position.
    pub(super) fn remove(&mut self, place: PlaceId, position: &Point3<f64>) {
        let (shard, tag) = self.slot(self.cell(position.coords.into()));
        let slot = { &self.shards[shard].entries }
            .binary_search_by_key(&(tag, place), |entry| (entry.tag, entry.place));
        let Ok(slot) = slot else { return };
        self.places -= 1;
        let shard = &mut Arc::make_mut(&mut self.shards)[shard];
        Arc::make_mut(&mut shard.entries).remove(slot);
        shard.recount_occupied(self.shard_bits);
    }

    /// Splits every shard into eight. That happens twice in the life of an index, while it is
    /// small.
    fn split(&mut self) {
        self.shard_bits += SHARD_BITS_STEP;
        let mut shards = vec![Vec::new(); 1 << self.shard_bits];
        for entry in self.shards.iter().flat_map(|shard| shard.entries.iter()) {
            // Shards follow the upper bits of the tag, so the order of the entries stays.
            shards[self.shard_of(entry.tag)].push(*entry);
        }
        let shards = shards.into_iter().map(|entries| {
            let mut shard = Shard {
                entries: Arc::new(entries),
                ..Shard::default()
            };
            shard.recount_occupied(self.shard_bits);
            shard
        });
        self.shards = Arc::new(shards.collect());
    }

    /// Bytes of memory that it takes, reserved ones included.
    pub(super) fn bytes(&self) -> usize {
        let shards = self.shards.iter();
        let entries: usize = shards.map(|shard| shard.entries.capacity()).sum();
        let counts = 2 * size_of::<usize>();
        let shard = size_of::<Shard>() + counts + size_of::<Vec<Entry>>();
        entries * size_of::<Entry>() + self.shards.len() * shard
    }

    /// The cells that a ball touches: lowest and highest index along each axis. None when they are
    /// too many to be worth visiting.
    ///
    /// Rounding keeps the order of numbers, so no place within the ball lies outside these cells.
    fn range(&self, centre: &Point3<f64>, radius_m: f64) -> Option<(Cell, Cell)> {
        let low = self.cell(centre.coords.add_scalar(-radius_m).into());
        let high = self.cell(centre.coords.add_scalar(radius_m).into());
        let few = (0..3).all(|k| high[k].saturating_sub(low[k]) < CELLS_PER_AXIS_MAX);
        few.then_some((low, high))
    }

    /// Calls `visit` with every place that may lie within a distance of `point`, the squared one
    /// given as `limit` \[m²\]; `visit` returns the limit for what is left, which must not grow.
    /// Places somewhat beyond it are visited too, and a place is rarely visited twice. False when
    /// the ball is so large that a scan over all places is simpler; then none was visited.
    pub(super) fn search(
        &self,
        point: &Point3<f64>,
        limit: f64,
        mut visit: impl FnMut(PlaceId) -> f64,
    ) -> bool {
        if self.is_outside(point, limit.sqrt()) {
            return true;
        }
        let Some((low, high)) = self.range(point, limit.sqrt()) else {
            return false;
        };
        let mut limit = limit;
        // Most often the nearest place lies in the point's own cell, and rules the others out. To
        // look at a place costs more than to pass over many entries, so the nearest comes first.
        let own = self.cell(point.coords.into());
        let entries = self.entries(own);
        let first = entries
            .iter()
            .min_by(|a, b| distance_squared(a, point).total_cmp(&distance_squared(b, point)));
        if let Some(first) = first {
            limit = visit(first.place);
        }
        let mut reach = limit.sqrt();
        let mut of_cell = |entries: &[Entry], limit: &mut f64| {
            for entry in entries {
                // Not a number means too far away for this arithmetic, so such places are visited.
                let beyond = is_beyond(entry, point, reach);
                if !beyond && first.is_none_or(|first| first.place != entry.place) {
                    *limit = visit(entry.place);
                    reach = limit.sqrt();
                }
            }
        };
        of_cell(entries, &mut limit);
        // The other cells block by block: one look-up finds the places of a whole block.
        let own_tag = tag(own);
        let edge_m = 2.0 * self.cell_edge_m;
        let [low, high] = [low, high].map(|cell| cell.map(|index| index >> 1));
        for i in low[0]..=high[0] {
            let along_x = outside_squared(i, edge_m, point.x);
            if along_x > limit {
                continue;
            }
            for j in low[1]..=high[1] {
                let along_xy = along_x + outside_squared(j, edge_m, point.y);
                if along_xy > limit {
                    continue;
                }
                for k in low[2]..=high[2] {
                    if along_xy + outside_squared(k, edge_m, point.z) > limit {
                        continue;
                    }
                    let block = self.tagged(tag([i << 1, j << 1, k << 1]), BLOCK_BITS);
                    for entries in block.chunk_by(|a, b| a.tag == b.tag) {
                        if entries[0].tag != own_tag {
                            of_cell(entries, &mut limit);
                        }
                    }
                }
            }
        }
        true
    }

    /// Whether all places are farther from a point than `radius_m`: above and below a floor most
    /// points are. The factor covers the rounding of distances.
    fn is_outside(&self, point: &Point3<f64>, radius_m: f64) -> bool {
        let [low, high] = &self.bounds;
        (0..3).any(|axis| {
            let outside_m = (low[axis] - point[axis]).max(point[axis] - high[axis]);
            outside_m > radius_m * (1.0 + 1e-9)
        })
    }

    /// The entries of a cell, and perhaps those of another one that has the same tag.
    fn entries(&self, cell: Cell) -> &[Entry] {
        self.tagged(tag(cell), 0)
    }

    /// The entries that have a tag but for so many of its lowest bits, which are 0 in `tag`.
    #[inline]
    fn tagged(&self, tag: u32, open_bits: u32) -> &[Entry] {
        let shard = &self.shards[self.shard_of(tag)];
        if !shard.is_occupied(tag, self.shard_bits) {
            return &[];
        }
        shard.tagged(tag, open_bits, self.shard_bits)
    }

    /// The shard of a cell, and its tag there.
    fn slot(&self, cell: Cell) -> (usize, u32) {
        let tag = tag(cell);
        (self.shard_of(tag), tag)
    }

    /// The shard of a tag: its upper bits.
    fn shard_of(&self, tag: u32) -> usize {
        (tag >> (u32::BITS - self.shard_bits)) as usize
    }

    /// The cell of a position. Positions beyond 2⁶³ cells share the outermost ones.
    #[expect(clippy::cast_possible_truncation, reason = "saturates, as documented")]
    fn cell(&self, position: [f64; 3]) -> Cell {
        position.map(|x| {
            // Without SSE4.1 in the build target, `floor` is a library call.
            let x = x / self.cell_edge_m;
            let whole = x as i64;
            whole.saturating_sub(i64::from(whole as f64 > x))
        })
    }
}

impl Shard {
    /// Whether the block of a tag may hold a place; `shard_bits` of it are those of the shard.
    fn is_occupied(&self, tag: u32, shard_bits: u32) -> bool {
        let (word, bit) = class_of(tag, shard_bits);
        self.occupied[word] & bit != 0
    }

    /// The entries that have a tag but for so many of its lowest bits.
    fn tagged(&self, tag: u32, open_bits: u32, shard_bits: u32) -> &[Entry] {
        let rest = &self.entries[first_of(&self.entries, tag, shard_bits)..];
        let is_beyond = |entry: &Entry| entry.tag >> open_bits != tag >> open_bits;
        let end = rest.iter().position(is_beyond);
        &rest[..end.unwrap_or(rest.len())]
    }

    /// The block of a tag holds a place.
    fn occupy(&mut self, tag: u32, shard_bits: u32) {
        let (word, bit) = class_of(tag, shard_bits);
        self.occupied[word] |= bit;
    }

    /// Finds out anew which blocks hold a place.
    fn recount_occupied(&mut self, shard_bits: u32) {
        self.occupied = [0; OCCUPIED_WORDS];
        for entry in self.entries.iter() {
            let (word, bit) = class_of(entry.tag, shard_bits);
            self.occupied[word] |= bit;
        }
    }
}

/// The bit for the block of a tag, with its word: the upper bits that are not those of the shard.
fn class_of(tag: u32, shard_bits: u32) -> (usize, u64) {
    const BITS: u32 = OCCUPIED_WORDS.ilog2() + u64::BITS.ilog2();
    let class = (tag << shard_bits) >> (u32::BITS - BITS);
    ((class / u64::BITS) as usize, 1 << (class % u64::BITS))
}

/// Lower bound of the squared distance along one axis from a coordinate to anything in the cells or
/// blocks of an index \[m²\].
fn outside_squared(index: i64, edge_m: f64, x: f64) -> f64 {
    let low = index as f64 * edge_m;
    let outside = (low - x).max(x - (low + edge_m)).max(0.0);
    // The bounds are rounded, by less than this.
    let slack = 4.0 * f64::EPSILON * (x.abs() + edge_m);
    (outside - slack).max(0.0).powi(2)
}

/// Index of the first entry with a tag, or where it would be.
///
/// Tags are hashes, so the one looked for is near its share of the way; from there the search goes
/// outwards in doubled steps. That touches less memory than halving the whole shard.
fn first_of(shard: &[Entry], tag: u32, shard_bits: u32) -> usize {
    let below = |index: usize| shard[index].tag < tag;
    // The upper bits are those of the shard.
    let share = (shard.len() as u64 * u64::from(tag << shard_bits)) >> u32::BITS;
    let guess = usize::try_from(share).expect("less than a length");
    let (mut low, mut high) = (guess, guess);
    let mut step = 1;
    // Everything before `low` is below the tag, nothing from `high` on is.
    while low > 0 && !below(low - 1) {
        high = low - 1;
        low = low.saturating_sub(step);
        step *= 2;
    }
    let mut step = 1;
    while high < shard.len() && below(high) {
        low = high + 1;
        high = (high + step).min(shard.len());
        step *= 2;
    }
    low + shard[low..high].partition_point(|entry| entry.tag < tag)
}

/// Squared distance between a point and an entry's rounded position \[m²\].
fn distance_squared(entry: &Entry, point: &Point3<f64>) -> f64 {
    let mut squared = 0.0;
    for (near, x) in entry.near.into_iter().zip(point.iter()) {
        let near = f64::from(near);
        squared += (near - x) * (near - x);
    }
    squared
}

/// Whether an entry's place is surely farther from a point than `reach_m`.
fn is_beyond(entry: &Entry, point: &Point3<f64>, reach_m: f64) -> bool {
    let mut slack = 0.0;
    for near in entry.near {
        // A float is rounded by at most 2⁻²⁴ of itself, or by 2⁻¹⁵⁰ near zero.
        slack += f64::from(near.abs()) * f64::from(f32::EPSILON) + f64::from(f32::MIN_POSITIVE);
    }
    distance_squared(entry, point) > (reach_m + slack) * (reach_m + slack)
}

/// A position, rounded.
#[expect(clippy::cast_possible_truncation, reason = "rounds, as documented")]
fn rounded(position: &Point3<f64>) -> [f32; 3] {
    [position.x, position.y, position.z].map(|x| x as f32)
}

/// The tag of a cell: the hash of its block of 2 × 2 × 2 cells, and in the lowest bits which of
/// them it is. Neighbours are thus often side by side in memory, and a ball seldom touches more
/// than one block.
fn tag(cell: Cell) -> u32 {
    // One multiplication per axis, by odd constants of no structure; the upper bits are well mixed.
    let hash = [
        0x9e37_79b9_7f4a_7c15_u64,
        0xc2b2_ae3d_27d4_eb4f,
        0x1656_67b1_9e37_79f9,
    ]
    .into_iter()
    .zip(cell)
    .fold(0u64, |hash, (factor, index)| {
        (hash ^ (index >> 1).cast_unsigned())
            .wrapping_mul(factor)
            .rotate_left(29)
    });
    let block = (hash.wrapping_mul(0x9fb2_1c65_1e98_df25) >> 32) as u32;
    cell.into_iter().fold(block >> BLOCK_BITS, |tag, index| {
        (tag << 1) | u32::from(index & 1 == 1)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use random::Seeded;

    /// Compares what an index answers within a distance with a scan over all places.
    fn compare(index: &SpatialIndex, places: &[Option<Point3<f64>>], at: &Point3<f64>) {
        let limit = 0.5_f64.powi(2);
        let mut found = Vec::new();
        let searched = index.search(at, limit, |place| {
            found.push(place);
            limit
        });
        assert!(searched);
        found.sort_unstable();
        found.dedup();
        let within = |place: &PlaceId| {
            let position = places[place.0 as usize];
            position.is_some_and(|position| (position - at).norm_squared() <= limit)
        };
        assert!(
            { &found }
                .iter()
                .all(|place| places[place.0 as usize].is_some())
        );
        found.retain(within);
        let numbers = 0..u32::try_from(places.len()).unwrap();
        let scanned: Vec<_> = numbers.map(PlaceId).filter(within).collect();
        assert_eq!(found, scanned, "{at}");
    }

    /// The index is split twice while it grows, and then is asked again.
    #[test]
    fn a_large_index_equals_the_scan() {
        const PLACES: usize = 20_000;
        let mut random = Seeded(1);
        let mut somewhere = || {
            let [x, y, z] = [20.0, 20.0, 2.0].map(|half_m| (2.0 * random.uniform() - 1.0) * half_m);
            Point3::new(x, y, z)
        };
        let mut index = SpatialIndex::new(0.5);
        let mut places: Vec<Option<Point3<f64>>> = Vec::new();
        let mut bits = Vec::new();
        while places.len() < PLACES {
            let id = PlaceId(u32::try_from(places.len()).unwrap());
            let at = somewhere();
            index.insert(id, &at);
            places.push(Some(at));
            if bits.last() != Some(&index.shard_bits) {
                bits.push(index.shard_bits);
            }
        }
        assert_eq!(bits, [6, 9, 12]);
        let (before, all) = (index.clone(), places.clone());
        for (number, place) in places.iter_mut().enumerate() {
            let id = PlaceId(u32::try_from(number).unwrap());
            let was = place.unwrap();
            match number % 7 {
                0 => *place = None,
                1 => *place = Some(somewhere()),
                2 => *place = Some(was + nalgebra::Vector3::repeat(0.1)),
                _ => continue,
            }
            index.remove(id, &was);
            if let Some(at) = place {
                index.insert(id, at);
            }
        }
        assert_eq!(index.places, places.iter().flatten().count());
        for number in 0..200 {
            let at = places[number * 97].unwrap_or_else(&mut somewhere);
            compare(&index, &places, &at);
            compare(&index, &places, &somewhere());
            // A snapshot from before answers as it did.
            compare(&before, &all, &at);
        }
    }

    #[test]
    fn a_cell_is_rounded_down() {
        let two = |power: i32| 2.0_f64.powi(power);
        let numbers = [
            0.0,
            0.3,
            1.0,
            1.0_f64.next_down(),
            1.0_f64.next_up(),
            7.5,
            two(52) + 0.5,
            two(53),
            two(63),
            two(63).next_down(),
            two(63).next_up(),
            1e300,
            f64::MIN_POSITIVE,
            f64::INFINITY,
            f64::NAN,
        ];
        for edge_m in [1.0, 0.5, 0.6] {
            let index = SpatialIndex::new(edge_m);
            for x in numbers.into_iter().flat_map(|x| [x, -x]) {
                #[expect(clippy::cast_possible_truncation, reason = "saturates, as cells do")]
                let cell = (x / edge_m).floor() as i64;
                assert_eq!(index.cell([x; 3]), [cell; 3], "{x} by {edge_m}");
            }
        }
    }
}
