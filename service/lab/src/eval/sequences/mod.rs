//! Recall of sequences: trips over a lattice of places that cross themselves, cues with wrong
//! places in them, and how often that comes next which was said to.
//!
//! The trips are random walks in steps from place to place. A cue is a part of one of them that
//! ends at a random place; each of its places is replaced by any other with a probability. Some
//! cues are of places at random, which nobody travelled. A cue is *unique* where an exhaustive
//! comparison with all trips, which knows nothing of probabilities, finds the fewest wrong places
//! before one and the same place only.

mod calibration;
mod cue;
mod walk;

pub use calibration::{Bin, Calibration};
pub use cue::{Cue, Cues};
pub use walk::walks;

/// What is done.
#[derive(Clone, Debug)]
pub struct SequenceProtocol {
    /// Places along an edge of the lattice.
    pub edge: u32,
    /// Number of trips.
    pub trips: u32,
    /// Legs of each trip.
    pub legs: u32,
    /// Cues.
    pub cues: u32,
    /// Places of a cue.
    pub length: u32,
    /// Share of a cue's places that are wrong.
    pub error_rate: f64,
    /// Share of cues that nobody travelled.
    pub none: f64,
    /// Seed of trips and cues.
    pub seed: u64,
}

impl Default for SequenceProtocol {
    fn default() -> Self {
        Self {
            edge: 100,
            trips: 200,
            legs: 300,
            cues: 4000,
            length: 5,
            error_rate: 0.1,
            none: 0.05,
            seed: 1,
        }
    }
}
