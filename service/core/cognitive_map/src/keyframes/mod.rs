//! The keyframe graph: what agents did and saw, kept so that the past can be smoothed.
//!
//! A chain of *keyframes* for each agent, moments that are remembered with the motion from one to the next; on them hang
//! *sightings*, of landmarks and of other agents, and *constraints*, to the map (start poses) or between keyframes (matches). From
//! these alone follows the refined map: the graph of [`experience`](pose_graph), relaxed.
//!
//! Memory is bounded. When it is full, keyframes from which next to nothing is lost are taken out of their chains: the motions
//! to and from them are composed, and what hangs on them goes to a neighbour with the noise of the way there.

mod agent_track;
mod aside;
mod attachment;
mod calibration_smoothing;
mod chain;
mod checkpoint;
mod closures;
mod coarse;
mod constraint;
mod graph;
mod keyframe;
mod keyframe_index;
mod landmark_association;
mod landmarks;
mod map;
mod pose_lookup;
mod refined;
mod removal;
mod settings;
mod sighting;
mod soundness;
mod sparsification;

pub use checkpoint::{CorruptKeyframes, KeyframePage};
pub use closures::Correction;
pub use graph::{KeyframeGraph, Moment};
pub use map::KeyframeMap;
pub use place_recognition::{Guess, Relocalised};
pub use refined::{Refined, RefinedAgent, RefinedLandmark, RefinedPose};
pub use settings::KeyframeSettings;
