//! The box that explanations of a code are sought in.

use nalgebra::{Point3, Vector3};

/// The smallest half edge of a box, as a power of two in finest spacings.
const LEVEL_MIN: i32 = -4;
/// Beyond this many finest spacings from the origin of `map` phases lose more digits than a search
/// allows for.
const SPACINGS_MAX: f64 = 1e6;

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Extent {
    low: Point3<f64>,
    high: Point3<f64>,
}

impl Extent {
    /// The box that holds one position.
    pub fn of(position: &Point3<f64>) -> Self {
        Self {
            low: *position,
            high: *position,
        }
    }

    /// Its edges \[m\].
    pub fn edges_m(&self) -> Vector3<f64> {
        self.high - self.low
    }

    /// Grows to hold a position.
    pub fn include(&mut self, position: &Point3<f64>) {
        self.low = self.low.inf(position);
        self.high = self.high.sup(position);
    }

    /// Grows to hold another box.
    pub fn merge(&mut self, other: &Self) {
        self.include(&other.low);
        self.include(&other.high);
    }

    /// Its centre.
    pub(super) fn centre(&self) -> Point3<f64> {
        nalgebra::center(&self.low, &self.high)
    }

    /// Half edges as powers of two in units of `spacing_m`, rounded up.
    pub(super) fn levels(&self, spacing_m: f64) -> [i32; 3] {
        let half = (self.high - self.low) * (0.5 + 1e-9);
        std::array::from_fn(|axis| {
            let level = (half[axis] / spacing_m).log2().ceil();
            // A cast saturates; NaN becomes 0, and such a box is refused anyway.
            #[expect(clippy::cast_possible_truncation, reason = "saturates, as said")]
            let level = level as i32;
            level.max(LEVEL_MIN)
        })
    }

    /// Whether phases are exact enough all over the box.
    pub(super) fn is_legal(&self, spacing_m: f64) -> bool {
        let inside = |x: &f64| x.abs() <= SPACINGS_MAX * spacing_m;
        self.low.iter().all(inside) && self.high.iter().all(inside)
    }
}
