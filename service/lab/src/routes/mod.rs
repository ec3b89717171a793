//! Worlds in which routes are asked for and followed: floors of a building, and a robot on them.

mod floor;
mod planner;
mod robot;

pub use floor::{Floor, FloorKind};
pub use planner::LocalPlanner;
pub use robot::PlanarRobot;
