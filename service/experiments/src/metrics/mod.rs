//! How far an estimated trajectory lies from the truth.

mod alignment;
mod ate;
mod dead_reckoning;
mod trajectory;

pub use alignment::Alignment;
pub use ate::{AteError, AteSummary, Pairs, ate_rmse_m};
pub use dead_reckoning::{DeadReckoning, dead_reckoned};
pub(crate) use trajectory::fraction;
pub use trajectory::{
    GRID_STEP_NS, InvalidTrajectory, Span, StampedPose, StampedPosition, Trajectory,
};
