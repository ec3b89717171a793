//! One touch, ready for the update of all hypotheses.

use std::collections::BTreeMap;

use nalgebra::Point3;

use crate::contact::Contact;
use crate::indexed_model::IndexedModel;
use crate::library::{ObjectId, ObjectLibrary};
use crate::percept_likelihood::ContactPercepts;
use crate::tuning::OUTLIER_SHARE;

/// A touch, with what its update of every hypothesis shares.
#[derive(Debug)]
pub(crate) struct TouchUpdate<'a> {
    pub(crate) percepts: ContactPercepts<'a>,
    /// Variance of the drift of path integration since the touch before, per axis \[m²\].
    pub(crate) drift_m2: f64,
    /// Density of outliers times their share \[1/m³\].
    pub(crate) outlier: f64,
    /// Density of a contact with what was not explored of an object \[1/m³\].
    pub(crate) unexplored: &'a BTreeMap<ObjectId, f64>,
}

impl<'a> TouchUpdate<'a> {
    /// Of a contact and the one before it.
    pub(crate) fn new(
        library: &'a ObjectLibrary,
        (last, contact): (&Contact, &'a Contact),
        unexplored: &'a BTreeMap<ObjectId, f64>,
    ) -> Self {
        Self {
            percepts: ContactPercepts::new(contact, library.level_prior()),
            drift_m2: (contact.drift_sd_m.powi(2) - last.drift_sd_m.powi(2)).max(0.0),
            outlier: OUTLIER_SHARE * library.clutter_per_m3(),
            unexplored,
        }
    }

    /// Density of the touch at a point, if it is one of what was not explored of an object;
    /// `explored` is that of what was.
    pub(crate) fn beyond(
        &self,
        object: ObjectId,
        indexed: &IndexedModel,
        point: &Point3<f64>,
        explored: f64,
    ) -> f64 {
        let density = self.unexplored.get(&object);
        let density = density.filter(|density| explored < **density);
        let share = { density.zip(indexed.open.as_ref()) }
            .map(|(density, open)| density * open.share(point));
        share.unwrap_or_default()
    }
}

/// Prior probability that a touch is of a given one of so many places.
pub(crate) fn share(places: usize) -> f64 {
    (1.0 - OUTLIER_SHARE) / places as f64
}
