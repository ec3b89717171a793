//! The keyframes through its public door.

#![expect(
    clippy::unwrap_used,
    reason = "clippy knows test functions, but not what they call"
)]

mod calibration; // what odometry gets wrong all the time
mod laws; // what holds of every keyframes
mod matches;
mod revisits; // places taken for one another
mod settings; // what a space's settings change
mod space; // closures of robots that move in space

use cognitive_map::estimator::Calibrated;
use geometry::se3;
use nalgebra::Isometry3;

/// A motion that is taken as it was read.
fn as_read(read: &Isometry3<f64>) -> Calibrated {
    Calibrated {
        turned_rad: se3::log(read).1,
        ..Calibrated::default()
    }
}
