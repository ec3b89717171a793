//! The keyframes through its public door.

#![expect(
    clippy::unwrap_used,
    reason = "clippy knows test functions, but not what they call"
)]

mod calibration; // what odometry gets wrong all the time
mod laws; // what holds of every keyframes
mod matches;
mod revisits; // places taken for one another
mod settings;
mod space; // what a space's settings change
