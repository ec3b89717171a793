//! Percepts: levels that are sensed, descriptors that are seen.

use nalgebra::{Unit, Vector3};

use super::invalid::{METRES_MAX, UNIT_TOLERANCE, bounded};
use super::{InvalidSample, Label};

/// Shortest and longest descriptor.
const DESCRIPTOR_LEN: std::ops::RangeInclusive<usize> = 8..=4096;

/// The largest level that places and objects remember, in either direction: no unit makes larger
/// ones, and a program's largest float, sent for "nothing", is beyond it.
pub(crate) const LEVEL_MAX: f64 = 1e30;

/// A scalar on a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Level {
    channel: Label,
    value: f64,
    offset_m: Vector3<f64>,
    normal: Option<Unit<Vector3<f64>>>,
}

impl Level {
    /// `offset_m` is where the sensor sits in the body frame, `normal` the surface's normal there.
    ///
    /// # Errors
    /// A number is out of range, or the normal is not a unit vector.
    pub fn new(
        channel: Label,
        value: f64,
        offset_m: [f64; 3],
        normal: Option<[f64; 3]>,
    ) -> Result<Self, InvalidSample> {
        if !value.is_finite() {
            return Err(InvalidSample::NumberOutOfRange);
        }
        let offset_m = bounded(offset_m, METRES_MAX)?;
        let normal = match normal {
            None => None,
            Some(normal) => {
                let normal = bounded(normal, METRES_MAX)?;
                if (normal.norm() - 1.0).abs() > UNIT_TOLERANCE {
                    return Err(InvalidSample::InvalidNormal);
                }
                Some(Unit::new_normalize(normal))
            }
        };
        Ok(Self {
            channel,
            value,
            offset_m,
            normal,
        })
    }

    /// Channel.
    pub fn channel(&self) -> &Label {
        &self.channel
    }

    /// Value, in the channel's unit.
    pub fn value(&self) -> f64 {
        self.value
    }

    /// Where the sensor sits in the body frame \[m\].
    pub fn offset_m(&self) -> &Vector3<f64> {
        &self.offset_m
    }

    /// Surface normal in the body frame.
    pub fn normal(&self) -> Option<&Unit<Vector3<f64>>> {
        self.normal.as_ref()
    }
}

/// A unit vector on a channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Descriptor {
    channel: Label,
    vector: Box<[f32]>,
}

impl Descriptor {
    /// Normalises the vector.
    ///
    /// # Errors
    /// The vector is too short, too long, not finite or zero.
    pub fn new(channel: Label, vector: &[f32]) -> Result<Self, InvalidSample> {
        let norm = vector
            .iter()
            .map(|&x| f64::from(x) * f64::from(x))
            .sum::<f64>()
            .sqrt();
        if !DESCRIPTOR_LEN.contains(&vector.len()) || !norm.is_finite() || norm < 1e-12 {
            return Err(InvalidSample::InvalidDescriptor);
        }
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a component of a unit vector fits f32"
        )]
        let vector = vector
            .iter()
            .map(|&x| (f64::from(x) / norm) as f32)
            .collect();
        Ok(Self { channel, vector })
    }

    /// Channel.
    pub fn channel(&self) -> &Label {
        &self.channel
    }

    /// The unit vector.
    pub fn vector(&self) -> &[f32] {
        &self.vector
    }
}
