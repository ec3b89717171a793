//! Geometry: rigid motions and their uncertainty.

mod covariance;
pub mod se3;
mod se3_jacobian;

pub use covariance::{PoseCovariance, upper_triangle};
pub use se3_jacobian::log_jacobian;
