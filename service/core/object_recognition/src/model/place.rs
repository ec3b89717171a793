//! One place of a model: the contacts that were merged into it.

use nalgebra::{Point3, Unit, Vector3};

use crate::contact::{Contact, DescriptorReading, LevelReading};
use crate::tuning::SAME_SIDE_COS;

/// Moments of the levels of one channel at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelMemory {
    /// Channel.
    pub channel: u16,
    /// Number of levels.
    pub count: f64,
    /// Mean.
    pub mean: f64,
    /// Sum of squared differences from the mean.
    pub squares: f64,
    /// Sum of the levels' own noise variances.
    pub noise: f64,
}

impl LevelMemory {
    fn add(&mut self, other: &Self) {
        let count = self.count + other.count;
        let apart = other.mean - self.mean;
        self.squares += other.squares + apart * apart * self.count * other.count / count;
        self.mean += apart * other.count / count;
        self.noise += other.noise;
        self.count = count;
    }

    /// Variance of a noiseless level here about the mean: that of the mean's error, and the scatter
    /// of the levels beyond their noise.
    pub fn variance(&self) -> f64 {
        let noise = self.noise / self.count;
        let scatter = if self.count > 1.5 {
            (self.squares / (self.count - 1.0) - noise).max(0.0)
        } else {
            0.0
        };
        scatter + (noise + scatter) / self.count
    }
}

/// One learned place of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelPlace {
    /// Mean position of its contacts \[m\], in the model's frame.
    pub position_m: Point3<f64>,
    /// Sum of their normals; zero without any.
    pub normals: Vector3<f64>,
    /// Contacts.
    pub count: f64,
    /// Visits: contacts one after the other are one.
    pub visits: f64,
    /// Sum of the contacts' position variances per axis \[m²\].
    pub variance_m2: f64,
    /// Sum of the normals' variances per axis \[rad²\].
    pub normal_variance: f64,
    /// Levels by channel.
    pub levels: Vec<LevelMemory>,
    /// Descriptors by channel: the first one seen.
    pub descriptors: Vec<DescriptorReading>,
}

impl ModelPlace {
    /// The outward normal, if any contact had one.
    pub fn normal(&self) -> Option<Unit<Vector3<f64>>> {
        Unit::try_new(self.normals, 1e-9)
    }

    /// A contact with this place, with the mean noise of those it was learned from.
    pub fn contact(&self) -> Contact {
        let mut contact = Contact::at(self.position_m, (self.variance_m2 / self.count).sqrt());
        if let Some(normal) = self.normal() {
            contact = contact.with_normal(normal, (self.normal_variance / self.count).sqrt());
        }
        contact
            .levels
            .extend(self.levels.iter().map(|level| LevelReading {
                channel: level.channel,
                value: level.mean,
                sd: (level.noise / level.count).sqrt(),
            }));
        contact.descriptors.clone_from(&self.descriptors);
        contact
    }

    /// Whether one visit made it.
    pub(crate) fn is_single(&self) -> bool {
        self.visits < 1.5
    }

    pub(crate) fn of(contact: &Contact) -> Self {
        let normals = contact.normal.map_or(Vector3::zeros(), Unit::into_inner);
        let level = |reading: &LevelReading| LevelMemory {
            channel: reading.channel,
            count: 1.0,
            mean: reading.value,
            squares: 0.0,
            noise: reading.sd * reading.sd,
        };
        Self {
            position_m: contact.position_m,
            normals,
            count: 1.0,
            visits: 1.0,
            variance_m2: contact.variance_m2(),
            normal_variance: contact.normal_sd_rad * contact.normal_sd_rad,
            levels: contact.levels.iter().map(level).collect(),
            descriptors: contact.descriptors.clone(),
        }
    }

    /// Whether both are on one side of the surface, as far as is known.
    pub(crate) fn same_side(&self, other: &Self) -> bool {
        match (self.normal(), other.normal()) {
            (Some(a), Some(b)) => a.dot(&b) >= SAME_SIDE_COS,
            _ => true,
        }
    }

    pub(crate) fn merge(&mut self, other: &Self) {
        let count = self.count + other.count;
        self.position_m += (other.position_m - self.position_m) * (other.count / count);
        self.normals += other.normals;
        self.count = count;
        self.visits += other.visits;
        self.variance_m2 += other.variance_m2;
        self.normal_variance += other.normal_variance;
        for level in &other.levels {
            match self
                .levels
                .iter_mut()
                .find(|own| own.channel == level.channel)
            {
                Some(own) => own.add(level),
                None => self.levels.push(*level),
            }
        }
        for reading in &other.descriptors {
            if self
                .descriptors
                .iter()
                .all(|own| own.channel != reading.channel)
            {
                self.descriptors.push(reading.clone());
            }
        }
    }
}
