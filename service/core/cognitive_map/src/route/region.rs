//! Boxes along the axes of the map.

use nalgebra::{Point3, Vector3};

use state::state_of_struct;

/// A box along the axes of `map`, its faces included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Region {
    min: Point3<f64>,
    max: Point3<f64>,
}

impl Region {
    /// The box between two opposite corners \[m\]. `None` where a coordinate is not finite or the
    /// first corner is beyond the second.
    pub fn new(min_m: [f64; 3], max_m: [f64; 3]) -> Option<Self> {
        let ordered = (0..3).all(|k| min_m[k] <= max_m[k]);
        let finite = min_m.iter().chain(&max_m).all(|x| x.is_finite());
        (ordered && finite).then(|| Self {
            min: min_m.into(),
            max: max_m.into(),
        })
    }

    /// The corners with the least and with the largest coordinates \[m\].
    pub fn corners_m(&self) -> [[f64; 3]; 2] {
        [self.min.into(), self.max.into()]
    }

    /// Whether a point lies within.
    pub fn contains(&self, point: &Point3<f64>) -> bool {
        (0..3).all(|k| (self.min[k]..=self.max[k]).contains(&point[k]))
    }

    /// Whether the straight line between two points has a point within (Kay & Kajiya 1986).
    pub fn meets(&self, from: &Point3<f64>, to: &Point3<f64>) -> bool {
        let way: Vector3<f64> = to - from;
        let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
        for k in 0..3 {
            if way[k] == 0.0 {
                if !(self.min[k]..=self.max[k]).contains(&from[k]) {
                    return false;
                }
                continue;
            }
            let at = [self.min[k], self.max[k]].map(|face| (face - from[k]) / way[k]);
            enters = enters.max(at[0].min(at[1]));
            leaves = leaves.min(at[0].max(at[1]));
        }
        enters <= leaves
    }
}

state_of_struct!(Region { min, max });

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Against points along the line; a box that only a corner of is met may be missed by them.
        #[test]
        fn a_line_meets_what_its_points_are_in(
            corner in prop::array::uniform3(-3.0..3.0f64),
            edges in prop::array::uniform3(0.0..3.0f64),
            from in prop::array::uniform3(-5.0..5.0f64),
            to in prop::array::uniform3(-5.0..5.0f64),
        ) {
            let region = Region::new(corner, [0, 1, 2].map(|k| corner[k] + edges[k])).unwrap();
            let (from, to) = (Point3::from(from), Point3::from(to));
            let points = (0..=1000).map(|k| from + (to - from) * (f64::from(k) / 1000.0));
            let within = points.filter(|point| region.contains(point)).count();
            let meets = region.meets(&from, &to);
            prop_assert!(meets || within == 0);
            prop_assert_eq!(region.meets(&to, &from), meets);
            let near = Region::new(
                [0, 1, 2].map(|k| corner[k] - 0.02),
                [0, 1, 2].map(|k| corner[k] + edges[k] + 0.02),
            );
            let points = (0..=1000).map(|k| from + (to - from) * (f64::from(k) / 1000.0));
            let mut points = points.filter(|point| near.unwrap().contains(point));
            prop_assert!(!meets || points.next().is_some());
        }
    }

    #[test]
    fn a_line_within_a_face_meets_the_box() {
        let region = Region::new([0.0; 3], [1.0; 3]).unwrap();
        let line = |from: [f64; 3], to: [f64; 3]| region.meets(&from.into(), &to.into());
        assert!(line([-1.0, 1.0, 0.5], [2.0, 1.0, 0.5]));
        assert!(!line([-1.0, 1.1, 0.5], [2.0, 1.1, 0.5]));
        assert!(line([0.5; 3], [0.5; 3]) && !line([1.5; 3], [1.5; 3]));
        assert!(Region::new([1.0; 3], [0.0; 3]).is_none());
        assert!(Region::new([f64::NAN; 3], [0.0; 3]).is_none());
        assert!(Region::new([0.0; 3], [f64::INFINITY; 3]).is_none());
    }
}
