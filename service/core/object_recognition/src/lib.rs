#![doc = include_str!("../README.md")]

mod asking;
mod bricks;
mod bytes;
mod cells;
mod contact;
mod crowd;
mod deviation;
mod encounter;
mod episode;
mod facet;
mod feeling;
mod group;
mod halves;
mod library;
mod model;
mod nearby;
mod nearest;
mod orientation;
mod pairs;
mod poses;
mod posterior;
mod ranks;
mod reaches;
mod relief;
mod shifts;
mod spots;
mod strain;
mod strangers;
mod surface;
#[cfg(test)]
mod tests;

pub use asking::NextTouch;
pub use contact::{Contact, Felt, Reached, Seen};
pub use episode::Recognition;
pub use library::{ObjectId, ObjectLibrary};
pub use model::{LevelMemory, ModelPlace, ModelSettings, ObjectModel};
pub use orientation::Orientation;
pub use posterior::{PoseEstimate, Posterior, SURE, Verdict};
