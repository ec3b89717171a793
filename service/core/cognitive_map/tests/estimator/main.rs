//! The joint estimate from outside: teams in a simulated hall, and everything that may go wrong
//! there.

#![expect(
    clippy::unwrap_used,
    reason = "clippy knows test functions, but not what they call"
)]

mod external_pose; // poses told by another estimate
mod far_beacons; // a robot that measures distances in a yard, on any wheels
mod good_sensors; // a robot whose sensors are good, and whose wheels are any
mod hall; // robots that drive and see
mod large_hall; // more landmarks than are estimated jointly
mod trouble; // liars, slips, moved and mistaken landmarks, silence, walls
