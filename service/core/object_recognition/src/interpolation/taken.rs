//! Points that keep others away from them.

use std::collections::BTreeMap;

use nalgebra::Point3;

/// Points by the cells of a grid that is as wide as they reach.
#[derive(Debug)]
pub(super) struct Taken {
    reach_m: f64,
    cells: BTreeMap<[i64; 3], Vec<Point3<f64>>>,
}

impl Taken {
    /// No points yet; each keeps others farther away than this \[m\].
    pub(super) fn new(reach_m: f64) -> Self {
        Self {
            reach_m,
            cells: BTreeMap::new(),
        }
    }

    /// Adds a point.
    pub(super) fn add(&mut self, point: Point3<f64>) {
        self.cells.entry(self.cell(&point)).or_default().push(point);
    }

    /// Whether a point is within reach of one of these.
    pub(super) fn holds(&self, point: &Point3<f64>) -> bool {
        let [x, y, z] = self.cell(point);
        let beside = |at: i64| at.saturating_sub(1)..=at.saturating_add(1);
        let is_near = |other: &Point3<f64>| (other - point).norm() < self.reach_m;
        beside(x).any(|x| {
            beside(y).any(|y| {
                let row = [x, y, z.saturating_sub(1)]..=[x, y, z.saturating_add(1)];
                self.cells
                    .range(row)
                    .any(|(_, own)| own.iter().any(is_near))
            })
        })
    }

    fn cell(&self, point: &Point3<f64>) -> [i64; 3] {
        // A little wider than the reach, so that no rounding puts a neighbour two cells away.
        let width_m = 1.001 * self.reach_m;
        #[expect(clippy::cast_possible_truncation, reason = "saturates")]
        let cell = point.coords.map(|x| (x / width_m).floor() as i64);
        cell.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_within_reach_of_any_point_is_taken() {
        let noise = |k: u64| random::uniform(11, [0, 0, k]) * 0.2 - 0.1;
        let point = |k: u64| Point3::new(noise(3 * k), noise(3 * k + 1), noise(3 * k + 2));
        let points: Vec<Point3<f64>> = (0..200).map(point).collect();
        for reach_m in [1e-4, 0.01, 0.03, 10.0] {
            let mut taken = Taken::new(reach_m);
            for own in &points {
                assert!(!taken.holds(own) || reach_m > 0.001);
                taken.add(*own);
                assert!(taken.holds(own));
            }
            for query in (1000..1500).map(point) {
                let mut near = points.iter().map(|own| (own - query).norm());
                assert_eq!(taken.holds(&query), near.any(|apart_m| apart_m < reach_m));
            }
        }
    }
}
