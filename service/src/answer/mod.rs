//! From the map to the messages that answer questions about it, and from questions to cues.

mod channel;
mod grid;
mod landmark;
mod localize;
mod named;
mod object;
mod place;
mod predict;
mod problem;
mod recall;
mod space;
mod trip;

pub use channel::InvalidChannel;
pub use grid::grid_state;
pub use landmark::landmark;
pub use localize::{InvalidSequence, localization, samples_to_localize};
pub use named::{agent_named, agent_once_named, any_space_named, nobody_named, space_named};
pub use object::{
    InvalidContacts, agent_object, identification, journaled_lesson, lesson, object_detail,
    object_summary, touches_to_identify,
};
pub use place::place;
pub use predict::{InvalidPrediction, predict};
pub use problem::{Expected, Kind, Problem};
pub use recall::{InvalidQuery, cue, recall, unknown_agent};
pub use space::space_info;
pub use trip::{leg, trip, trip_detail};

/// Frame of all positions in answers.
pub const FRAME: &str = "map";

#[cfg(test)]
mod tests;
