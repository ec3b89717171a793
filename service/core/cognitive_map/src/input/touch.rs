//! Contacts as they are stated from outside, with the names of their channels.

use std::sync::Arc;

use nalgebra::{Point3, Unit, Vector3};

use super::{Descriptor, InvalidSample, LEVEL_MAX, Label, Level, Spacing, TouchNoise};
use object_recognition::{Contact, DescriptorReading, LevelReading, Reached};

/// A level that was sensed at a contact.
#[derive(Clone, Debug, PartialEq)]
pub struct TouchLevel {
    channel: Label,
    value: f64,
    sd: f64,
}

impl TouchLevel {
    /// A value in its channel's unit, with the standard deviation of its noise.
    ///
    /// # Errors
    /// A number is not finite, or the deviation negative.
    pub fn new(channel: Label, value: f64, sd: f64) -> Result<Self, InvalidSample> {
        if !value.is_finite() || !sd.is_finite() {
            return Err(InvalidSample::NumberOutOfRange);
        }
        if sd < 0.0 {
            return Err(InvalidSample::NegativeNoise);
        }
        Ok(Self { channel, value, sd })
    }
}

/// A contact, in a frame of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Touch {
    position: Point3<f64>,
    normal: Option<Unit<Vector3<f64>>>,
    levels: Vec<TouchLevel>,
    descriptors: Vec<Descriptor>,
    noise: TouchNoise,
    drift_sd_m: f64,
    reached: Reached,
}

impl Touch {
    /// Largest coordinate of a contact \[m\].
    pub const POSITION_MAX_M: f64 = 1e6;

    /// A contact at a position \[m\].
    ///
    /// # Errors
    /// A coordinate is out of range.
    pub fn new(position_m: [f64; 3], noise: TouchNoise) -> Result<Self, InvalidSample> {
        if !position_m.iter().all(|x| x.abs() <= Self::POSITION_MAX_M) {
            return Err(InvalidSample::NumberOutOfRange);
        }
        Ok(Self {
            position: Point3::from(position_m),
            normal: None,
            levels: Vec::new(),
            descriptors: Vec::new(),
            noise,
            drift_sd_m: 0.0,
            reached: Reached::Found,
        })
    }

    /// The same with the surface's outward normal.
    ///
    /// # Errors
    /// It is not a unit vector.
    pub fn with_normal(mut self, normal: [f64; 3]) -> Result<Self, InvalidSample> {
        // The rule of a level's normal.
        let level = Level::new(Label::new("normal")?, 0.0, [0.0; 3], Some(normal))?;
        self.normal = level.normal().copied();
        Ok(self)
    }

    /// The same with what was sensed.
    #[must_use]
    pub fn with_levels(mut self, levels: Vec<TouchLevel>) -> Self {
        self.levels = levels;
        self
    }

    /// The same with what was seen.
    #[must_use]
    pub fn with_descriptors(mut self, descriptors: Vec<Descriptor>) -> Self {
        self.descriptors = descriptors;
        self
    }

    /// The same with what path integration has drifted since the first contact, per axis \[m\].
    ///
    /// # Errors
    /// The number is not finite or negative.
    pub fn with_drift(mut self, drift_sd_m: f64) -> Result<Self, InvalidSample> {
        TouchNoise::new(drift_sd_m, 0.0, 0.0)?;
        self.drift_sd_m = drift_sd_m;
        Ok(self)
    }

    /// The same, come by in this way.
    #[must_use]
    pub fn reached(mut self, reached: Reached) -> Self {
        self.reached = reached;
        self
    }

    /// As a contact, with channels by number; one without a number is left out, and a level that no
    /// object would remember.
    pub(crate) fn contact(&self, mut number: impl FnMut(&Label) -> Option<u16>) -> Contact {
        let mut contact = Contact::at(self.position, self.noise.position_sd_m());
        contact.drift_sd_m = self.drift_sd_m;
        contact.normal = self.normal;
        contact.normal_sd_rad = self.noise.normal_sd_rad();
        contact.reached = self.reached;
        let is_sense = |level: &&TouchLevel| level.value.abs() <= LEVEL_MAX;
        for level in self.levels.iter().filter(is_sense) {
            let felt = number(&level.channel).map(|channel| LevelReading {
                channel,
                value: level.value,
                sd: level.sd,
            });
            let is_new =
                |felt: &LevelReading| contact.levels.iter().all(|l| l.channel != felt.channel);
            if let Some(felt) = felt.filter(is_new) {
                contact.levels.push(felt);
            }
        }
        for descriptor in &self.descriptors {
            let seen = number(descriptor.channel()).map(|channel| DescriptorReading {
                channel,
                vector: Arc::from(descriptor.vector()),
            });
            let is_new = |seen: &DescriptorReading| {
                contact
                    .descriptors
                    .iter()
                    .all(|d| d.channel != seen.channel)
            };
            if let Some(seen) = seen.filter(is_new) {
                contact.descriptors.push(seen);
            }
        }
        contact
    }
}

/// An object taught at once: contacts in its own frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Lesson {
    pub(crate) spacing: Spacing,
    pub(crate) touches: Vec<Touch>,
}

impl Lesson {
    /// Contacts within `spacing` of each other are of one place.
    pub fn new(spacing: Spacing, touches: Vec<Touch>) -> Self {
        Self { spacing, touches }
    }
}
