//! Relocalisation: an agent that does not know where it is finds itself by what the team has seen.
//!
//! A search collects *queries*: views with the pose that motion alone gives. The similarity
//! of a query to a remembered view says how far apart they were taken, so every query is a
//! trilateration. Poses of the agent in the map are seeded where several queries agree (`seeding`),
//! and each is aligned with all views about it (`alignment`). A pose is judged by whether anything
//! along its way contradicts it, not by how many views resemble the queries: where the map is thin
//! it says nothing. A candidate is believed when none elsewhere explains the queries about as well.
//! All queries at once determine the pose within the best candidate, and query by query it must be
//! known about as well (`candidates`).

mod alignment;
mod candidates;
mod kidnap_test;
mod positions;
mod problem;
mod search;
mod seeding;

pub(crate) use alignment::alignment;
pub(crate) use candidates::{Candidate, candidates, turn_sd_rad};
pub(crate) use kidnap_test::{KidnapTest, KidnapTests};
pub(crate) use positions::Positions;
pub(crate) use problem::Problem;
pub(crate) use search::{QueryView, Search, Searches};
