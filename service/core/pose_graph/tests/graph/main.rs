//! The experience map through its public door.

#![expect(
    clippy::unwrap_used,
    reason = "clippy knows test functions, but not what they call"
)]

mod covariance; // how sure the map is
mod doubt; // links that are false
mod relaxation; // relaxation of a whole map
mod worlds; // maps with a known truth
