//! Geometry: rigid motions and their uncertainty.

mod alignment;
mod covariance;
mod motion_sum;
pub mod se3;
mod se3_jacobian;

pub(crate) use alignment::{align, centre};
pub use covariance::{PoseCovariance, upper_triangle};
pub(crate) use motion_sum::MotionSum;
pub use se3_jacobian::log_jacobian;
