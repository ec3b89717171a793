//! From the map to the messages that answer questions about it, and from questions to cues.

mod grid;
mod landmark;
mod localize;
mod object;
mod place;
mod predict;
mod recall;
mod space;
mod trip;

pub use grid::grid_state;
pub use landmark::landmark;
pub use localize::{InvalidSequence, localization, samples_to_localize};
pub use object::{
    InvalidContacts, agent_object, identification, lesson, object_detail, object_summary,
    touches_to_identify,
};
pub use place::place;
pub use predict::{InvalidPrediction, predict};
pub use recall::{InvalidQuery, cue, recall};
pub use space::space_info;
pub use trip::{leg, trip, trip_detail};

/// Frame of all positions in answers.
pub const FRAME: &str = "map";

#[cfg(test)]
mod tests;
