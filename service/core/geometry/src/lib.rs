#![doc = include_str!("../README.md")]

mod alignment;
mod blocks;
mod bounds;
mod covariance;
mod motion_sum;
mod planar;
mod positive;
mod rotation;
pub mod se3;
mod se3_jacobian;
mod symmetric;

pub use alignment::{align, centre};
pub use blocks::{beside, carried_by_pose, from_blocks, seen_by_pose};
pub use bounds::{is_somewhere, is_within};
pub use covariance::{PoseCovariance, upper_triangle};
pub use motion_sum::MotionSum;
pub use planar::{
    ALL_AXES, OUT_OF_PLANE, PLANAR_AXES, clear_out_of_plane, from_planar_part, hold_in_plane,
    planar_part,
};
pub use positive::positive;
pub use rotation::{planar_procrustes, procrustes, rotation_from_xyzw};
pub use se3_jacobian::{exp_jacobian, log_jacobian};
pub use symmetric::{from_upper_triangle, symmetric};
