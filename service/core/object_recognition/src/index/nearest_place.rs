//! Which of some places is nearest to a point.

use nalgebra::Point3;

use crate::index::lattice_index::LatticeIndex;

/// Doublings of the first reach, after which all places are compared: a point so far off is as near
/// to all of them.
const DOUBLINGS: i32 = 6;

/// Places, by their lattice index.
#[derive(Clone, Debug)]
pub(crate) struct NearestPlace {
    lattice_index: LatticeIndex,
    /// Positions and numbers, in the order of the index.
    places: Vec<(Point3<f64>, u32)>,
    /// Typical distance between neighbouring places \[m\].
    typical_m: f64,
}

impl NearestPlace {
    /// Of places at these positions, typically so far from their neighbours \[m\].
    pub(crate) fn new(positions: &[Point3<f64>], typical_m: f64) -> Self {
        let (lattice_index, order) = LatticeIndex::new(positions);
        let place = |number: &u32| (positions[*number as usize], *number);
        Self {
            lattice_index,
            places: order.iter().map(place).collect(),
            typical_m,
        }
    }

    /// The nearest place to a point: squared distance \[m²\] and number, the lower one of two that
    /// are equally near.
    pub(crate) fn find(&self, point: &Point3<f64>) -> Option<(f64, u32)> {
        let square = |&(position, number): &(Point3<f64>, u32)| {
            let square = (position - point).norm_squared();
            (square, number)
        };
        let order = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        let mut runs = Vec::new();
        for doubling in 0..DOUBLINGS {
            let reach_m = self.typical_m * f64::from(1 << doubling);
            self.lattice_index.runs(point, reach_m, &mut runs);
            let near =
                { runs.iter() }.flat_map(|run| &self.places[run.start as usize..run.end as usize]);
            let found = near.map(square).min_by(order);
            if let Some(found) = found.filter(|(square, _)| *square <= reach_m * reach_m) {
                return Some(found);
            }
        }
        self.places.iter().map(square).min_by(order)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_one_that_all_others_are_farther_than() {
        let noise = |k: u64| random::uniform(9, [0, 0, k]) * 0.2 - 0.1;
        let point = |k: u64| Point3::new(noise(3 * k), noise(3 * k + 1), noise(3 * k + 2));
        let mut positions: Vec<Point3<f64>> = (0..300).map(point).collect();
        positions.extend_from_within(..100);
        for typical_m in [0.0, 1e-4, 0.01, 1.0] {
            let nearest = NearestPlace::new(&positions, typical_m);
            for (k, scale) in (1000..1200).zip([0.5, 1.0, 2.0, 100.0].into_iter().cycle()) {
                let query = Point3::from(point(k).coords * scale);
                let (square, number) = nearest.find(&query).unwrap();
                assert!(number < 300);
                let squares = { positions.iter() }.map(|other| (other - query).norm_squared());
                let least = squares.clone().fold(f64::INFINITY, f64::min);
                let found = squares.clone().nth(number as usize);
                assert_eq!([Some(square), found], [Some(least); 2]);
            }
            assert_eq!(nearest.find(&positions[150]), Some((0.0, 150)));
            assert_eq!(nearest.find(&positions[350]), Some((0.0, 50)));
        }
        assert_eq!(NearestPlace::new(&[], 0.01).find(&Point3::origin()), None);
    }
}
