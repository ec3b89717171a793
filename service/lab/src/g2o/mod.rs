//! Pose graphs in the g2o text format as a robot would have sent them.

mod samples;

pub use samples::{UnfitGraph, stream};

#[cfg(test)]
mod tests;
