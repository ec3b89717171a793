//! The chronicle: what agents did and saw, kept so that the past can be smoothed.
//!
//! A chain of *anchors* for each agent, moments that are remembered with the motion from one to the next; on them hang
//! *sightings*, of landmarks and of other agents, and *ties*, to the map (start poses) or between anchors (matches). From
//! these alone follows the refined map: the graph of [`experience`](pose_graph), relaxed.
//!
//! Memory is bounded. When it is full, anchors from which next to nothing is lost are taken out of their chains: the motions
//! to and from them are composed, and what hangs on them goes to a neighbour with the noise of the way there.

mod anchor;
mod aside;
mod chain;
mod checkpoint;
mod coarse;
mod graph;
mod landmarks;
mod life;
mod map;
mod matches;
mod milestones;
mod mooring;
mod names;
mod past_poses;
mod refine;
mod removal;
mod settings;
mod sighting;
mod smoothing;
mod soundness;
mod thinning;
mod tie;

pub use checkpoint::{CorruptKeyframes, KeyframePage};
pub use graph::{KeyframeGraph, Moment};
pub use map::KeyframeMap;
pub use matches::Correction;
pub use place_recognition::{Guess, Relocalised};
pub use refine::{Refined, RefinedAgent, RefinedLandmark, RefinedPose};
pub use settings::KeyframeSettings;
