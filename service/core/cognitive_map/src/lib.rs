#![doc = include_str!("../README.md")]

pub mod estimator;
pub mod keyframes;

mod agent;
mod event;
mod fold;
mod guidance;
mod input;
mod label_index;
mod memory;
mod route;
mod settings;

pub use agent::{Agent, Status};
pub use event::{Event, EventKind, LoopsClosed, RouteFailure, RouteLeft};
pub use fold::{
    CheckpointPage, CognitiveMap, CorruptCheckpoint, Felt, FeltCue, FeltPlace, Localization,
    Looked, Predicted, Prediction,
};
pub use input::{
    AgentId, Descriptor, Errand, Goal, Instruction, InvalidSample, Label, Lesson, Level, Marker,
    Motion, NoisyPose, ObjectMark, PoseNoise, Range, RangeBearing, Record, Relation, RelativePose,
    RelativePosition, RememberedPlace, RememberedTraversals, RememberedWay, Remembrance, Retrace,
    Sample, SampleBody, Sighting, SkipReason, Spacing, StartPose, Target, Touch, TouchLevel,
    TouchNoise,
};
pub use keyframes::{Guess, LearnedChannel, RelaxationJob, SampleKey, ViewChannel, ViewMatch};
pub use memory::blockage::{BLOCKAGES_MAX, Ball, Blockage, BlockageId, Blocked};
pub use memory::landmark::{Landmark, LandmarkId};
pub use memory::object::{Identified, IndexingJob, KnownObject};
pub use memory::percept::{
    Channel, ChannelId, ChannelKind, Expected, FeltPercept, PerceptCue, Remembered,
};
pub use memory::place::{Place, PlaceId};
pub use memory::recall::{RecallCue, Recalled, Rivals};
pub use memory::sequence::{
    NextPlace, SequenceCue, SequenceElement, SequenceMatch, SequenceRecall,
};
pub use memory::trip::{Leg, Trip, TripEnd, TripId};
pub use memory::way::{Traversals, Way, Waypoint};
pub use place_filter::{HeadingModel, LearnedCompass};
pub use route::{
    Back, Following, NoRoute, NoRouteEnd, Region, Reverse, Route, RouteBounds, RouteCost, RouteEnd,
    RouteOptions, RouteStep, StepKind, ThinnedTraversal, ThinnedWay,
};
pub use settings::{Bound, InvalidSettings, Recruitment, SettingNumber, Settings, SettingsValues};
pub use state::{Digest, InvalidDigest};
