//! Points that keep others away from them.

use nalgebra::Point3;

/// Odd factors by which cells are spread over the lists (Teschner et al. 2003, Optimized spatial
/// hashing for collision detection of deformable objects).
const FACTORS: [u64; 3] = [
    0x9e37_79b9_7f4a_7c15,
    0xc2b2_ae3d_27d4_eb4f,
    0x1656_67b1_9e37_79f9,
];
/// No point.
const NONE: u32 = u32::MAX;

/// Points by the cells of a grid that is as wide as they reach.
///
/// Points of many cells are in one list: which of them is near is told by its distance alone.
#[derive(Debug)]
pub(super) struct Taken {
    reach_m: f64,
    /// The newest point of each list; as many lists as a power of two.
    newest: Vec<u32>,
    /// Points, each with the one before it in its list.
    points: Vec<(Point3<f64>, u32)>,
}

impl Taken {
    /// No points yet; each keeps others farther away than this \[m\]. They are found soon among so
    /// many.
    pub(super) fn new(reach_m: f64, count: usize) -> Self {
        Self {
            reach_m,
            newest: vec![NONE; (2 * count).next_power_of_two()],
            points: Vec::with_capacity(count),
        }
    }

    /// Adds a point.
    pub(super) fn add(&mut self, point: Point3<f64>) {
        let list = self.list(self.cell(&point));
        let number = u32::try_from(self.points.len()).unwrap_or(NONE);
        let before = std::mem::replace(&mut self.newest[list], number);
        self.points.push((point, before));
    }

    /// Whether a point is within reach of one of these.
    pub(super) fn holds(&self, point: &Point3<f64>) -> bool {
        /// The cell itself first, where most that is taken is found.
        const BESIDE: [i64; 3] = [0, -1, 1];
        let [x, y, z] = self.cell(point);
        let reach_m2 = self.reach_m * self.reach_m;
        BESIDE.iter().any(|i| {
            BESIDE.iter().any(|j| {
                BESIDE.iter().any(|k| {
                    let cell = [x.wrapping_add(*i), y.wrapping_add(*j), z.wrapping_add(*k)];
                    let mut next = self.newest[self.list(cell)];
                    while let Some((other, before)) = self.points.get(next as usize) {
                        if (other - point).norm_squared() < reach_m2 {
                            return true;
                        }
                        next = *before;
                    }
                    false
                })
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

    fn list(&self, cell: [i64; 3]) -> usize {
        let terms = { cell.iter().zip(FACTORS) }
            .map(|(at, factor)| at.cast_unsigned().wrapping_mul(factor));
        let mixed = terms.fold(0, |sum, term| (sum ^ term).rotate_left(29));
        #[expect(clippy::cast_possible_truncation, reason = "the low bits of a mix")]
        let list = (mixed ^ (mixed >> 32)) as usize;
        list & (self.newest.len() - 1)
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
            let mut taken = Taken::new(reach_m, points.len() / 8);
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
