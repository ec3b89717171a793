//! What lies between the places of a model: the surface, predicted from the contacts around.
//!
//! Places that neighbour one another are linked ([`graph`]); the segments and triangles of these
//! links are what is bridged. On them stand *nodes*, so close that a contact between two places has
//! one beside it. Where a node lies and what is felt there follows by kriging ([`kriging`]), a
//! Gaussian process over the places around, whose length and variance are learned from the model's
//! own places by leave-one-out cross-validation ([`field`]). Nothing stands between places where
//! contacts fall on them alone ([`spread`]).

mod field;
mod graph;
mod kriging;
mod nodes;
mod open;
mod sides;
mod spread;
mod taken;
mod unpredicted;

pub(crate) use graph::LinkGraph;
pub(crate) use nodes::{Fields, interpolated};
pub(crate) use open::{OpenRegion, Part};
pub(crate) use spread::{Spread, missed_share};
pub(crate) use unpredicted::UnpredictedGaps;
