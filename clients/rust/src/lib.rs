//! Rust client of cogmap.
//!
//! [`Robot`] publishes samples over Zenoh and sends each again until the service has it on disk;
//! it follows the agent's estimates. [`Api`] asks over HTTP. Both block and are simple:
//!
//! ```no_run
//! use std::time::Duration;
//!
//! use cogmap_client::Robot;
//!
//! # fn main() -> Result<(), cogmap_client::ClientError> {
//! let robot = Robot::connect("tcp/127.0.0.1:7447", "default", "ada")?;
//! robot.start_pose([0.0; 3], [0.0, 0.0, 0.0, 1.0])?;
//! robot.velocity([0.5, 0.0, 0.0], [0.0, 0.0, 0.1], 0.1)?;
//! robot.flush(Duration::from_secs(5))?;
//! println!("{:?}", robot.estimate(Duration::from_secs(1))?);
//! # Ok(())
//! # }
//! ```
//!
//! The messages are those of [`cogmap_proto`], re-exported as [`proto`].

mod api;
mod batch;
mod builder;
mod credentials;
mod error;
mod link;
mod robot;
mod sampling;
mod sender;
mod settings;
mod state;
mod window;

pub use api::{Api, ApiError};
pub use builder::RobotBuilder;
pub use cogmap_proto as proto;
pub use credentials::Credentials;
pub use error::ClientError;
pub use link::{open_session, open_session_as};
pub use robot::Robot;
pub use sampling::TripMark;
pub use settings::RobotSettings;
pub use state::Counters;
