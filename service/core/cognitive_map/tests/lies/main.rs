//! Robots that lie: whatever valid samples say, numbers stay finite, covariances positive, honest
//! robots localised.

#![expect(
    clippy::unwrap_used,
    reason = "clippy knows test functions, but not what they call"
)]

mod company; // honest robots beside liars
mod contradiction; // robots that contradict themselves
mod liar; // samples of robots that lie
mod sound; // what holds of every map
