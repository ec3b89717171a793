//! An episode of recognition and its answers.

mod dependence;
mod episode;
mod explanation;
mod gaps;
mod joint_evidence;
mod likelihoods;
mod masses;
mod unknown;

pub use episode::Recognition;
pub use explanation::{Explanation, explain};
