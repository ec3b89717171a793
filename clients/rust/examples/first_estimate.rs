//! From nothing to a first estimate. Needs a running service:
//! `cargo run -p cogmap-client --example first_estimate -- tcp/127.0.0.1:7447`
#![allow(clippy::print_stdout)] // An example talks to its reader.

use std::time::Duration;

use cogmap_client::{ClientError, Robot};

fn main() -> Result<(), ClientError> {
    let endpoint = std::env::args().nth(1);
    let endpoint = endpoint.as_deref().unwrap_or("tcp/127.0.0.1:7447");

    let robot = Robot::connect(endpoint, "default", "ada")?;
    robot.start_pose([0.0; 3], [0.0, 0.0, 0.0, 1.0])?;
    robot.velocity([0.5, 0.0, 0.0], [0.0, 0.0, 0.1], 0.1)?; // m/s, rad/s, held for 0.1 s
    robot.flush(Duration::from_secs(5))?; // until it is on the service's disk
    println!("{:?}", robot.estimate(Duration::from_secs(1))?);
    robot.close(Duration::from_secs(1))
}
