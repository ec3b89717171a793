//! Cell lists: for each cell of a lattice all places whose field reaches into it.

use grid::Lattice;
use nalgebra::{Point3, UnitQuaternion, Vector3};

use crate::index::buckets::Buckets;
use crate::numeric::bounds;
use crate::tuning::LIST_CELLS_MAX;

/// Places by the cell of a face-centred cubic lattice at the model's own scale. One lookup answers,
/// however many places the model has.
#[derive(Clone, Debug)]
pub(crate) struct CellLists {
    lattice: Lattice,
    low: [i64; 3],
    size: [i64; 3],
    places: Buckets<u32>,
}

impl CellLists {
    /// Of places with these positions and reaches \[m\], in cells of about `fineness` mean reaches:
    /// finer cells list fewer places beyond reach, and take more memory.
    pub(crate) fn new(positions: &[Point3<f64>], reaches_m: &[f64], fineness: f64) -> Self {
        let places = positions.iter().zip(reaches_m);
        let ends = places.flat_map(|(position, reach_m)| {
            [-reach_m, *reach_m].map(|reach_m| position.coords.add_scalar(reach_m))
        });
        let (low, high) = bounds(ends);
        let reach_sum_m: f64 = reaches_m.iter().sum();
        let mut spacing_m = (fineness * reach_sum_m / positions.len().max(1) as f64).max(1e-9);
        loop {
            let lattice = Lattice::new(spacing_m, UnitQuaternion::identity());
            let (low, size) = box_of(&lattice, &low, &high);
            if size.iter().map(|&size| size as f64).product::<f64>() <= LIST_CELLS_MAX {
                return Self::filled(lattice, low, size, positions, reaches_m);
            }
            spacing_m *= 1.25;
        }
    }

    fn filled(
        lattice: Lattice,
        low: [i64; 3],
        size: [i64; 3],
        positions: &[Point3<f64>],
        reaches_m: &[f64],
    ) -> Self {
        let count = size.iter().product::<i64>();
        let count = usize::try_from(count).expect("a box has a positive number of cells");
        let mut reached = Vec::new();
        for (place, (position, reach_m)) in (0u32..).zip(positions.iter().zip(reaches_m)) {
            for_each_reached(&lattice, position, *reach_m, |index| {
                if let Some(cell) = cell(low, size, index) {
                    reached.push((cell, place));
                }
            });
        }
        let places = Buckets::new(count, reached.into_iter());
        Self {
            lattice,
            low,
            size,
            places,
        }
    }

    /// All places whose field reaches a point, and some others near it, in ascending order.
    pub(crate) fn near(&self, point: &Point3<f64>) -> &[u32] {
        let turns = self.lattice.phase_displacement(&point.coords);
        // Points very far away saturate: they are outside all the same.
        #[expect(clippy::cast_possible_truncation, reason = "saturates")]
        let index = [turns.x, turns.y, turns.z].map(|turns| turns.floor() as i64);
        cell(self.low, self.size, index).map_or(&[], |cell| self.places.get(cell))
    }
}

/// Visits the cells that a ball about a position may touch, by lattice index.
fn for_each_reached(
    lattice: &Lattice,
    position: &Point3<f64>,
    reach_m: f64,
    mut visit: impl FnMut([i64; 3]),
) {
    // Half the longest diagonal of a cell is 1.225 spacings.
    let far_m = reach_m + 1.225 * lattice.spacing_m();
    let reach = Vector3::repeat(reach_m);
    let (low, size) = box_of(
        lattice,
        &(position.coords - reach),
        &(position.coords + reach),
    );
    for i in low[0]..low[0] + size[0] {
        for j in low[1]..low[1] + size[1] {
            for k in low[2]..low[2] + size[2] {
                let middle = Vector3::new(i as f64 + 0.5, j as f64 + 0.5, k as f64 + 0.5);
                if (lattice.basis() * middle - position.coords).norm() <= far_m {
                    visit([i, j, k]);
                }
            }
        }
    }
}

/// Number of the cell with a lattice index in a box; `None` outside the box.
fn cell(low: [i64; 3], size: [i64; 3], index: [i64; 3]) -> Option<usize> {
    let mut cell = 0;
    for ((index, low), size) in index.iter().zip(low).zip(size) {
        let at = index.saturating_sub(low);
        if !(0..size).contains(&at) {
            return None;
        }
        cell = cell * size + at;
    }
    usize::try_from(cell).ok()
}

/// The lattice indices of a box that holds the given one \[m\]: lowest index, and cells along each
/// axis.
fn box_of(lattice: &Lattice, low: &Vector3<f64>, high: &Vector3<f64>) -> ([i64; 3], [i64; 3]) {
    let middle = lattice.phase_displacement(&((low + high) * 0.5));
    let half = lattice.inverse().abs() * ((high - low) * 0.5);
    let mut first = [0; 3];
    let mut size = [0; 3];
    for axis in 0..3 {
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a model spans few cells; else it saturates"
        )]
        let (from, to) = (
            (middle[axis] - half[axis]).floor() as i64,
            (middle[axis] + half[axis]).floor() as i64,
        );
        first[axis] = from;
        size[axis] = to.saturating_sub(from).saturating_add(1);
    }
    (first, size)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_place_within_reach_is_missed() {
        let noise = |k: u64| random::uniform(3, [0, 0, k]) * 0.2 - 0.1;
        let point = |k: u64| Point3::new(noise(3 * k), noise(3 * k + 1), 0.3 * noise(3 * k + 2));
        let positions: Vec<_> = (0..300).map(point).collect();
        let reaches_m: Vec<_> = (0..300)
            .map(|k| 0.004 + 0.02 * noise(5000 + k).abs())
            .collect();
        let cells = CellLists::new(&positions, &reaches_m, 0.33);
        let mut listed = 0;
        for k in 1000..3000 {
            let query = point(k);
            let near = cells.near(&query);
            listed += near.len();
            for (place, (position, reach_m)) in (0u32..).zip(positions.iter().zip(&reaches_m)) {
                if (position - query).norm() <= *reach_m {
                    assert!(near.contains(&place));
                }
            }
        }
        assert!(listed < 2000 * 60, "the lists hold few others: {listed}");
        assert!(cells.near(&Point3::new(1e300, 0.0, -1e300)).is_empty());
        assert!(
            CellLists::new(&[], &[], 1.0)
                .near(&Point3::origin())
                .is_empty()
        );
    }
}
