//! Where to look for places near a point: cells of equal edge, hashed into shards.

use std::sync::Arc;

use nalgebra::Point3;

use super::PlaceId;

/// Number of shards. A place's insertion after a snapshot copies one shard, i.e. one in 4096 entries.
const SHARDS: usize = 4096;
/// A search over more cells than this along any axis is left to a scan.
const CELLS_PER_AXIS_MAX: i64 = 8;

/// Index of a cell along x, y, z.
type Cell = [i64; 3];

/// Places by the cells that they lie in.
type Shard = Arc<Vec<(Cell, PlaceId)>>;

/// The cells that hold places. A clone shares everything until one of both changes.
#[derive(Clone, Debug)]
pub(super) struct SpatialIndex {
    cell_edge_m: f64,
    /// Always 4096; each is sorted, so the places of one cell lie side by side, lowest id first.
    shards: Arc<Vec<Shard>>,
}

impl SpatialIndex {
    /// An empty index. Searches are cheapest for distances up to `cell_edge_m`.
    pub(super) fn new(cell_edge_m: f64) -> Self {
        Self {
            cell_edge_m,
            shards: Arc::new(vec![Arc::default(); SHARDS]),
        }
    }

    /// Adds a place.
    pub(super) fn insert(&mut self, place: PlaceId, position: &Point3<f64>) {
        let cell = self.cell(position.coords.into());
        let shard = &mut Arc::make_mut(&mut self.shards)[shard_of(cell)];
        let shard = Arc::make_mut(shard);
        let slot = shard.partition_point(|entry| *entry < (cell, place));
        shard.insert(slot, (cell, place));
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

    /// The places of all cells that a ball touches, in no particular order. None when those are so
    /// many that a scan over all places is simpler.
    pub(super) fn near(
        &self,
        centre: &Point3<f64>,
        radius_m: f64,
    ) -> Option<impl Iterator<Item = PlaceId>> {
        let (low, high) = self.range(centre, radius_m)?;
        Some(cells(low, high).flat_map(|cell| self.in_cell(cell)))
    }

    /// The place nearest to a point, of those within `reach_m`, with its squared distance \[m²\]; of
    /// equally near ones the lowest id. `reach_m` is at most a few cells' edges.
    pub(super) fn nearest(
        &self,
        point: &Point3<f64>,
        reach_m: f64,
        squared_distance: impl Fn(PlaceId) -> f64,
    ) -> Option<(PlaceId, f64)> {
        let (low, high) = self.range(point, reach_m)?;
        let mut best: Option<(f64, PlaceId)> = None;
        let mut limit = reach_m * reach_m;
        let mut visit = |cell: Cell, limit: &mut f64| {
            for place in self.in_cell(cell) {
                let squared = squared_distance(place);
                let nearer = best.is_none_or(|best| (squared, place) < best);
                if squared <= *limit && nearer {
                    best = Some((squared, place));
                    *limit = squared;
                }
            }
        };
        // Most often the nearest place lies in the point's own cell, and rules the others out.
        let own = self.cell(point.coords.into());
        visit(own, &mut limit);
        for cell in cells(low, high) {
            if cell != own && self.cell_distance_squared(cell, point) <= limit {
                visit(cell, &mut limit);
            }
        }
        best.map(|(squared, place)| (place, squared))
    }

    /// The places in a cell.
    fn in_cell(&self, cell: Cell) -> impl Iterator<Item = PlaceId> {
        let shard = &self.shards[shard_of(cell)];
        let start = shard.partition_point(|(key, _)| *key < cell);
        shard[start..]
            .iter()
            .take_while(move |(key, _)| *key == cell)
            .map(|&(_, place)| place)
    }

    /// The cell of a position. Positions beyond 2⁶³ cells share the outermost ones.
    #[expect(clippy::cast_possible_truncation, reason = "saturates, as documented")]
    fn cell(&self, position: [f64; 3]) -> Cell {
        position.map(|x| (x / self.cell_edge_m).floor() as i64)
    }

    /// Lower bound of the squared distance from a point to anything in a cell \[m²\].
    fn cell_distance_squared(&self, cell: Cell, point: &Point3<f64>) -> f64 {
        let mut sum = 0.0;
        for (index, &x) in cell.into_iter().zip(point.iter()) {
            let low = index as f64 * self.cell_edge_m;
            let outside = (low - x).max(x - (low + self.cell_edge_m)).max(0.0);
            // The cell's bounds are rounded, by less than this.
            let slack = 4.0 * f64::EPSILON * (x.abs() + self.cell_edge_m);
            sum += (outside - slack).max(0.0).powi(2);
        }
        sum
    }
}

/// The cells from `low` to `high` along each axis.
fn cells(low: Cell, high: Cell) -> impl Iterator<Item = Cell> {
    (low[0]..=high[0]).flat_map(move |i| {
        (low[1]..=high[1]).flat_map(move |j| (low[2]..=high[2]).map(move |k| [i, j, k]))
    })
}

/// The shard of a cell.
fn shard_of(cell: Cell) -> usize {
    // One multiplication per axis, by odd constants of no structure; the upper bits are well mixed.
    let hash = [
        0x9e37_79b9_7f4a_7c15_u64,
        0xc2b2_ae3d_27d4_eb4f,
        0x1656_67b1_9e37_79f9,
    ]
    .into_iter()
    .zip(cell)
    .fold(0u64, |hash, (factor, index)| {
        (hash ^ index.cast_unsigned())
            .wrapping_mul(factor)
            .rotate_left(29)
    });
    usize::try_from(hash.wrapping_mul(0x9fb2_1c65_1e98_df25) >> 52).expect("12 bits")
}
