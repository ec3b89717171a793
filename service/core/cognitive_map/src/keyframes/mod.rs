//! The keyframe graph: past motions and sightings of all agents, kept so that the past can be
//! smoothed.
//!
//! Each agent has a chain of *keyframes*: remembered poses, with the motion from one to the next. A
//! keyframe has *sightings*, of landmarks and of other agents, and *constraints*, to the map (start
//! poses) or to another keyframe (loop closures). Together they are a pose graph; the refined map
//! is its relaxation ([`pose_graph`]).
//!
//! Memory is bounded. When it is full, sparsification removes keyframes from which next to nothing
//! is lost: the motions to and from them are composed, and their sightings and constraints move to
//! a neighbour with the noise of the motion there.
//!
//! | part | holds | file |
//! |---|---|---|
//! | chains | each agent's keyframes, and where the agent is now | `chains` |
//! | sightings | what was seen from keyframes, and the landmarks shown | `sightings` |
//! | constraints | start poses and loop closures, and when closures are judged | `constraints` |
//! | attachments | places that move with keyframes | `attachments` |
//!
//! A relaxation works on a copy of the graph (`relaxation`), with fewer keyframes (`coarse`), as a
//! problem of least squares (`problem`); `closures` brings its outcome back, and `bridge` says
//! where keyframes lie between two of the copy. While samples come in,
//! a relaxation is of the graph as it was at one record (`relaxation_job`), and comes into force at
//! a later one (`adoption`), so that no record waits for it; `meanwhile` has what comes in between.
//!
//! [`KeyframeMap`] is the graph with place recognition, which closes loops by what was seen.

mod adoption;
mod agent_track;
mod attachment;
mod attachments;
mod bridge;
mod calibrations;
mod chains;
mod checkpoint;
mod closures;
mod coarse;
mod constraint;
mod constraints;
mod evidence;
mod graph;
mod instant;
mod keyframe;
mod keyframe_index;
mod landmarks;
mod list;
mod live_estimates;
mod map;
mod match_links;
mod matching;
mod meanwhile;
mod moment;
mod neighbour;
mod observation;
mod odometry_noise;
mod own_frame;
mod pending_relaxation;
mod places;
mod pose_lookup;
mod problem;
mod refined;
mod relaxation;
mod relaxation_job;
mod relaxation_outcome;
mod removal;
mod runs;
mod seen_point;
mod seen_range;
mod settings;
mod sighted;
mod sighting;
mod sightings;
mod sparsification;
mod tuning;
mod view_channel;
mod view_matches;
mod view_tracking;

pub use checkpoint::{CorruptKeyframes, KeyframePage};
pub use graph::KeyframeGraph;
pub use live_estimates::LiveEstimates;
pub use map::KeyframeMap;
pub use moment::Moment;
pub use place_recognition::{
    Found, Guess, LearnedChannel, Relocalised, SampleKey, SensedTurn, View, ViewMatch,
};
pub use refined::{Refined, RefinedAgent, RefinedLandmark, RefinedPose};
pub use relaxation::Correction;
pub use relaxation_job::RelaxationJob;
pub use settings::KeyframeSettings;
pub use view_channel::ViewChannel;
