//! Objects: what agents have touched, and know again.
//!
//! An *episode* of an agent begins and ends with an [`ObjectMark`](crate::ObjectMark). What is
//! sensed in between counts in the frame of the sensor's body when it began, by path integration,
//! and teaches an object or is to be recognised by [`recognition`](object_recognition).

mod episode;
mod indexing;
mod joined;
mod joining;
mod memory;
mod state;

pub(crate) use episode::{Episode, News};
pub use indexing::IndexingJob;
pub(crate) use joining::Insight;
pub(crate) use memory::ObjectMemory;
pub use memory::{Identified, KnownObject};
