//! The seed paper's third experiment: which of some objects is this, and how many touches does it
//! take to tell?
//!
//! An [`ObjectExperiment`] learns objects of coloured voxels by exploring them
//! ([`crate::objects`]), and then recognises them by exploring them again from unknown starts. An
//! [`ObjectReport`] has what came out, an [`ObjectTable`] shows it beside the paper's Table 2, and
//! [`object_figures`] draws Fig. 21.
//!
//! # What the paper leaves open, and what is done here
//!
//! | question | answer |
//! |---|---|
//! | objects, colours, moves | see [`crate::objects`] |
//! | how an object is learned | in visits of 100 touches, each from the same face on, until three one after the other found no new place; with the same noise as later |
//! | when recognition has converged | when one object, or that it is none of them, is as probable as [`ObjectProtocol::sure`] |
//! | accuracy | share of all explorations that ended with the right object; those without an answer count as wrong |
//! | an active object representation | an object with a probability above one in a hundred |
//! | objects that were never learned | a quarter as many explorations; they are no part of the accuracy |

mod figure;
mod outcomes;
mod parallel;
mod protocol;
mod report;
mod rotate;
mod run;
mod trace;

pub use figure::object_figures;
pub use outcomes::{Outcomes, TouchTimes};
pub(crate) use parallel::in_parallel;
pub use protocol::{InvalidObjectProtocol, Normals, ObjectProtocol};
pub(crate) use report::means;
pub use report::{ObjectReport, ObjectTable, PaperRow};
pub use rotate::Rotate;
pub use run::ObjectExperiment;
pub(crate) use run::object_id;
pub use trace::{Answer, Decision, Ending, GoesOn, TouchStep, Trace};

#[cfg(test)]
mod tests;
