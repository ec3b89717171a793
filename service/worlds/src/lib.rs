//! The rooms of the seed paper's first two environments, and robots that walk in them.
//!
//! The paper ("A Novel Computational Modeling for Grid and Place Neurons in Spatial Mapping and
//! Navigation in 3-D Environment", Section 4.1) has an empty room of 10 × 10 × 10 m as its first
//! environment. Of the second (Section 4.2) it says: 15 × 15 × 15 m, 50 randomly placed cubic
//! obstacles, a random walk of 1000 steps from the centre inside the bounds, with obstacle
//! avoidance. What it leaves open is settled here:
//!
//! - **Cubes**: axis-aligned, edges uniform in 0.5 to 2 m, wholly inside the room; they may
//!   overlap. None comes within 1 m of the centre, where the first robot starts.
//! - **Steps**: 0.1 m, the grid spacing of the paper's first environment.
//! - **Walk**: persistent ([`Walker`]); the turn of a step is correlated with that of the step
//!   before, and the body's x axis points along the movement. Before an obstacle the robot turns to
//!   a free side. Or pure ([`PureWalker`]); each step goes in a direction of its own.
//! - **Body**: a ball of 0.15 m radius.
//! - **Landmarks**: beacons on corners of some cubes. The paper's agent has no exteroception
//!   beyond its place memory; robots that are to keep their drift bounded need some.
//! - **Noise**: the paper names none for its odometry; see [`OdometryNoise`].
//!
//! Beside them there is a flat room for robots on two wheels ([`Wheels`]), whose odometry errs as
//! wheels do.
//!
//! The demo plays in the second of these rooms ([`Scenario`]): robots that patrol it wake up lost
//! or are carried off, and an arm feels things ([`Thing`]).

mod dead_reckoning;
mod eye;
mod hand;
mod level_field;
mod obstacle;
mod odometry;
mod patroller;
mod pure_walk;
mod reading;
mod round;
mod scenario;
mod scenery;
mod sensor;
mod steering;
mod team;
mod thing;
mod walker;
mod wheels;
mod wire;

pub use dead_reckoning::{DeadReckoning, dead_reckoned};
pub use eye::Eye;
pub use level_field::LevelField;
pub use obstacle::{Beacon, Cube, ObstacleWorld, SIDE_M};
pub use odometry::{InvalidNoise, Odometer, OdometryNoise};
pub use pure_walk::PureWalker;
pub use reading::{Reading, ReadingBody, ReadingMark, ReadingNoise, ReadingTarget, robot_name};
pub use scenario::{
    ARM, Act, AgentTick, InvalidScenario, Scenario, ScenarioSettings, ScenarioTick,
};
pub use scenery::Scenery;
pub use sensor::{InvalidSensor, Sensor};
pub use team::{InvalidTeam, RobotTick, StartKnowledge, Team, TeamSettings};
pub use thing::Thing;
pub use walker::{BODY_RADIUS_M, STEP_M, Step, Walker};
pub use wheels::{WheelSettings, WheelTick, Wheels};

#[cfg(test)]
mod tests;
