//! Contacts: the observations of an episode.

use std::sync::Arc;

use nalgebra::{Point3, Unit, Vector3};

/// A scalar measured on a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelReading {
    /// Channel, as the caller numbers them.
    pub channel: u16,
    /// Value, in the channel's unit.
    pub value: f64,
    /// Standard deviation of its noise, in the channel's unit.
    pub sd: f64,
}

/// A descriptor measured on a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct DescriptorReading {
    /// Channel, as the caller numbers them.
    pub channel: u16,
    /// Unit vector.
    pub vector: Arc<[f32]>,
}

/// How a contact was reached, which decides what its position says about the object's size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Reached {
    /// By a walk: anywhere on the object, or within a step of the contact before.
    #[default]
    Found,
    /// Drawn evenly from the whole object, wherever the contact before was.
    Drawn,
    /// Asked for: its position is the asker's choice, and only its distance to the surface counts.
    Aimed,
}

/// One contact with what is to be recognised: a touch, or a place passed.
#[derive(Clone, Debug, PartialEq)]
pub struct Contact {
    /// Position \[m\] in the episode's own frame, by path integration.
    pub position_m: Point3<f64>,
    /// Standard deviation of its own noise, per axis \[m\].
    pub position_sd_m: f64,
    /// Standard deviation of the drift of path integration since the episode began, per axis \[m\];
    /// not less than that of the contact before.
    pub drift_sd_m: f64,
    /// The surface's outward normal, in the episode's frame.
    pub normal: Option<Unit<Vector3<f64>>>,
    /// Standard deviation of the normal's direction, per axis \[rad\].
    pub normal_sd_rad: f64,
    /// Levels, at most one per channel.
    pub levels: Vec<LevelReading>,
    /// Descriptors, at most one per channel.
    pub descriptors: Vec<DescriptorReading>,
    /// How it was reached.
    pub reached: Reached,
}

impl Contact {
    /// A contact at a position with `position_sd_m` \[m\] of noise per axis, and nothing else.
    pub fn at(position_m: Point3<f64>, position_sd_m: f64) -> Self {
        Self {
            position_m,
            position_sd_m,
            drift_sd_m: 0.0,
            normal: None,
            normal_sd_rad: 0.0,
            levels: Vec::new(),
            descriptors: Vec::new(),
            reached: Reached::Found,
        }
    }

    /// The same with the surface's outward normal there and its noise per axis \[rad\].
    #[must_use]
    pub fn with_normal(mut self, normal: Unit<Vector3<f64>>, sd_rad: f64) -> Self {
        self.normal = Some(normal);
        self.normal_sd_rad = sd_rad;
        self
    }

    /// The same with a level.
    #[must_use]
    pub fn with_level(mut self, channel: u16, value: f64, sd: f64) -> Self {
        self.levels.push(LevelReading { channel, value, sd });
        self
    }

    /// The same with the drift of path integration since the episode began, per axis \[m\].
    #[must_use]
    pub fn with_drift(mut self, drift_sd_m: f64) -> Self {
        self.drift_sd_m = drift_sd_m;
        self
    }

    /// The same, drawn evenly from the whole object.
    #[must_use]
    pub fn drawn(mut self) -> Self {
        self.reached = Reached::Drawn;
        self
    }

    /// The same, asked for.
    #[must_use]
    pub fn aimed(mut self) -> Self {
        self.reached = Reached::Aimed;
        self
    }

    /// Its level on a channel.
    pub(crate) fn level(&self, channel: u16) -> Option<&LevelReading> {
        self.levels.iter().find(|own| own.channel == channel)
    }

    /// The same without levels and descriptors.
    pub(crate) fn bare(&self) -> Self {
        Self {
            levels: Vec::new(),
            descriptors: Vec::new(),
            ..*self
        }
    }

    /// Variance of its position in the episode's frame, per axis \[m²\].
    pub(crate) fn variance_m2(&self) -> f64 {
        self.position_sd_m * self.position_sd_m + self.drift_sd_m * self.drift_sd_m
    }
}
