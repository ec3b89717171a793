//! Phase: where in its lattice cell a module stands.

use nalgebra::Vector3;

/// Position in one lattice cell, in turns along the three lattice axes; every component is in \[0,
/// 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Phase(Vector3<f64>);

impl Phase {
    /// The lattice point itself.
    pub fn zero() -> Self {
        Self(Vector3::zeros())
    }

    /// The phase of any number of turns: whole turns fall away.
    ///
    /// A component that is not finite becomes 0; the edges refuse such numbers before they come
    /// here.
    pub fn wrap(turns: Vector3<f64>) -> Self {
        Self(turns.map(|turns| split(turns).1))
    }

    /// The turns, each in \[0, 1).
    pub fn turns(&self) -> &Vector3<f64> {
        &self.0
    }

    /// The phase of turns that stay within the cell; most steps do, and need no rounding.
    pub(super) fn within_cell(turns: &Vector3<f64>) -> Option<Self> {
        turns
            .iter()
            .all(|turns| (0.0..1.0).contains(turns))
            .then_some(Self(*turns))
    }

    /// Splits turns into whole cells and the phase in the last one.
    pub(super) fn split(turns: &Vector3<f64>) -> ([i64; 3], Self) {
        let (i, x) = split(turns.x);
        let (j, y) = split(turns.y);
        let (k, z) = split(turns.z);
        ([i, j, k], Self(Vector3::new(x, y, z)))
    }
}

/// Whole turns and the rest in \[0, 1).
///
/// A tiny negative number's rest rounds to 1, which is the next cell's 0. The conversion to an
/// integer and back rounds down without a call to `floor`, which the x86-64 baseline has no
/// instruction for.
#[expect(
    clippy::cast_possible_truncation,
    reason = "saturates; no legal position is 2⁶³ cells away"
)]
fn split(turns: f64) -> (i64, f64) {
    let toward_zero = turns as i64;
    let beyond = toward_zero as f64 > turns;
    let whole = toward_zero.saturating_sub(i64::from(beyond));
    // Adding zero turns a negative zero into zero, so that equal phases have equal bytes.
    let rest = turns - whole as f64 + 0.0;
    if (0.0..1.0).contains(&rest) {
        (whole, rest)
    } else {
        (
            whole.saturating_add(i64::from((1.0..2.0).contains(&rest))),
            0.0,
        )
    }
}
