//! One place of a model, ready for recognition.

use nalgebra::{Matrix3, Point3, Unit, Vector3};

use crate::contact::{Contact, DescriptorReading};
use crate::level_prior::LevelPrior;
use crate::model::LevelMemory;
use crate::tuning::{DESCRIPTOR_SCALE, WRONG_PERCEPT_SHARE};

/// One place of a model.
#[derive(Clone, Debug)]
pub(crate) struct IndexedPlace {
    pub(crate) position: Point3<f64>,
    pub(crate) normal: Option<Unit<Vector3<f64>>>,
    /// Variance of a touch of this place about `position`, without the touch's noise, per axis
    /// \[m²\].
    pub(crate) variance_m2: f64,
    /// How it was predicted; none of a place that was felt.
    pub(crate) prediction: Option<Prediction>,
    pub(crate) levels: Vec<LevelMemory>,
    pub(crate) descriptors: Vec<DescriptorReading>,
}

/// How a place was predicted from the places around.
#[derive(Clone, Debug)]
pub(crate) struct Prediction {
    /// Standard deviation of its error across the surface, per axis \[m\].
    pub(crate) error_m: f64,
    pub(crate) across: Across,
    /// Variance across the surface by which it may bend within the place's field, per axis \[m²\].
    pub(crate) bend_m2: f64,
}

impl Prediction {
    /// Variance of a touch across the surface, without the touch's noise \[m²\].
    pub(crate) fn across_m2(&self) -> f64 {
        self.error_m * self.error_m + self.bend_m2
    }
}

/// What is across a surface: one direction, across a curve two, and all where neither was found.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Across {
    /// Projects an offset on it.
    pub(crate) projection: Matrix3<f64>,
    /// Its dimensions, from 1 to 3.
    pub(crate) dimensions: i32,
}

impl Across {
    /// Of a surface or a curve along these perpendicular axes.
    pub(crate) fn new<'a>(along: impl Iterator<Item = &'a Vector3<f64>>) -> Self {
        let all = Self {
            projection: Matrix3::identity(),
            dimensions: 3,
        };
        along.fold(all, |own, axis| Self {
            projection: own.projection - axis * axis.transpose(),
            dimensions: own.dimensions - 1,
        })
    }

    /// Share of it that is across another surface as well.
    pub(crate) fn common(&self, other: &Self) -> f64 {
        let common = self.projection.dot(&other.projection) / f64::from(self.dimensions.max(1));
        common.clamp(0.0, 1.0)
    }
}

impl IndexedPlace {
    /// Its level on a channel.
    pub(crate) fn level(&self, channel: u16) -> Option<&LevelMemory> {
        self.levels.iter().find(|own| own.channel == channel)
    }

    /// Log likelihood ratio of a contact's levels and descriptors: at this place, against anywhere.
    pub(crate) fn percept_log(&self, contact: &Contact, level_prior: &[LevelPrior]) -> f64 {
        let mut sum = 0.0;
        for reading in &contact.levels {
            let own = self.level(reading.channel);
            let prior = LevelPrior::of(level_prior, reading.channel);
            if let Some((own, prior)) = own.zip(prior) {
                sum += prior.rated(reading).ratio(own.mean, own.variance()).ln();
            }
        }
        sum + self.descriptor_log(contact)
    }

    /// The same of its descriptors alone.
    pub(crate) fn descriptor_log(&self, contact: &Contact) -> f64 {
        let mut sum = 0.0;
        for reading in &contact.descriptors {
            let own = self
                .descriptors
                .iter()
                .find(|own| own.channel == reading.channel);
            if let Some(own) = own {
                let cos: f64 = reading
                    .vector
                    .iter()
                    .zip(own.vector.iter())
                    .map(|(a, b)| f64::from(a * b))
                    .sum();
                let here = (-(1.0 - cos) / DESCRIPTOR_SCALE).exp() / DESCRIPTOR_SCALE;
                sum += ((1.0 - WRONG_PERCEPT_SHARE) * here + WRONG_PERCEPT_SHARE).ln();
            }
        }
        sum
    }
}
