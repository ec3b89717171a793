#![doc = include_str!("../README.md")]

mod alignment;
mod ate;
mod stamp;
mod trajectory;
mod tum;

pub use alignment::Alignment;
pub use ate::{AteError, AteSummary, Pairs, ate_rmse_m};
pub use stamp::{InvalidStamp, format_seconds, parse_seconds};
pub use trajectory::{
    GRID_STEP_NS, InvalidTrajectory, Span, StampedPose, StampedPosition, Trajectory, fraction,
};
pub use tum::{TumError, TumReason, read_tum, write_tum};
