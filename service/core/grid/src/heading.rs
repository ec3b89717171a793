//! Head-direction cells, read out from the orientation.

use std::f64::consts::TAU;

use nalgebra::{UnitQuaternion, Vector3};

/// Concentration κ of the cells' tuning; near the preferred heading it is a Gaussian of 1/√κ = 0.5
/// rad.
pub const CONCENTRATION: f64 = 4.0;

/// Heading in (−π, π] \[rad\]: the direction of the body's x axis in the x-y plane of `map`,
/// counted from its x axis towards its y axis.
///
/// When the body looks straight up or down there is no heading: the value is then decided by
/// rounding.
pub fn heading_rad(orientation: &UnitQuaternion<f64>) -> f64 {
    let forward = orientation * Vector3::x();
    // Adding zero turns a negative zero into zero, so that due backwards is π and never −π.
    (forward.y + 0.0).atan2(forward.x)
}

/// Activations in (0, 1] of `cells` head-direction cells with preferred headings 2π i / `cells`:
/// the Gaussian's counterpart on the circle, von Mises tuning.
///
/// ```text
/// h_i = exp(κ (cos(heading − 2π i / cells) − 1))
/// ```
pub fn heading_cells(heading_rad: f64, cells: usize) -> Vec<f64> {
    let preferred = |cell: usize| TAU * cell as f64 / cells as f64;
    let tuned = |cell| (CONCENTRATION * ((heading_rad - preferred(cell)).cos() - 1.0)).exp();
    (0..cells).map(tuned).collect()
}
