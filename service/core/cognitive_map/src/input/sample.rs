//! Samples: what one agent did or sensed at an instant.

use super::{Descriptor, Label, Level, Motion, ObjectMark, Sighting, StartPose};

/// One valid sample.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Time on the sensor's clock \[ns\].
    pub stamp_ns: i64,
    /// What was sampled.
    pub body: SampleBody,
}

/// What a sample says.
#[derive(Clone, Debug, PartialEq)]
pub enum SampleBody {
    /// A displacement of the body since the previous motion sample.
    Motion(Motion),
    /// A scalar sensed on a channel.
    Level(Level),
    /// A unit vector seen on a channel.
    Descriptor(Descriptor),
    /// A target seen relative to the body.
    Sighting(Sighting),
    /// Pose of the agent in `map`, stated from outside.
    StartPose(StartPose),
    /// A named moment.
    Marker(Marker),
    /// An episode with an object begins or ends.
    Object(ObjectMark),
    /// The session ends here, and the trip under way with it.
    SessionEnd,
}

/// A named moment.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Marker {
    /// Its label.
    pub label: Label,
    /// Whether the trip under way ends here.
    pub ends_trip: bool,
}
