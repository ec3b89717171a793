//! From the core to messages of the wire: estimates, events, memories and answers.
//!
//! [`decode`](crate::decode) is the other way.

mod agent;
mod episode;
mod event;
mod grid;
mod guidance;
mod identification;
mod landmark;
mod live;
mod localization;
mod object;
mod place;
mod prediction;
mod recall;
mod route;
mod space;
mod surprise;
mod trajectory;
mod trip;

pub use agent::evidence;
pub(crate) use agent::{estimate, odometry};
pub(crate) use episode::{LatestEpisode, ended_episode};
pub(crate) use event::{event_records, skip_reason};
pub use grid::grid_state;
pub(crate) use guidance::journaled_instruction;
pub use guidance::{blockage, blockages, followed_route};
pub use identification::{agent_object, identification};
pub use landmark::landmark;
pub(crate) use live::{live_counts, live_sighting};
pub use localization::localization;
pub use object::{object_detail, object_summary};
pub use place::place;
pub use prediction::prediction;
pub use recall::recall;
pub use route::{fits_in_path, routes, way};
pub use space::space_info;
pub use trajectory::{stamped, trajectory};
pub use trip::{leg, trip, trip_detail};

/// Frame of all positions in answers.
pub const FRAME: &str = "map";
