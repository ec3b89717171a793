//! The pure core of cogmap: a cognitive map as a deterministic fold over a journal of samples.

pub mod chronicle;
pub mod estimation;
pub mod experience;
pub mod geometry;
pub mod grid;
pub mod recognition;

mod agent;
mod cognitive_map;
mod digest;
mod event;
mod landmark;
mod object;
mod paged;
mod percept;
mod place;
mod random;
mod recall;
mod record;
mod sample;
mod settings;
mod sparse;
mod state;
mod strength;
mod summary;
mod trip;

pub use agent::{Agent, Status};
pub use chronicle::Guess;
pub use cognitive_map::{
    CheckpointPage, CognitiveMap, CorruptCheckpoint, Localization, Predicted, Prediction,
};
pub use digest::{Digest, InvalidDigest};
pub use event::{Event, EventKind};
pub use landmark::{Landmark, LandmarkId};
pub use object::{
    Identified, KnownObject, Lesson, ObjectMark, Spacing, Touch, TouchLevel, TouchNoise,
};
pub use percept::{Channel, ChannelId, ChannelKind, Expected, PerceptCue, Remembered};
pub use place::{Place, PlaceId};
pub use recall::{RecallCue, Recalled, Rivals};
pub use record::{AgentId, Record, SkipReason};
pub use sample::{
    Descriptor, InvalidSample, Label, Level, Marker, Motion, PoseNoise, RangeBearing, Relation,
    RelativePose, RelativePosition, Sample, SampleBody, Sighting, StartPose, Target,
};
pub use settings::{InvalidSettings, Recruitment, Settings, SettingsValues};
pub use trip::{Leg, Trip, TripEnd, TripId};
