//! Walks over what was not explored of the objects that are known in part.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::UnitQuaternion;

use crate::contact::Contact;
use crate::indexed_model::IndexedModel;
use crate::level_prior::likelihood_below_one;
use crate::library::ObjectLibrary;
use crate::numeric::log_sum;
use crate::translations::background::UnknownContact;
use crate::translations::hypothesis::{Falls, TranslationHypothesis};
use crate::translations::touch_update::UnpredictedDensity;
use crate::tuning::{CONTACTS_MAX, ENTER_MIN};
use crate::variant::VariantId;

/// Where an episode may have been that knows no place of an object: on what was not explored of it.
///
/// There a contact is as likely as with an unknown object, so that it says nothing against the
/// object but that so much of it should be missing: each further contact stays there with a
/// probability that falls with the step. Otherwise it is the first one on what was explored, at its
/// edge.
#[derive(Clone, Debug, Default)]
pub(crate) struct Unexplored {
    /// Log of the mass of the episodes that were nowhere else so far.
    pub(crate) logs: BTreeMap<VariantId, f64>,
    /// Length of the walk so far \[m\].
    walked_m: f64,
    /// Densities of the contacts after the first, as far as hypotheses may be replayed by them.
    pub(crate) history: Vec<Arc<BTreeMap<VariantId, UnpredictedDensity>>>,
}

impl Unexplored {
    /// After the first contact, with one of these models.
    pub(crate) fn new(
        library: &ObjectLibrary,
        holds: &impl Fn(VariantId, &IndexedModel) -> bool,
    ) -> Self {
        let logs = { library.variants() }
            .filter(|(of, indexed)| holds(*of, indexed))
            .filter_map(|(of, indexed)| Some((of, indexed.open.as_ref()?.unexplored.ln())));
        Self {
            logs: logs.collect(),
            walked_m: 0.0,
            history: Vec::new(),
        }
    }

    /// Densities of a contact, from those of one with an unknown object; those of an object are
    /// multiplied by e^`share` for its size. What was not explored within a surface has levels like
    /// those of the rest; beyond the ends of a curve they may be any.
    ///
    /// In a gap, where the surface is not as predicted, a contact is as likely as it is of the
    /// unknown object with which the object competes: it tells nothing between the two.
    pub(crate) fn densities(
        &self,
        library: &ObjectLibrary,
        (last, contact): (&Contact, &Contact),
        unknown: Option<&UnknownContact>,
        share: impl Fn(VariantId) -> f64,
    ) -> BTreeMap<VariantId, UnpredictedDensity> {
        let Some(unknown) = unknown else {
            return BTreeMap::new();
        };
        // In the way that makes it likeliest, as the unknown object may be of any; and without the
        // object that explains it best: else its places would speak for all others.
        let logs = unknown.of_objects.values();
        let least = logs.map(|logs| logs.alike.max(logs.bare).max(logs.changing()));
        let least = least.fold(f64::INFINITY, f64::min);
        let densities = self.logs.keys().filter_map(|of| {
            let indexed = library.variant(*of)?;
            let own = &indexed.own_levels;
            let alike = likelihood_below_one(contact, own, library.level_prior());
            let step_m = (contact.position_m - last.position_m).norm();
            let open = indexed.open.as_ref()?;
            let density = |log: f64, stay: f64| stay * (log + share(*of)).exp();
            let stay = open.stay_beyond(self.walked_m, step_m);
            let (alike_beyond, beyond) = if open.has_holes {
                (alike, least)
            } else {
                (1.0, unknown.log)
            };
            let density = UnpredictedDensity {
                gap: alike * density(unknown.log, open.stay_in_gap(step_m)),
                open: alike_beyond * density(beyond, stay),
            };
            Some((*of, density))
        });
        densities.collect()
    }

    /// Hypotheses by which a contact is the first one on what was explored. `bare` are the log
    /// densities of its position.
    pub(crate) fn entered(
        &self,
        library: &ObjectLibrary,
        rotations: &[UnitQuaternion<f64>],
        (last, contact): (&Contact, &Contact),
        bare: impl Fn(VariantId) -> Option<f64>,
        least_log: f64,
        parts: &mut Vec<TranslationHypothesis>,
    ) {
        for (&of, log) in &self.logs {
            let Some(indexed) = library.variant(of).filter(|_| log.is_finite()) else {
                continue;
            };
            let (Some(open), Some(bare)) = (&indexed.open, bare(of)) else {
                continue;
            };
            let ways = (open.entries().len() * rotations.len()).max(1) as f64;
            let step_m = (contact.position_m - last.position_m).norm();
            let enters = (1.0 - open.stay_beyond(self.walked_m, step_m)).max(ENTER_MIN);
            let each = log + bare + enters.ln() - ways.ln();
            for entry in open.entries() {
                let place = &indexed.places[*entry as usize];
                let evidence = each + place.percept_log(contact, library.level_prior());
                if evidence < least_log {
                    continue;
                }
                for (rotation, turn) in (0u16..).zip(rotations) {
                    parts.push(TranslationHypothesis {
                        object: of.object,
                        variant: of.variant,
                        rotation,
                        translation: place.position.coords - turn * contact.position_m.coords,
                        variance_m2: contact.variance_m2() + place.variance_m2 + open.entry_m2(),
                        evidence,
                        falls: Falls {
                            beyond: 1.0,
                            ..Falls::default()
                        },
                    });
                }
            }
        }
    }

    /// Multiplies the masses of each model by e^`log`.
    pub(crate) fn resize(&mut self, log: impl Fn(VariantId) -> f64) {
        for (of, own) in &mut self.logs {
            *own += log(*of);
        }
    }

    /// A contact lay there, after a step \[m\].
    pub(crate) fn stayed(
        &mut self,
        densities: BTreeMap<VariantId, UnpredictedDensity>,
        step_m: f64,
    ) {
        self.walked_m += step_m;
        for (of, log) in &mut self.logs {
            let density = densities.get(of).copied().unwrap_or_default();
            *log += density.open.ln();
        }
        if self.history.len() < CONTACTS_MAX {
            self.history.push(Arc::new(densities));
        }
    }

    /// Adds their masses to those of the models.
    pub(crate) fn add_to(&self, sums: &mut BTreeMap<VariantId, f64>) {
        for (of, log) in &self.logs {
            let sum = sums.entry(*of).or_insert(f64::NEG_INFINITY);
            *sum = log_sum([*sum, *log].into_iter());
        }
    }
}
