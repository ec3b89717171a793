//! From the core to messages of the wire: estimates, events, memories and answers.
//!
//! [`decode`](crate::decode) is the other way.

mod agent;
mod channel;
mod episode;
mod event;
mod felt;
mod grid;
mod guidance;
mod identification;
mod landmark;
mod live;
mod localization;
mod map_export;
mod object;
mod place;
mod prediction;
mod recall;
mod route;
mod sequence;
mod space;
mod surprise;
mod trajectory;
mod trip;
mod way_graph;

pub use agent::evidence;
pub(crate) use agent::{estimate, odometry};
pub use channel::channels;
pub(crate) use episode::{LatestEpisode, ended_episode};
pub(crate) use event::{event_records, skip_reason};
pub use felt::felt;
pub use grid::grid_state;
pub(crate) use guidance::journaled_instruction;
pub use guidance::{blockage, blockages, followed_route, followed_summary};
pub use identification::{agent_object, identification};
pub use landmark::landmark;
pub(crate) use live::{live_counts, live_sighting};
pub use localization::localization;
pub use map_export::{agent_summaries, map_export};
pub use object::{object_alike, object_detail, object_summary};
pub use place::place;
pub use prediction::{place_percepts, prediction};
pub use recall::recall;
pub use route::{fits_in_path, routes, way};
pub use sequence::sequence;
pub use space::space_info;
pub use trajectory::{agent_at, stamped, trajectory};
pub use trip::{leg, trip, trip_detail};
pub use way_graph::{RouteGraph, graphml, nav2};

/// Frame of all positions in answers.
pub const FRAME: &str = "map";

/// Frame of the estimate of an agent that nothing ties to the map.
pub const UNPLACED_FRAME: &str = "unplaced";
