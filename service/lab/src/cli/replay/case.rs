//! A recording, and how its replay is scored.

use super::scoring::Scoring;
use super::team::Team;

/// A recording, and how its replay is scored.
#[derive(Debug)]
pub(super) struct Case {
    /// Which start poses the robots are told.
    pub(super) start_pose: &'static str,
    /// The robots, by their spaces.
    pub(super) teams: Vec<Team>,
    pub(super) scoring: Scoring,
}
