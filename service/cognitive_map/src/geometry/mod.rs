//! Geometry: rigid motions and their uncertainty.

mod covariance;
pub mod se3;

pub use covariance::{PoseCovariance, upper_triangle};
