//! From messages of the wire and entries of the journal to what the core takes: the only place that
//! refuses what makes no sense, and the only one that reads a message for the core.
//!
//! [`encode`](crate::encode) is the other way.

mod bounds;
mod channel;
mod contact;
mod cue;
mod fault;
mod felt;
mod instruction;
mod journal;
mod lesson;
mod localize;
mod map_import;
mod motion;
mod name;
mod percept;
mod prediction;
mod remembrance;
mod route;
mod sample;
mod sequence;
mod settings;
mod sighting;
mod trajectory;

pub use bounds::{Bound, setting_bounds};
pub use channel::InvalidChannel;
pub use cue::{InvalidQuery, cue, unknown_agent};
pub use fault::refusal;
pub use felt::felt;
pub use instruction::{blockage, errand};
pub use journal::records_of;
pub use lesson::{InvalidContacts, lesson, touches_to_identify};
pub use localize::{InvalidSequence, samples_to_localize};
pub use map_import::{InvalidImport, MapImport, map_import};
pub use prediction::{InvalidPrediction, PredictionCue, prediction};
pub use route::{InvalidRoute, RouteQuestion, route};
pub use sample::{journaled_sample, sample};
pub use sequence::{InvalidSequenceQuery, sequence};
pub use settings::{core_settings, trajectory_interval_ns};
pub use trajectory::stamped_pose;
