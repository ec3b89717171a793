//! Percepts: what places remember of what was sensed and seen there.
//!
//! A percept and the place that answers where it was sensed are active together, and that
//! strengthens the association between the two in proportion to the place's confidence there: the
//! Hebbian rule with the percept's activity at one. It is read both ways: a percept recalls places,
//! and a place (so a position, a grid code or the end of a motion) recalls percepts.

mod channel;
mod descriptor;
mod level;
mod map;
mod sketch;

pub use channel::{Channel, ChannelId, ChannelKind};
pub(crate) use level::Sensed;
pub(crate) use map::{CHANNEL_PAGES_MAX, Compared, PerceptMap};

use crate::input::{Descriptor, Label};
use crate::memory::ids::PlaceId;

/// A percept to recall places by.
#[derive(Clone, Debug, PartialEq)]
pub enum PerceptCue {
    /// A level.
    Level {
        /// Channel.
        channel: Label,
        /// Value, in the channel's unit.
        value: f64,
    },
    /// A descriptor.
    Descriptor(Descriptor),
}

/// What a place remembers of a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Remembered {
    /// The place.
    pub place: PlaceId,
    /// The channel.
    pub channel: ChannelId,
    /// Number of percepts that taught it.
    pub percepts: u64,
    /// Strength of the association: the sum of the place's confidences when they were sensed.
    pub strength: f64,
    /// What they were like.
    pub expected: Expected,
}

/// When a place learned of a channel last, and what levels were like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeltPercept {
    /// The channel.
    pub channel: ChannelId,
    /// Number of percepts that taught the place.
    pub percepts: u64,
    /// Strength of the association: the sum of the place's confidences when they were sensed.
    pub strength: f64,
    /// Latest stamp of one of them \[ns\].
    pub last_stamp_ns: i64,
    /// Mean of levels, in the channel's unit, and their standard deviation; `None` of descriptors.
    pub level: Option<(f64, f64)>,
}

/// What a percept is expected to be like.
#[derive(Clone, Debug, PartialEq)]
pub enum Expected {
    /// A level.
    Level {
        /// Mean, in the channel's unit.
        mean: f64,
        /// Standard deviation of single values about it; 0 after the first one.
        sd: f64,
    },
    /// A descriptor: the mean direction, a unit vector. All zeros if what was seen cancels out.
    Descriptor(Box<[f32]>),
}
