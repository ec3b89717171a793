//! The pure core of cogmap: a cognitive map as a deterministic fold over a journal of samples.

pub mod chronicle;
pub mod estimation;

mod agent;
mod cognitive_map;
mod event;
mod input;
mod landmark;
mod object;
mod percept;
mod place;
mod recall;
mod settings;
mod strength;
mod trip;

pub use agent::{Agent, Status};
pub use chronicle::Guess;
pub use cognitive_map::{
    CheckpointPage, CognitiveMap, CorruptCheckpoint, Localization, Predicted, Prediction,
};
pub use event::{Event, EventKind};
pub use input::{
    AgentId, Descriptor, InvalidSample, Label, Lesson, Level, Marker, Motion, ObjectMark,
    PoseNoise, RangeBearing, Record, Relation, RelativePose, RelativePosition, Sample, SampleBody,
    Sighting, SkipReason, Spacing, StartPose, Target, Touch, TouchLevel, TouchNoise,
};
pub use landmark::{Landmark, LandmarkId};
pub use object::{Identified, KnownObject};
pub use percept::{Channel, ChannelId, ChannelKind, Expected, PerceptCue, Remembered};
pub use place::{Place, PlaceId};
pub use recall::{RecallCue, Recalled, Rivals};
pub use settings::{InvalidSettings, Recruitment, Settings, SettingsValues};
pub use state::{Digest, InvalidDigest};
pub use trip::{Leg, Trip, TripEnd, TripId};
