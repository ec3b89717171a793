//! Lattice index: the places within any distance of a point, as a few runs of one order.

use std::ops::Range;

use grid::Lattice;
use nalgebra::{Point3, UnitQuaternion, Vector3};

use crate::index::buckets::Buckets;
use crate::numeric::{bounds, floor_u32};
use crate::tuning::{LATTICE_CELLS_MAX, PLACES_PER_CELL};

/// Norm of each row of the lattice's inverse, times its spacing: √(3/2).
const ROW: f64 = 1.224_744_871_391_589;

/// Places in the order of the cells of a face-centred cubic lattice at the model's own scale: those
/// near a point, at whatever distance, are a few runs of that order.
#[derive(Clone, Debug)]
pub(crate) struct LatticeIndex {
    lattice: Lattice,
    /// Lattice index of the first cell.
    low: Vector3<f64>,
    /// Cells along each axis, at least one.
    size: [usize; 3],
    /// Start of each cell's places; one more at the end.
    starts: Vec<u32>,
}

impl LatticeIndex {
    /// Of places at these positions \[m\]; also the order, as indices of the positions.
    pub(crate) fn new(positions: &[Point3<f64>]) -> (Self, Vec<u32>) {
        let (low_m, high_m) = bounds(positions.iter().map(|position| position.coords));
        let extent_m = (high_m - low_m).add_scalar(1e-9);
        // A flat or straight model has a box of no volume: each edge counts a twentieth of the
        // longest.
        let widest_m = extent_m.max();
        let volume_m3: f64 = extent_m.iter().map(|x| x.max(0.05 * widest_m)).product();
        let spacing_m = (volume_m3 * PLACES_PER_CELL / positions.len().max(1) as f64).cbrt();
        let lattice = Lattice::new(
            spacing_m.max(widest_m / LATTICE_CELLS_MAX),
            UnitQuaternion::identity(),
        );
        // Differences of whole numbers are exact: no rounding leaves the box.
        let index = |position: &Point3<f64>| {
            let phase = lattice.phase_displacement(&position.coords);
            phase.map(f64::floor)
        };
        let (low, high) = bounds(positions.iter().map(index));
        let cell = |index: f64| floor_u32(index) as usize;
        let size = (high - low).map(cell);
        let size = [size.x + 1, size.y + 1, size.z + 1];
        let places = positions.iter().zip(0u32..).map(|(position, place)| {
            let [i, j, k] = (index(position) - low).map(cell).into();
            ((i * size[1] + j) * size[2] + k, place)
        });
        let cells: Vec<_> = places.collect();
        let count = size.iter().product();
        let Buckets { starts, items } = Buckets::new(count, cells.into_iter());
        let lattice_index = Self {
            lattice,
            low,
            size,
            starts,
        };
        (lattice_index, items)
    }

    /// Lists runs of the order that hold all places within `reach_m` of a point, and some others.
    pub(crate) fn runs(&self, point: &Point3<f64>, reach_m: f64, runs: &mut Vec<Range<u32>>) {
        runs.clear();
        self.for_each_run(point, reach_m, |run| runs.push(run));
    }

    /// Visits runs of the order that hold all places within `reach_m` of a point, and some others,
    /// in that order.
    pub(crate) fn for_each_run(
        &self,
        point: &Point3<f64>,
        reach_m: f64,
        mut visit: impl FnMut(Range<u32>),
    ) {
        let middle = self.lattice.phase_displacement(&point.coords) - self.low;
        let half = ROW * reach_m / self.lattice.spacing_m();
        let mut first = [0; 3];
        let mut last = [0; 3];
        for axis in 0..3 {
            let (from, to) = (middle[axis] - half, middle[axis] + half);
            // The negated condition also refuses NaN.
            if !(to >= 0.0 && from < self.size[axis] as f64) {
                return;
            }
            // `floor_u32` saturates at the first cell.
            first[axis] = floor_u32(from) as usize;
            last[axis] = (floor_u32(to) as usize).min(self.size[axis] - 1);
        }
        for i in first[0]..=last[0] {
            for j in first[1]..=last[1] {
                let row = (i * self.size[1] + j) * self.size[2];
                let from = self.starts[row + first[2]];
                let to = self.starts[row + last[2] + 1];
                if from < to {
                    visit(from..to);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_place_within_reach_is_missed_at_any_reach() {
        let noise = |k: u64| random::uniform(5, [0, 0, k]) * 0.2 - 0.1;
        let point = |k: u64| Point3::new(noise(3 * k), noise(3 * k + 1), noise(3 * k + 2));
        let flat = |k: u64| Point3::new(noise(3 * k), 0.03, noise(3 * k + 2));
        let line = |k: u64| Point3::new(0.01, -5.0, noise(3 * k + 2));
        let shapes: [Vec<Point3<f64>>; 5] = [
            (0..200).map(point).collect(),
            (0..200).map(flat).collect(),
            (0..200).map(line).collect(),
            vec![point(1)],
            vec![point(1); 9],
        ];
        for positions in shapes {
            let (lattice_index, order) = LatticeIndex::new(&positions);
            assert_eq!(order.len(), positions.len());
            let mut listed = 0;
            let near = |query: &Point3<f64>, reach_m| {
                let mut runs = Vec::new();
                lattice_index.runs(query, reach_m, &mut runs);
                let places = runs.into_iter().flatten();
                places.map(|at| order[at as usize]).collect::<Vec<u32>>()
            };
            for (k, reach_m) in (1000..1400).zip([0.0, 0.004, 0.02, 0.08, 0.3].into_iter().cycle())
            {
                let query = positions[k % positions.len()] + point(k as u64).coords * 0.3;
                let near = near(&query, reach_m);
                listed += usize::from(reach_m < 0.01) * near.len();
                for (place, position) in (0u32..).zip(&positions) {
                    if (position - query).norm() <= reach_m {
                        assert!(near.contains(&place), "{reach_m}");
                    }
                }
            }
            assert!(listed <= 160 * (10 + positions.len() / 10), "{listed}");
            let all = near(&positions[0], f64::INFINITY);
            assert_eq!(all.len(), positions.len());
            assert!(near(&Point3::new(1e300, 0.0, -1e300), 1.0).is_empty());
            assert!(near(&Point3::new(f64::NAN, 0.0, 0.0), 1.0).is_empty());
        }
        let (none, _) = LatticeIndex::new(&[]);
        let mut runs = Vec::new();
        none.runs(&Point3::origin(), 1.0, &mut runs);
        assert!(runs.is_empty());
    }

    #[test]
    fn places_far_from_the_origin_have_cells_too() {
        let noise = |k: u64| random::uniform(7, [0, 0, k]) * 2.0 - 1.0;
        for (k, offset) in (0..40u64).zip([0.0, 1.0, -1.0, 1e6, -1e6].into_iter().cycle()) {
            for scale in [1e-12, 1e-6, 1e-3, 1.0, 1e3, 1e6] {
                let at = |k: u64| offset + scale * noise(k);
                let point = |n: u64| 3 * (50 * k + n);
                let positions: Vec<_> = (0..2 + k)
                    .map(point)
                    .map(|k| Point3::new(at(k), at(k + 1), at(k + 2)))
                    .collect();
                let (lattice_index, _) = LatticeIndex::new(&positions);
                let mut runs = Vec::new();
                lattice_index.runs(&positions[0], f64::INFINITY, &mut runs);
                assert_eq!(runs.into_iter().flatten().count(), positions.len());
            }
        }
    }
}
