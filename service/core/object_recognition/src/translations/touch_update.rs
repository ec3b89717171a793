//! One touch, ready for the update of all hypotheses.

use crate::contact::Contact;
use crate::library::ObjectLibrary;
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
}

impl<'a> TouchUpdate<'a> {
    /// Of a contact and the one before it.
    pub(crate) fn new(library: &'a ObjectLibrary, last: &Contact, contact: &'a Contact) -> Self {
        Self {
            percepts: ContactPercepts::new(contact, library.level_prior()),
            drift_m2: (contact.drift_sd_m.powi(2) - last.drift_sd_m.powi(2)).max(0.0),
            outlier: OUTLIER_SHARE * library.clutter_per_m3(),
        }
    }
}

/// Prior probability that a touch is of a given one of so many places.
pub(crate) fn share(places: usize) -> f64 {
    (1.0 - OUTLIER_SHARE) / places as f64
}
