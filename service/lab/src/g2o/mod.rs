//! Recordings that are pose graphs in the g2o text format, and the positions they are compared
//! with.

mod recording;
mod reference;

pub use recording::recording;
pub use reference::{Reference, ReferenceError};

#[cfg(test)]
mod tests;
