//! Channels: what percepts are sensed on.

use crate::input::Label;
use place_filter::{Compass, Kernel, LearnedCompass, Variogram};
use state::{CorruptState, Moments, State, StateReader, StateWriter, state_of_struct};

/// Least deviation that a level is compared with, as a part of the deviation of its channel's
/// levels. Without it, two equal values at a place would make every later one a wonder.
const FLOOR_PER_CHANNEL_SD: f64 = 0.1;
/// Least deviation as a part of the channel's mean: where all levels were equal, a difference in
/// the last digits of a sensor is none.
const FLOOR_PER_MEAN: f64 = 1e-6;
/// Least deviation of all, in the channel's unit: nothing is divided by zero.
const FLOOR: f64 = 1e-12;

/// Levels over which the deviation of a channel is taken, about: what was long ago is forgotten,
/// also if it was a sensor's sentinel.
const LEVELS: f64 = 1000.0;
/// Levels after which one is bounded before it counts.
const LEVELS_MIN: u64 = 16;
/// A level farther from the channel's mean counts as one at this many deviations.
const FAR: f64 = 10.0;

/// A channel, counted from 0 in the order in which places first remembered something of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ChannelId(pub u8);

/// What a channel carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChannelKind {
    /// Scalars.
    Level,
    /// Unit vectors.
    Descriptor {
        /// How many numbers each has.
        dimension: u16,
    },
}

/// A channel. Percepts with the same label and of another kind or dimension are another channel: a
/// team may have two sorts of camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    label: Label,
    kind: ChannelKind,
    /// Of the latest levels that places remember; empty for descriptors.
    pub(super) levels: Moments,
    /// How levels go together; empty for descriptors.
    pub(super) variogram: Variogram,
    /// Whether levels tell the heading; nothing for descriptors.
    pub(super) compass: Compass,
}

state_of_struct!(Channel {
    label,
    kind,
    levels,
    variogram,
    compass
});

impl Channel {
    /// A channel on which nothing was sensed yet.
    pub(super) fn new(label: Label, kind: ChannelKind) -> Self {
        let levels = Moments::default();
        Self {
            label,
            kind,
            levels,
            variogram: Variogram::default(),
            compass: Compass::default(),
        }
    }

    /// What the channel tells about a position; `None` while that is not known, or if it is
    /// nothing.
    pub(super) fn kernel(&self) -> Option<&Kernel> {
        self.variogram.kernel()
    }

    /// A place has learned a level.
    pub(super) fn learn_level(&mut self, value: f64, weight: f64) {
        let (mean, far) = (self.levels.mean(), FAR * self.levels.sd());
        let bounded = if self.levels.count() >= LEVELS_MIN && far > 0.0 {
            value.clamp(mean - far, mean + far)
        } else {
            value
        };
        self.levels.fade(1.0 - 1.0 / LEVELS);
        self.levels.add(bounded, weight);
    }

    /// Label.
    pub fn label(&self) -> &Label {
        &self.label
    }

    /// What it carries.
    pub fn kind(&self) -> ChannelKind {
        self.kind
    }

    /// How its levels tell a heading; `None` while they are not known to, and for descriptors.
    pub fn compass(&self) -> Option<LearnedCompass> {
        self.compass.learned()
    }

    /// Least deviation that a level is compared with, in the channel's unit: a tenth of the
    /// deviation of the latest thousand or so that places learned, and a little more than nothing.
    /// Single ones far off hardly count.
    pub fn level_sd_floor(&self) -> f64 {
        (FLOOR_PER_CHANNEL_SD * self.levels.sd())
            .max(FLOOR_PER_MEAN * self.levels.mean().abs())
            .max(FLOOR)
    }
}

impl State for ChannelKind {
    fn write(&self, out: &mut StateWriter) {
        // Descriptors have at least eight numbers.
        match self {
            Self::Level => 0u16.write(out),
            Self::Descriptor { dimension } => dimension.write(out),
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(match u16::read(input)? {
            0 => Self::Level,
            dimension => Self::Descriptor { dimension },
        })
    }
}
