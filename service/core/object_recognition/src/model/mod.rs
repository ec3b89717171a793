//! What is learned of one object: places by contact.

mod object_model;
mod place;

pub use object_model::{ModelSettings, ObjectModel};
pub use place::{LevelMemory, ModelPlace};
