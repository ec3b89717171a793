//! Which places of a map could be the one that was touched, however well that is known.

use nalgebra::Point3;

use super::cells::Cells;

/// From one index to the next the reach grows so much.
const GROWTH: f64 = 3.0;

/// Cells of half a reach: each index of a thousand places takes a few hundred kilobytes.
const CELL_PER_REACH: f64 = 0.5;

/// Indexes of the same places for reaches that grow by a factor of three, up to the extent of the map.
///
/// A touch is looked up by what it knows: a contact of 10 mm noise reaches far in a map that was learned to a
/// tenth of a millimetre. Beyond the widest index all places are near.
#[derive(Clone, Debug)]
pub(super) struct Reaches {
    /// How uncertain a point may be \[m\], and the index for that.
    indexes: Vec<(f64, Cells)>,
    all: Vec<u32>,
}

impl Reaches {
    /// Of places at these positions \[m\], whose own fields reach so far \[m\]. The first index is for points
    /// uncertain by `least_m`.
    pub(super) fn new(
        positions: &[Point3<f64>],
        own_m: &[f64],
        least_m: f64,
        extent_m: f64,
    ) -> Self {
        let mut indexes = Vec::new();
        let mut reach_m = least_m.max(1e-9);
        loop {
            let reaches: Vec<f64> = own_m.iter().map(|own_m| own_m.hypot(reach_m)).collect();
            indexes.push((reach_m, Cells::new(positions, &reaches, CELL_PER_REACH)));
            reach_m *= GROWTH;
            // An index that finds a good part of the map everywhere is no better than all of it.
            if reach_m > 0.25 * extent_m {
                break;
            }
        }
        let count = u32::try_from(positions.len()).expect("a model has few places");
        Self {
            indexes,
            all: (0..count).collect(),
        }
    }

    /// All places whose field reaches to within `reach_m` \[m\] of a point, and some others, in order.
    pub(super) fn near(&self, point: &Point3<f64>, reach_m: f64) -> &[u32] {
        let finest = self
            .indexes
            .iter()
            .find(|(widest_m, _)| reach_m <= *widest_m);
        finest.map_or(&self.all, |(_, cells)| cells.near(point))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_place_within_reach_is_missed_at_any_reach() {
        let noise = |k: u64| crate::random::uniform(5, crate::record::AgentId(0), 0, k) * 0.2 - 0.1;
        let point = |k: u64| Point3::new(noise(3 * k), noise(3 * k + 1), noise(3 * k + 2));
        let positions: Vec<_> = (0..200).map(point).collect();
        let own_m = vec![0.002; 200];
        let reaches = Reaches::new(&positions, &own_m, 0.001, 0.35);
        for (k, reach_m) in (1000..1400).zip([0.0005, 0.004, 0.02, 0.08, 0.3].into_iter().cycle()) {
            let query = point(k);
            let near = reaches.near(&query, reach_m);
            for (place, position) in (0u32..).zip(&positions) {
                if (position - query).norm() <= reach_m.hypot(0.002) {
                    assert!(near.contains(&place), "{reach_m}");
                }
            }
        }
        assert!(reaches.near(&point(1), 0.001).len() < 100);
        assert_eq!(reaches.near(&point(1), f64::INFINITY).len(), 200);
    }
}
