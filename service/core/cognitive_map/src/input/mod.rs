//! Input of the fold: records of samples that make sense.
//!
//! Constructors refuse what could not have been sensed, so an invalid sample can't exist further
//! in.

mod agent_id;
mod instruction;
mod invalid;
mod label;
mod motion;
mod noisy_pose;
mod object_mark;
mod percept;
mod range;
mod record;
mod remembrance;
mod sample;
mod sighting;
mod touch;

pub use agent_id::AgentId;
pub use instruction::{Errand, Goal, Instruction, Retrace};
pub use invalid::InvalidSample;
pub use label::Label;
pub use motion::{Motion, StartPose};
pub use noisy_pose::{NoisyPose, PoseNoise};
pub use object_mark::{ObjectMark, Spacing, TouchNoise};
pub(crate) use percept::LEVEL_MAX;
pub use percept::{Descriptor, Level};
pub use range::Range;
pub use record::{Record, SkipReason};
pub use remembrance::{RememberedPlace, RememberedTraversals, RememberedWay, Remembrance};
pub use sample::{Marker, Sample, SampleBody};
pub use sighting::{RangeBearing, Relation, RelativePose, RelativePosition, Sighting, Target};
pub use touch::{Lesson, Touch, TouchLevel};
