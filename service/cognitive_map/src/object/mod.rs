//! Objects: what agents have touched, and know again.
//!
//! An *episode* of an agent begins and ends with an [`ObjectMark`]. What is felt in between counts in the frame of the sensor's
//! body when it began, by path integration, and teaches an object or is to be recognised by [`recognition`](crate::recognition).

mod episode;
mod joining;
mod mark;
mod memory;
mod state;
mod touch;

pub(crate) use episode::{Episode, News};
pub(crate) use joining::Insight;
pub use mark::{ObjectMark, Spacing, TouchNoise};
pub(crate) use memory::ObjectMemory;
pub use memory::{Identified, KnownObject};
pub use touch::{Lesson, Touch, TouchLevel};
