#![doc = include_str!("../README.md")]

mod appearance;
mod descriptor;
mod keyframes;
mod levenberg_marquardt;
mod particle_numbers;
mod recognition;
mod relocalisation;
mod sequences;
mod similarity;
mod tracking;
mod tuning;
mod view;
mod views;
mod waking;

pub use descriptor::dot;
pub use keyframes::{Keyframes, SampleKey};
pub use recognition::{Guess, Part, PlaceRecognition, Relocalised, Revisit};
pub use similarity::{LearnedChannel, Similarity, Turned, ViewLog, ViewMatch};
pub use tracking::{Tracked, ViewMap};
pub use view::{SensedTurn, View};
pub use waking::Found;
