#![doc = include_str!("../README.md")]

mod contact;
mod gaussian_process;
mod index;
mod indexed_model;
mod indexed_place;
mod interpolation;
mod level_prior;
mod library;
mod library_entry;
mod model;
mod next_touch;
mod numeric;
mod object_id;
mod orientation;
mod percept_likelihood;
mod poses;
mod posterior;
mod recognition;
mod state;
mod surfels;
#[cfg(test)]
mod tests;
mod translations;
mod tuning;
mod variant;
mod z_score;

pub use contact::{Contact, DescriptorReading, LevelReading, Reached};
pub use library::{Density, ObjectLibrary};
pub use model::{LevelMemory, ModelPlace, ModelSettings, ObjectModel};
pub use next_touch::NextTouch;
pub use object_id::ObjectId;
pub use orientation::Orientation;
pub use posterior::{PoseEstimate, Posterior, Verdict};
pub use recognition::{Explanation, Recognition, explain};
pub use tuning::ANSWER_PROBABILITY;
