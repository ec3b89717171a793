#![doc = include_str!("../README.md")]

mod compass;
mod exponential;
mod field;
mod filter;
mod follow;
mod kernel;
mod linear;
mod prediction;
mod search;
mod trace;
mod tuning;
mod variogram;
mod window;

pub use compass::{Compass, HeadingModel, LearnedCompass, Stretch};
pub use field::Field;
pub use filter::{PlaceFilter, SensedLevel};
pub use follow::{Measured, Measurement};
pub use kernel::Kernel;
pub use prediction::{Prediction, Support};
pub use search::{Found, Seeker};
pub use trace::Trace;
pub use variogram::Variogram;
