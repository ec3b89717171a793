//! Geometry: rigid motions and their uncertainty.

mod alignment;
mod bounds;
mod covariance;
mod motion_sum;
mod positive;
pub mod se3;
mod se3_jacobian;

pub(crate) use alignment::{align, centre};
pub(crate) use bounds::is_somewhere;
pub use covariance::{PoseCovariance, upper_triangle};
pub(crate) use motion_sum::MotionSum;
pub(crate) use positive::positive;
pub use se3_jacobian::log_jacobian;
