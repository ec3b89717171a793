//! Recordings of motion, matches and sightings through the experience map.
//!
//! A [`Recording`] is what one robot measured, pose by pose. [`CausalRun`] keeps the map relaxed as
//! the poses arrive, and judges each match by what the map expects; [`Refined`] is the map that
//! fits best in the end. Neither reads a clock, so that whoever wants times takes them around
//! [`CausalRun::step`] and [`Refined::of`].

mod causal;
mod consistency;
mod figure;
mod growth;
mod judgement;
mod recording;

pub use causal::CausalRun;
pub use consistency::Consistency;
pub use figure::{Path, figure};
pub use judgement::{GATE_DEVIATIONS, Refined, Verdict};
pub use recording::{Landmark, Matches, Measured, Recording, Step};

#[cfg(test)]
mod tests;
