//! What lies between the places of a model: the surface, predicted from the contacts around.
//!
//! Places that neighbour one another are linked ([`graph`]); the segments and triangles of these
//! links are what is bridged. On them stand *nodes*, so close that a contact between two places has
//! one beside it. Where a node lies and what is felt there follows by kriging ([`kriging`]), a
//! Gaussian process over the places around, whose length and variance are learned from the model's
//! own places by leave-one-out cross-validation ([`field`]). Nothing stands between places where
//! contacts fall on them alone ([`spread`]).
//!
//! Few contacts tell the surface better all together: a superellipsoid through them ([`body`])
//! takes the part of the places around where it predicts those left out better, and its nodes stand
//! on it ([`body_nodes`]).

mod body;
mod body_fit;
mod body_nodes;
mod field;
mod fields;
mod graph;
mod kriging;
mod level_process;
mod neighbours;
mod nodes;
mod open;
mod outline;
mod plane;
mod row;
mod sides;
mod spread;
mod superellipsoid;
mod tails;
mod taken;
mod tuning;
mod unpredicted;

pub(crate) use body::{Body, BodyPoint};
pub(crate) use fields::{FieldVariants, Fields};
pub(crate) use graph::LinkGraph;
pub(crate) use level_process::{LevelProcess, PlacedLevel};
pub(crate) use nodes::interpolated;
pub(crate) use open::{OpenRegion, Part};
pub(crate) use plane::plane_normal;
pub(crate) use spread::{Spread, missed_share};
pub(crate) use unpredicted::UnpredictedGaps;
