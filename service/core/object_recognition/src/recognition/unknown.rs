//! The unknown object: how likely the contacts are of something that was never learned.

use std::f64::consts::{FRAC_PI_6, PI};

use nalgebra::Isometry3;

use crate::interpolation::UnpredictedGaps;
use crate::library::{ObjectId, ObjectLibrary};
use crate::recognition::dependence::evidence_share;
use crate::recognition::episode::Hypotheses;
use crate::recognition::episode::Recognition;
use crate::recognition::gaps::told_by_gaps;
use crate::recognition::likelihoods::step_share_logs;
use crate::tuning::{
    EARNED_MAX, ERROR_REACH, MISS_PER_CONTACT, OUTLIER_SHARE, UNKNOWN_ERROR_REACH, UNKNOWN_PRIOR,
    UNPREDICTED_ODDS,
};

impl Recognition {
    /// Probability that the right pose in a learned model is not among the hypotheses. The contacts
    /// are then as much like that model as like an unknown object.
    ///
    /// Translations are searched from every place of every model, so none is missed. Poses come
    /// from pairs of contacts, and each further contact finds a missing pose half of the time.
    pub(super) fn miss_probability(&self) -> f64 {
        match self.hypotheses {
            Hypotheses::Translations(_) => 0.0,
            Hypotheses::Poses(_) => MISS_PER_CONTACT.powf(self.count.saturating_sub(2) as f64),
        }
    }

    /// Log-likelihood of the contacts under an unknown object, in the measure of the hypotheses.
    pub(super) fn unknown_log(&self, library: &ObjectLibrary) -> f64 {
        let extent_m = library.extent_m().max(1e-6);
        let aimed = -(self.aimed as f64) * extent_m.ln();
        let steps = self.steps_m.len() as f64;
        match &self.hypotheses {
            Hypotheses::Translations(translations) => {
                let shares = self.reach_m().map_or(0.0, |reach_m| {
                    let logs = library
                        .indexed_models()
                        .map(|(_, s)| s.share(reach_m).max(1e-9).ln());
                    logs.sum::<f64>() / library.len().max(1) as f64
                });
                translations.background.log - steps * shares + aimed
            }
            // Only its size is known: a contact lies anywhere within a step, with any normal.
            Hypotheses::Poses(_) => {
                let ball = |radius_m: f64| (8.0 * FRAC_PI_6 * radius_m.powi(3)).ln();
                let found = self.reach_m().map_or(0.0, |reach_m| {
                    steps * ball(reach_m.min(0.5 * extent_m).max(1e-6))
                });
                let drawn = self.drawn as f64 * ball(0.5 * extent_m);
                -found - drawn - self.count as f64 * (4.0 * PI).ln() + aimed
            }
        }
    }

    /// Log-likelihood of an unknown object by independent contacts; `unknown` is that by all.
    ///
    /// Contacts in one gap of a model share its errors. So the lead of an unknown object over a
    /// known one, or of the best known one over it, counts as that of fewer contacts. Over the best
    /// one an unknown object leads by the least of its leads over the likeliest. The odds between
    /// known objects stay as they are.
    ///
    /// Of an object whose contacts fell on places alone, what [`told_by_gaps`] adds to a lead takes
    /// an answer away, but calls nothing unknown: at a place that was missed a known object is
    /// named late rather than called unknown.
    ///
    /// Where neighbouring places tell nothing of what lies between, contacts there call nothing
    /// unknown either: see [`Self::told_by_outliers`]. They leave the unknown object ahead, in
    /// doubt.
    pub(super) fn earned(
        &self,
        library: &ObjectLibrary,
        objects: &[(ObjectId, f64)],
        unknown: f64,
    ) -> f64 {
        let Hypotheses::Translations(translations) = &self.hypotheses else {
            return unknown;
        };
        let doubt = doubt(objects.len());
        let share_log = step_share_logs(library, self.reach_m());
        // By contacts that are independent as far as a model's errors reach, in typical links.
        let lead = |&(object, log): &(ObjectId, f64), reach: f64| {
            let lead = unknown - log;
            let indexed = library.indexed(object)?;
            let heaviest = || translations.heaviest(object, 1).first().copied();
            if let Some(missed_share) = indexed.missed_share {
                let falls = heaviest().map(|own| own.falls).unwrap_or_default();
                let told = told_by_gaps(falls, missed_share);
                let most = if told > 0.0 { lead.max(0.0) } else { lead };
                return Some((lead + told).min(most));
            }
            if let Some(gaps) = indexed.gaps.as_ref().filter(|_| lead > doubt) {
                let pose = heaviest()?.pose(&translations.rotations);
                // A step is the less likely the more of a model lies within its reach.
                let outlier_log =
                    (OUTLIER_SHARE * library.clutter_per_m3()).ln() - share_log(indexed);
                let told = self.told_by_outliers(gaps, &pose, outlier_log);
                return Some(lead.min(f64::max(lead - told, doubt)));
            }
            if indexed.between_sd_m.is_none() {
                return Some(lead);
            }
            let pose = heaviest()?.pose(&translations.rotations);
            Some(lead * evidence_share(indexed, &pose, &self.contacts, reach))
        };
        let mut likeliest: Vec<_> = objects.iter().filter(|own| own.1.is_finite()).collect();
        likeliest.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let Some(best) = likeliest.first() else {
            return unknown;
        };
        let over_best = unknown - best.1;
        let earned = lead(best, ERROR_REACH).unwrap_or(over_best);
        if earned <= 0.0 {
            return best.1 + earned;
        }
        let leads =
            { likeliest.iter().take(EARNED_MAX) }.filter_map(|own| lead(own, UNKNOWN_ERROR_REACH));
        best.1 + leads.fold(over_best, f64::min)
    }

    /// By how much contacts in gaps of which nothing is predicted speak for the unknown object, if
    /// the object that has these gaps takes them for outliers \[nats\].
    fn told_by_outliers(
        &self,
        gaps: &UnpredictedGaps,
        map_from_episode: &Isometry3<f64>,
        outlier_log: f64,
    ) -> f64 {
        let told = self.contacts.iter().zip(&self.unknown_logs);
        let told = told.filter_map(|(contact, log)| {
            let more = (*log)? - outlier_log;
            let point = map_from_episode * contact.position_m;
            (more > 0.0 && gaps.hold(&point, contact.variance_m2().sqrt())).then_some(more)
        });
        // Of contacts that are no longer kept as many are supposed to have been in gaps.
        told.sum::<f64>() * self.count as f64 / self.contacts.len().max(1) as f64
    }
}

/// By how much the unknown object leads over one of so many known ones at the odds down to which
/// gaps take its lead away. An object's prior is a part of that of all known ones \[nats\].
fn doubt(objects: usize) -> f64 {
    let prior_odds = (1.0 - UNKNOWN_PRIOR) / (UNKNOWN_PRIOR * objects.max(1) as f64);
    (UNPREDICTED_ODDS * prior_odds).ln()
}
