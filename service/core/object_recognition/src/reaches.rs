//! Which places of a map could be the one that was touched, however well that is known.

use std::ops::Range;

use nalgebra::{Point3, UnitQuaternion, Vector3};

use super::spots::whole;
use grid::Lattice;

/// Places of a cell, on average over the box that holds the map. A surface fills few of a box's cells, so those that
/// hold any hold several times as many.
const PLACES_PER_CELL: f64 = 0.3;
/// Length of each row of the lattice's inverse, times its spacing: √(3/2).
const ROW: f64 = 1.224_744_871_391_589;
/// Most cells along an axis, whatever the shape of the map.
const CELLS_MAX: f64 = 256.0;

/// Places in the order of the cells of a grid module at the map's own scale: the reference grid point is the address, a
/// displacement moves it by the lattice's inverse, and what is near any point, in however wide a reach, are a few runs
/// of the order.
#[derive(Clone, Debug)]
pub(super) struct Reaches {
    lattice: Lattice,
    /// Lattice index of the first cell.
    low: Vector3<f64>,
    /// Cells along each axis, at least one.
    size: [usize; 3],
    /// Start of each cell's places; one more at the end.
    starts: Vec<u32>,
}

impl Reaches {
    /// Of places at these positions \[m\], and the order: numbers of the positions.
    pub(super) fn new(positions: &[Point3<f64>]) -> (Self, Vec<u32>) {
        let mut low_m = Vector3::repeat(f64::INFINITY);
        let mut high_m = Vector3::repeat(f64::NEG_INFINITY);
        for position in positions {
            low_m = low_m.inf(&position.coords);
            high_m = high_m.sup(&position.coords);
        }
        if positions.is_empty() {
            (low_m, high_m) = (Vector3::zeros(), Vector3::zeros());
        }
        let extent_m = (high_m - low_m).add_scalar(1e-9);
        // Something flat or straight fills a box of no volume, and has cells along it all the same.
        let widest_m = extent_m.max();
        let volume_m3: f64 = extent_m.iter().map(|x| x.max(0.05 * widest_m)).product();
        let spacing_m = (volume_m3 * PLACES_PER_CELL / positions.len().max(1) as f64).cbrt();
        let lattice = Lattice::new(
            spacing_m.max(widest_m / CELLS_MAX),
            UnitQuaternion::identity(),
        );
        // Whole numbers, so that no rounding of their differences leaves the box.
        let index = |position: &Point3<f64>| {
            let phase = lattice.phase_displacement(&position.coords);
            phase.map(f64::floor)
        };
        let mut low = Vector3::repeat(f64::INFINITY);
        let mut high = Vector3::repeat(f64::NEG_INFINITY);
        for position in positions {
            let index = index(position);
            (low, high) = (low.inf(&index), high.sup(&index));
        }
        if positions.is_empty() {
            (low, high) = (Vector3::zeros(), Vector3::zeros());
        }
        let cell = |index: f64| whole(index) as usize;
        let size = (high - low).map(cell);
        let size = [size.x + 1, size.y + 1, size.z + 1];
        let cells: Vec<usize> = { positions.iter() }
            .map(|position| {
                let [i, j, k] = (index(position) - low).map(cell).into();
                (i * size[1] + j) * size[2] + k
            })
            .collect();
        let mut reaches = Self {
            lattice,
            low,
            size,
            starts: vec![0; size.iter().product::<usize>() + 1],
        };
        for &cell in &cells {
            reaches.starts[cell + 1] += 1;
        }
        for cell in 1..reaches.starts.len() {
            reaches.starts[cell] += reaches.starts[cell - 1];
        }
        let count = u32::try_from(positions.len()).expect("a model has few places");
        let mut order: Vec<u32> = (0..count).collect();
        order.sort_by_key(|&place| cells[place as usize]);
        (reaches, order)
    }

    /// Lists runs of the order that hold all places within `reach_m` \[m\] of a point, and some others.
    pub(super) fn runs(&self, point: &Point3<f64>, reach_m: f64, runs: &mut Vec<Range<u32>>) {
        runs.clear();
        let middle = self.lattice.phase_displacement(&point.coords) - self.low;
        let half = ROW * reach_m / self.lattice.spacing_m();
        let mut first = [0; 3];
        let mut last = [0; 3];
        for axis in 0..3 {
            let (from, to) = (middle[axis] - half, middle[axis] + half);
            // Not a number is in no cell either.
            if !(to >= 0.0 && from < self.size[axis] as f64) {
                return;
            }
            // What lies before the first cell is in it.
            first[axis] = whole(from) as usize;
            last[axis] = (whole(to) as usize).min(self.size[axis] - 1);
        }
        runs.resize(
            (last[0] + 1 - first[0]) * (last[1] + 1 - first[1]),
            Range::default(),
        );
        let mut count = 0;
        for i in first[0]..=last[0] {
            for j in first[1]..=last[1] {
                let row = (i * self.size[1] + j) * self.size[2];
                let from = self.starts[row + first[2]];
                let to = self.starts[row + last[2] + 1];
                // Which rows have places is as good as random: without a branch, all of them come from memory at once.
                runs[count] = from..to;
                count += usize::from(from < to);
            }
        }
        runs.truncate(count);
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
            let (reaches, order) = Reaches::new(&positions);
            assert_eq!(order.len(), positions.len());
            let mut listed = 0;
            let near = |query: &Point3<f64>, reach_m| {
                let mut runs = Vec::new();
                reaches.runs(query, reach_m, &mut runs);
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
        let (none, _) = Reaches::new(&[]);
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
                let (reaches, _) = Reaches::new(&positions);
                let mut runs = Vec::new();
                reaches.runs(&positions[0], f64::INFINITY, &mut runs);
                assert_eq!(runs.into_iter().flatten().count(), positions.len());
            }
        }
    }
}
