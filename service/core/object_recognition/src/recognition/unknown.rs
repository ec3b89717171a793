//! The unknown object: how likely the contacts are of something that was never learned.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_6, PI};

use nalgebra::Isometry3;

use crate::interpolation::UnpredictedGaps;
use crate::library::ObjectLibrary;
use crate::object_id::ObjectId;
use crate::recognition::dependence::evidence_share;
use crate::recognition::episode::Hypotheses;
use crate::recognition::episode::Recognition;
use crate::recognition::gaps::told_by_gaps;
use crate::recognition::joint_evidence::log_bayes_factor;
use crate::recognition::likelihoods::step_share_logs;
use crate::translations::{GaussianSum, UnknownLogs};
use crate::tuning::{
    EARNED_MAX, ERROR_REACH, JOINT_ODDS_CONTACTS, MISS_PER_CONTACT, OUTLIER_SHARE,
    UNKNOWN_ERROR_REACH, UNKNOWN_PRIOR, UNPREDICTED_ODDS,
};
use crate::variant::VariantId;

/// By how much an unknown object is likelier than a known one \[nats\].
#[derive(Clone, Copy, Debug)]
struct UnknownLead {
    /// As it counts where the unknown object leads.
    earned: f64,
    /// That all contacts tell together; none where they do not.
    joint: Option<f64>,
}

impl UnknownLead {
    /// That one contact after the other tells.
    fn of_each(earned: f64) -> Self {
        Self {
            earned,
            joint: None,
        }
    }
}

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

    /// Log-likelihood of the contacts under an unknown object, in the measure of translations.
    pub(super) fn background_logs(
        &self,
        library: &ObjectLibrary,
        translations: &GaussianSum,
    ) -> UnknownLogs {
        let steps = self.steps_m.len() as f64;
        let shares = self.reach_m().map_or(0.0, |reach_m| {
            let logs = library
                .likelier_models()
                .map(|(_, s)| s.share(reach_m).max(1e-9).ln());
            logs.sum::<f64>() / library.len().max(1) as f64
        });
        let size = self.aimed_log(library) - steps * shares;
        translations.background.logs.plus(size)
    }

    /// The same in the measure of poses. Only its size is known: a contact lies anywhere within a
    /// step, with any normal.
    pub(super) fn unknown_pose_log(&self, library: &ObjectLibrary) -> f64 {
        let extent_m = library.extent_m().max(1e-6);
        let steps = self.steps_m.len() as f64;
        let ball = |radius_m: f64| (8.0 * FRAC_PI_6 * radius_m.powi(3)).ln();
        let found = self.reach_m().map_or(0.0, |reach_m| {
            steps * ball(reach_m.min(0.5 * extent_m).max(1e-6))
        });
        let drawn = self.drawn as f64 * ball(0.5 * extent_m);
        self.aimed_log(library) - found - drawn - self.count as f64 * (4.0 * PI).ln()
    }

    /// The part of contacts that were asked for: anywhere within the size of the largest object.
    fn aimed_log(&self, library: &ObjectLibrary) -> f64 {
        -(self.aimed as f64) * library.extent_m().max(1e-6).ln()
    }

    /// Log-likelihood of an unknown object, as it counts, in the measure of translations. Sorts the
    /// known ones by their logs, and gives the likeliest the odds that all contacts together tell.
    ///
    /// Contacts that share errors tell the same again and again, so that the sums over one after
    /// the other are too sure of one known object against another, too. If the likeliest object
    /// predicts what lies between its places, those that do so, too, have the odds against it that
    /// both have against the unknown one, by all contacts together. All other odds stay as they
    /// are: those sums are in another measure.
    ///
    /// Over the best one an unknown object leads by the least of its leads over the likeliest, but
    /// keeps the odds of [`doubt`] where it leads over the best one.
    pub(super) fn counted(
        &self,
        library: &ObjectLibrary,
        objects: &mut [(ObjectId, f64)],
        translations: &GaussianSum,
    ) -> f64 {
        let unknown = self.background_logs(library, translations);
        objects.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let doubt = doubt(objects.len());
        let logs = translations.variant_logs();
        let lead = |&(object, log): &(ObjectId, f64)| {
            let leads = unknown.plus(-log);
            let lead = self.unknown_lead(library, translations, object, (&logs, leads, doubt));
            lead.filter(|_| log.is_finite())
        };
        let likeliest = objects.iter().take(EARNED_MAX);
        let leads: Vec<Option<UnknownLead>> = likeliest.map(lead).collect();
        let first = objects.first().filter(|own| own.1.is_finite());
        let Some(&(_, first_log)) = first else {
            return unknown.log();
        };
        let first = leads.first().copied().flatten();
        let first = first.unwrap_or(UnknownLead::of_each(unknown.log() - first_log));
        let mut best = (first_log, first.earned);
        for ((_, log), own) in objects.iter_mut().zip(&leads) {
            let Some(own) = own else {
                continue;
            };
            if let Some((first, own)) = first.joint.zip(own.joint) {
                *log = first_log + first - own;
            }
            if *log > best.0 {
                best = (*log, own.earned);
            }
        }
        let (log, earned) = best;
        if earned <= 0.0 {
            return log + earned;
        }
        let leads = leads.iter().flatten().map(|own| own.earned);
        log + leads.fold(earned, f64::min).max(earned.min(doubt))
    }

    /// The lead of an unknown object over a known one; none where that has no hypothesis left.
    /// `leads` are those by all contacts, `logs` the masses of the variants.
    ///
    /// Contacts in one gap of a model share its errors, so that one after the other they tell the
    /// same again and again. Where a model predicts what lies between its places, the known object
    /// leads by what all contacts tell together ([`log_bayes_factor`]), and by no more than one
    /// after the other tells over all of its poses. An unknown object that leads counts as by fewer
    /// contacts, and keeps the odds of [`doubt`], by which it comes first and nothing is answered.
    /// Of few contacts each lead counts as that of fewer ones. Along a curve it counts whole: its
    /// places predict what lies between them about as exactly as they say, which those of a surface
    /// with edges do not.
    ///
    /// Of an object whose contacts fell on places alone, what [`told_by_gaps`] adds to a lead takes
    /// an answer away, but calls nothing unknown: at a place that was missed a known object is
    /// named late rather than called unknown.
    ///
    /// A known object with two variants counts as the heavier of them: where the other becomes
    /// heavier, the lead may jump.
    ///
    /// Where neighbouring places tell nothing of what lies between, contacts there call nothing
    /// unknown either: see [`Self::told_by_outliers`]. They leave the unknown object ahead, in
    /// doubt.
    fn unknown_lead(
        &self,
        library: &ObjectLibrary,
        translations: &GaussianSum,
        object: ObjectId,
        (logs, leads, doubt): (&BTreeMap<VariantId, f64>, UnknownLogs, f64),
    ) -> Option<UnknownLead> {
        let id = heavier(logs, object);
        let indexed = library.variant(id)?;
        let lead = leads.log();
        let heaviest = || translations.heaviest(id, 1).first().copied();
        if let Some(missed_share) = indexed.missed_share {
            let falls = heaviest().map(|own| own.falls).unwrap_or_default();
            let told = told_by_gaps(falls, missed_share);
            let most = if told > 0.0 { lead.max(0.0) } else { lead };
            return Some(UnknownLead::of_each((lead + told).min(most)));
        }
        let pose = || Some(heaviest()?.pose(&translations.rotations));
        if let Some(gaps) = indexed.gaps.as_ref().filter(|_| lead > doubt) {
            // A step is the less likely the more of a model lies within its reach.
            let share_log = step_share_logs(library, self.reach_m());
            let outlier_log = (OUTLIER_SHARE * library.clutter_per_m3()).ln() - share_log(indexed);
            let told = self.told_by_outliers(gaps, &pose()?, outlier_log);
            let lead = lead.min(f64::max(lead - told, doubt));
            return Some(UnknownLead::of_each(lead));
        }
        if !indexed.shares_errors() {
            return Some(UnknownLead::of_each(lead));
        }
        let pose = pose()?;
        let share = |reach| evidence_share(indexed, &pose, &self.contacts, reach);
        let joint = log_bayes_factor(indexed, library.level_prior(), &pose, &self.contacts);
        let joint = joint.map(|joint| f64::max(-joint, leads.library));
        let lead = joint.unwrap_or(lead);
        let earned = if lead > 0.0 && joint.is_some() && indexed.is_curve {
            lead
        } else if lead > 0.0 {
            f64::max(lead * share(UNKNOWN_ERROR_REACH), lead.min(doubt))
        } else if joint.is_some() {
            lead
        } else {
            let library = leads.library * share(ERROR_REACH);
            UnknownLogs { library, ..leads }.log().min(0.0)
        };
        let joint = joint.filter(|_| self.count >= JOINT_ODDS_CONTACTS);
        Some(UnknownLead { earned, joint })
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

/// The variant of an object that has the larger mass.
fn heavier(logs: &BTreeMap<VariantId, f64>, object: ObjectId) -> VariantId {
    let [places, body] = VariantId::both(object);
    let log = |id| logs.get(&id).copied().unwrap_or(f64::NEG_INFINITY);
    if log(body) > log(places) {
        body
    } else {
        places
    }
}

/// By how much the unknown object leads over one of so many known ones at the odds down to which
/// gaps take its lead away. An object's prior is a part of that of all known ones \[nats\].
fn doubt(objects: usize) -> f64 {
    let prior_odds = (1.0 - UNKNOWN_PRIOR) / (UNKNOWN_PRIOR * objects.max(1) as f64);
    (UNPREDICTED_ODDS * prior_odds).ln()
}
