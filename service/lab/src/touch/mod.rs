//! Objects as sets of touches: a place on the surface and one level.
//!
//! A set is a directory with one file an object, `<name>.csv`, of the columns
//! `x_mm,y_mm,z_mm,level`: millimetres in the object's own frame. An [`Episode`] is an object
//! touched again, in random order, with noise and in a frame of its own. A [`TouchExperiment`]
//! learns all objects of a set and recognises them in many episodes, and a [`TouchReport`] sums it
//! up.

mod data_set;
mod episode;
mod report;
mod run;

pub use data_set::{Touch, TouchError, TouchReason, TouchSet, TouchedObject};
pub use episode::{Episode, TouchNoise, episode_random};
pub use report::TouchReport;
pub use run::{InvalidTouchProtocol, TouchExperiment, TouchProtocol, TouchTrial};

#[cfg(test)]
mod tests;
