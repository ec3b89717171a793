//! One touch, ready for the update of all hypotheses.

use std::collections::BTreeMap;

use nalgebra::{Point3, UnitQuaternion};

use crate::contact::{Contact, LevelReading};
use crate::indexed_model::IndexedModel;
use crate::interpolation::Part;
use crate::level_prior::{LevelPrior, RatedLevel};
use crate::library::ObjectLibrary;
use crate::percept_likelihood::ContactPercepts;
use crate::translations::hypothesis::TranslationHypothesis;
use crate::tuning::OUTLIER_SHARE;
use crate::variant::VariantId;

/// A touch, with what its update of every hypothesis shares.
#[derive(Debug)]
pub(crate) struct TouchUpdate<'a> {
    pub(crate) percepts: ContactPercepts<'a>,
    /// The nearest contact before.
    pub(crate) nearest: ContactPercepts<'a>,
    /// Variance of that contact, as it is known now, per axis \[m²\].
    pub(crate) nearest_m2: f64,
    /// Where the contact before it was.
    last_m: Point3<f64>,
    /// Levels that both of them have.
    pub(crate) level_pairs: Vec<LevelPair>,
    /// Variance of the drift of path integration since the touch before, per axis \[m²\].
    pub(crate) drift_m2: f64,
    /// Density of outliers times their share \[1/m³\].
    pub(crate) outlier: f64,
    /// Densities of a contact with what the models do not predict.
    pub(crate) unexplored: &'a BTreeMap<VariantId, UnpredictedDensity>,
}

/// A level of a touch, and that of the nearest contact before on the same channel.
#[derive(Debug)]
pub(crate) struct LevelPair {
    pub(crate) channel: u16,
    pub(crate) earlier: RatedLevel,
    pub(crate) now: RatedLevel,
}

/// Densities of a contact with what a model does not predict \[1/m³\].
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct UnpredictedDensity {
    /// In a gap between places, where the surface may not be as predicted.
    pub(crate) gap: f64,
    /// Beyond an edge of what was felt.
    pub(crate) open: f64,
}

/// A touch of what a model does not predict.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Unpredicted {
    /// Its density times its share \[1/m³\].
    pub(crate) density: f64,
    /// The part of space where it lies.
    pub(crate) part: Part,
}

impl<'a> TouchUpdate<'a> {
    /// Of a contact, after these, of which there is one at least.
    pub(crate) fn new(
        library: &'a ObjectLibrary,
        (before, contact): (&'a [Contact], &'a Contact),
        unexplored: &'a BTreeMap<VariantId, UnpredictedDensity>,
    ) -> Self {
        let level_prior = library.level_prior();
        let (last, nearest) = { before.last() }
            .zip(nearest_contact(before, contact))
            .unwrap_or((contact, contact));
        let pair = |earlier: &LevelReading| {
            let channel = earlier.channel;
            let prior = LevelPrior::of(level_prior, channel)?;
            Some(LevelPair {
                channel,
                earlier: prior.rated(earlier),
                now: prior.rated(contact.level(channel)?),
            })
        };
        let drift_m2 =
            |own: &Contact| (contact.drift_sd_m.powi(2) - own.drift_sd_m.powi(2)).max(0.0);
        Self {
            percepts: ContactPercepts::new(contact, level_prior),
            nearest: ContactPercepts::new(nearest, level_prior),
            last_m: last.position_m,
            nearest_m2: nearest.position_sd_m.powi(2) + drift_m2(nearest),
            level_pairs: nearest.levels.iter().filter_map(pair).collect(),
            drift_m2: drift_m2(last),
            outlier: OUTLIER_SHARE * library.clutter_per_m3(),
            unexplored,
        }
    }

    /// The touch of a hypothesis at a point, if it is one of what its model does not predict;
    /// `explored` is the density of what it does. None where nothing is known of that.
    pub(crate) fn unpredicted(
        &self,
        hypothesis: &TranslationHypothesis,
        (indexed, rotation): (&IndexedModel, &UnitQuaternion<f64>),
        point: &Point3<f64>,
        explored: f64,
    ) -> Option<Unpredicted> {
        let density = self.unexplored.get(&hypothesis.of());
        let (density, open) = density.zip(indexed.open.as_ref())?;
        if explored >= density.gap.max(density.open) {
            return Some(Unpredicted {
                density: 0.0,
                part: Part::Known,
            });
        }
        let part = open.part(point);
        let (share, density) = match part {
            Part::Known => (0.0, 0.0),
            Part::Gap => (open.unexpected, density.gap),
            Part::Beyond => {
                let before = Point3::from(rotation * self.last_m.coords + hypothesis.translation);
                let share = if open.part(&before) == Part::Beyond {
                    1.0
                } else {
                    let has_left = hypothesis.falls.beyond > 0.5;
                    open.leave((point - before).norm(), has_left)
                };
                (share, density.open)
            }
        };
        let is_likelier = explored < density;
        Some(Unpredicted {
            density: if is_likelier { share * density } else { 0.0 },
            part,
        })
    }
}

/// Of the contacts before another one, the nearest, and of equal ones the last; none of none.
pub(crate) fn nearest_contact<'a>(before: &'a [Contact], contact: &Contact) -> Option<&'a Contact> {
    let apart = |other: &&Contact| (contact.position_m - other.position_m).norm();
    let newest_first = before.iter().rev();
    newest_first.min_by(|a, b| apart(a).total_cmp(&apart(b)))
}

/// Prior probability that a touch is of a given one of so many places.
pub(crate) fn share(places: usize) -> f64 {
    (1.0 - OUTLIER_SHARE) / places as f64
}
