//! Things that can be held in a hand: a cup with a handle, and a bottle.

use nalgebra::{Point3, UnitVector3, Vector3};

/// A surface is met where the distance to it is below this \[m\].
const TOUCH_M: f64 = 2e-5;
/// Steps of a finger towards a surface.
const STEPS_MAX: u32 = 400;
/// Over what the slope of the distance is taken \[m\].
const SLOPE_M: f64 = 1e-5;

/// A thing. It stands upright on the origin of its own frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Thing {
    /// A glazed cup of 8 cm across and 9.5 cm height, with a handle and a rough foot.
    Cup,
    /// A bottle of 6.4 cm across and 18 cm height, with shoulders, a neck and a paper label.
    Bottle,
}

/// Where a finger meets a thing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Met {
    /// Where \[m\].
    pub(super) position: Point3<f64>,
    /// Out of the surface.
    pub(super) normal: UnitVector3<f64>,
    /// How rough it is there, from 0 to 1.
    pub(super) roughness: f64,
}

impl Thing {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cup => "cup",
            Self::Bottle => "bottle",
        }
    }

    /// Height \[m\].
    pub fn height_m(self) -> f64 {
        match self {
            Self::Cup => 0.095,
            Self::Bottle => 0.18,
        }
    }

    /// Where a finger that goes straight on meets the thing; `None` where it passes.
    pub(super) fn meet(
        self,
        from: &Point3<f64>,
        direction: &UnitVector3<f64>,
        reach_m: f64,
    ) -> Option<Met> {
        let mut way_m = 0.0;
        for _ in 0..STEPS_MAX {
            let position = from + direction.into_inner() * way_m;
            let distance_m = self.distance_m(&position);
            if distance_m < TOUCH_M {
                return Some(self.met(position));
            }
            way_m += distance_m;
            if way_m > reach_m {
                return None;
            }
        }
        None
    }

    fn met(self, position: Point3<f64>) -> Met {
        let slope = Vector3::from_fn(|axis, _| {
            let aside = Vector3::ith(axis, SLOPE_M);
            self.distance_m(&(position + aside)) - self.distance_m(&(position - aside))
        });
        Met {
            position,
            normal: UnitVector3::new_normalize(slope),
            roughness: self.roughness(&position),
        }
    }

    /// Distance to the surface \[m\], below zero inside.
    fn distance_m(self, point: &Point3<f64>) -> f64 {
        match self {
            Self::Cup => {
                let wall = cylinder_m(point, 0.04, 0.0, 0.095, 0.003);
                let hollow = cylinder_m(point, 0.036, 0.006, 0.12, 0.002);
                // A ring that stands upright beside the wall.
                let beside = Vector3::new(point.x - 0.042, point.y, point.z - 0.05);
                let handle = (beside.x.hypot(beside.z) - 0.024).hypot(beside.y) - 0.006;
                // What of the ring lies in the hollow is not there.
                wall.min(handle).max(-hollow)
            }
            Self::Bottle => {
                let body = cylinder_m(point, 0.032, 0.0, 0.12, 0.008);
                let neck = cylinder_m(point, 0.013, 0.1, 0.18, 0.002);
                smooth_min(body, neck, 0.02)
            }
        }
    }

    fn roughness(self, point: &Point3<f64>) -> f64 {
        match self {
            Self::Cup if point.z < 0.008 => 0.9,
            Self::Cup => 0.2,
            Self::Bottle if (0.03..0.09).contains(&point.z) => 0.6,
            Self::Bottle => 0.1,
        }
    }
}

/// Distance to an upright cylinder with rounded rims \[m\].
fn cylinder_m(point: &Point3<f64>, radius_m: f64, from_m: f64, to_m: f64, rim_m: f64) -> f64 {
    let (middle_m, half_m) = (f64::midpoint(from_m, to_m), (to_m - from_m) / 2.0);
    let across = point.x.hypot(point.y) - radius_m + rim_m;
    let along = (point.z - middle_m).abs() - half_m + rim_m;
    across.max(along).min(0.0) + across.max(0.0).hypot(along.max(0.0)) - rim_m
}

/// The smaller of two distances, rounded where they are about the same. It never exceeds it, so a
/// finger never goes through.
fn smooth_min(a: f64, b: f64, within: f64) -> f64 {
    let near = (within - (a - b).abs()).max(0.0) / within;
    a.min(b) - near * near * within / 4.0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn inwards(from: &Point3<f64>, to: &Point3<f64>) -> UnitVector3<f64> {
        UnitVector3::new_normalize(to - from)
    }

    #[test]
    fn a_finger_meets_the_wall_and_feels_its_normal() {
        for (thing, radius_m, z) in [(Thing::Cup, 0.04, 0.05), (Thing::Bottle, 0.032, 0.06)] {
            let from = Point3::new(0.0, -0.3, z);
            let met = thing.meet(&from, &inwards(&from, &Point3::new(0.0, 0.0, z)), 0.5);
            let met = met.expect("the wall is there");
            assert!(
                (met.position.y + radius_m).abs() < 1e-4,
                "{:?}",
                met.position
            );
            assert!((met.normal.y + 1.0).abs() < 1e-3, "{:?}", met.normal);
        }
    }

    #[test]
    fn the_handle_is_beside_the_cup_and_the_hollow_is_empty() {
        let from = Point3::new(0.3, 0.0, 0.05);
        let inside = Point3::new(0.0, 0.0, 0.05);
        let met = Thing::Cup.meet(&from, &inwards(&from, &inside), 0.5);
        assert!(met.expect("the handle is there").position.x > 0.06);
        // From above down to the bottom, not to the rim.
        let from = Point3::new(0.0, 0.0, 0.3);
        let met = Thing::Cup.meet(&from, &inwards(&from, &Point3::origin()), 0.5);
        assert!((met.expect("the bottom is there").position.z - 0.006).abs() < 1e-4);
        let past = Point3::new(0.3, 0.2, 0.05);
        let aside = inwards(&past, &Point3::new(-0.3, 0.2, 0.05));
        assert!(Thing::Cup.meet(&past, &aside, 1.0).is_none());
    }
}
