//! An episode of recognition: contacts come in, a posterior comes out.

use std::collections::BTreeMap;

use nalgebra::Point3;

use crate::contact::{Contact, Reached};
use crate::indexed_model::IndexedModel;
use crate::library::ObjectLibrary;
use crate::next_touch::{NextTouch, WeightedPose, next_touch};
use crate::numeric::log_sum;
use crate::object_id::ObjectId;
use crate::orientation::Orientation;
use crate::poses::PoseHypotheses;
use crate::posterior::{Posterior, entropy_nats};
use crate::recognition::likelihoods::{step_share_logs, unknown_fit_log, walk_log};
use crate::surfels::map::SurfelMap;
use crate::translations::GaussianSum;
use crate::tuning::{
    CONTACTS_MAX, LISTED_SHARE_MIN, REACH_PER_STEP, RIVALS_MAX, SEARCHED_AFTER, UNKNOWN_PRIOR,
};
use crate::variant::VariantId;

/// The state of one episode of recognition.
///
/// All work is bounded per touch: by the number of places of the library, and by budgets of
/// hypotheses and of poses tried.
#[derive(Clone, Debug)]
pub struct Recognition {
    pub(super) contacts: Vec<Contact>,
    /// What each of these adds to the log-likelihood of the unknown object, if that predicts it.
    pub(super) unknown_logs: Vec<Option<f64>>,
    pub(super) count: usize,
    /// Lengths of the steps between contacts of a walk, in ascending order \[m\].
    pub(super) steps_m: Vec<f64>,
    /// Contacts that were drawn from the whole model, without the first.
    pub(super) drawn: usize,
    /// Contacts that were asked for.
    pub(super) aimed: usize,
    pub(super) hypotheses: Hypotheses,
    /// Standard deviation of each hypothesis' rotation about the z axis \[rad\].
    pub(super) yaw_sd_rad: f64,
    /// Position of the first contact \[m\].
    pub(super) first_m: Option<Point3<f64>>,
    /// Logs of the prior probabilities of the variants of each object, as they were then.
    pub(super) variant_priors: BTreeMap<VariantId, f64>,
}

#[derive(Clone, Debug)]
pub(super) enum Hypotheses {
    Translations(Box<GaussianSum>),
    Poses(PoseHypotheses),
}

impl Recognition {
    /// An episode without contacts.
    pub fn new(orientation: &Orientation) -> Self {
        let hypotheses = match orientation.rotations() {
            Some(rotations) => Hypotheses::Translations(Box::new(GaussianSum::new(rotations))),
            None => Hypotheses::Poses(PoseHypotheses::default()),
        };
        Self {
            contacts: Vec::new(),
            unknown_logs: Vec::new(),
            count: 0,
            steps_m: Vec::new(),
            drawn: 0,
            aimed: 0,
            hypotheses,
            yaw_sd_rad: orientation.yaw_sd_rad(),
            first_m: None,
            variant_priors: BTreeMap::new(),
        }
    }

    /// Updates the hypotheses with one contact.
    pub fn touch(&mut self, library: &ObjectLibrary, contact: Contact) {
        let contact = self.as_turned(contact);
        if self.count == 0 {
            self.variant_priors = library.variant_priors();
        }
        match (self.contacts.last(), contact.reached) {
            (_, Reached::Aimed) => self.aimed += 1,
            (None, _) => {}
            (Some(_), Reached::Drawn) => self.drawn += 1,
            (Some(last), Reached::Found) => {
                let step_m = (contact.position_m - last.position_m).norm();
                let at = self.steps_m.partition_point(|other| *other < step_m);
                self.steps_m.insert(at, step_m);
            }
        }
        self.count += 1;
        let (steps, reach_m) = (self.steps_m.len(), self.reach_m());
        let spread = (self.count - self.aimed) as f64;
        let sizes = self.translation_sizes(library);
        let unknown_log = match &mut self.hypotheses {
            Hypotheses::Translations(translations) => {
                let share_log = step_share_logs(library, reach_m);
                let share = |of| library.variant(of).map_or(0.0, &share_log);
                let log =
                    translations.touch(library, &self.contacts, &contact, sizes, &share, reach_m);
                translations.settle();
                log
            }
            Hypotheses::Poses(poses) => {
                let size_log = |indexed: &IndexedModel, surfel_map: &SurfelMap| {
                    walk_log(indexed, steps, reach_m) - spread * surfel_map.area_m2.ln()
                };
                poses.touch(library, &contact, CONTACTS_MAX, &size_log);
                None
            }
        };
        if self.contacts.len() >= CONTACTS_MAX {
            self.contacts.remove(0);
            self.unknown_logs.remove(0);
        }
        self.contacts.push(contact);
        self.unknown_logs.push(unknown_log);
        if let Hypotheses::Translations(translations) = &mut self.hypotheses
            && SEARCHED_AFTER.contains(&self.count)
        {
            translations.search_again(library, &self.contacts);
            translations.settle();
        }
    }

    /// A contact as exactly as it is known in the frame of a hypothesis, whose rotation is off by
    /// what lies between two of them.
    fn as_turned(&mut self, contact: Contact) -> Contact {
        let first_m = *self.first_m.get_or_insert(contact.position_m);
        let lever_m = (contact.position_m - first_m).xy().norm();
        let turned_m = lever_m * self.yaw_sd_rad;
        Contact {
            position_sd_m: contact.position_sd_m.hypot(turned_m),
            ..contact
        }
    }

    /// Contacts so far.
    pub fn contacts(&self) -> usize {
        self.count
    }

    /// The posterior after the contacts so far.
    pub fn posterior(&self, library: &ObjectLibrary) -> Posterior {
        let mut objects = self.object_logs(library);
        // Contacts near one another share the errors of a model, so that a pose fitted to them has
        // less evidence than independent contacts would give.
        let best = objects.iter().max_by(|a, b| a.1.total_cmp(&b.1));
        let best = best.map(|&(object, _)| object);
        let evidence_share = match (&self.hypotheses, best) {
            (Hypotheses::Poses(poses), Some(best)) => poses.evidence_share(library, best),
            _ => 1.0,
        };
        let fit = self.fit(library, best);
        for (_, log) in &mut objects {
            *log *= evidence_share;
        }
        let prior = (1.0 - UNKNOWN_PRIOR).ln() - (objects.len().max(1) as f64).ln();
        let mut none = UNKNOWN_PRIOR.ln();
        if self.is_empty() {
            // No hypothesis yet: all objects are equally probable.
            for (_, log) in &mut objects {
                *log = prior;
            }
        } else {
            let most = objects
                .iter()
                .map(|object| object.1)
                .fold(f64::NEG_INFINITY, f64::max);
            match &self.hypotheses {
                Hypotheses::Translations(translations) => {
                    none += self.counted(library, &mut objects, translations);
                }
                Hypotheses::Poses(_) => {
                    let any = none + evidence_share * self.unknown_pose_log(library);
                    let strange = unknown_fit_log(fit, self.contacts.len());
                    let misfit = none + most + prior + strange;
                    none = log_sum([any, misfit].into_iter());
                }
            }
            let miss_probability = self.miss_probability();
            let missed_log = none - UNKNOWN_PRIOR.ln() + miss_probability.ln();
            for (_, log) in &mut objects {
                *log =
                    prior + log_sum([*log + (1.0 - miss_probability).ln(), missed_log].into_iter());
            }
        }
        let total = log_sum(objects.iter().map(|object| object.1).chain([none]));
        for (_, log) in &mut objects {
            *log = (*log - total).exp();
        }
        let unknown = (none - total).exp();
        objects.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let pose = { objects.first() }.and_then(|(object, _)| self.pose(library, *object));
        Posterior {
            live_hypotheses: self.live_hypotheses(library),
            live_objects: objects
                .iter()
                .filter(|object| object.1 > LISTED_SHARE_MIN)
                .count(),
            entropy_nats: entropy_nats(objects.iter().map(|object| object.1).chain([unknown])),
            objects,
            unknown,
            pose,
            contacts: self.count,
            fit,
            answer_probability: library.answer_probability(),
        }
    }

    /// Whether there is no hypothesis yet.
    fn is_empty(&self) -> bool {
        match &self.hypotheses {
            Hypotheses::Translations(translations) => translations.is_empty(),
            Hypotheses::Poses(poses) => poses.all.is_empty(),
        }
    }

    /// Goodness of fit of an object's best hypothesis, as a z-score; 0 where it is not known.
    fn fit(&self, library: &ObjectLibrary, object: Option<ObjectId>) -> f64 {
        let Hypotheses::Poses(poses) = &self.hypotheses else {
            return 0.0;
        };
        let own = poses.all.iter().filter(|h| Some(h.object) == object);
        let best = own.max_by(|a, b| a.score.total_cmp(&b.score));
        best.and_then(|best| poses.fit(library, best))
            .unwrap_or(0.0)
    }

    /// Radius within which a walk's next contact lies \[m\].
    pub(super) fn reach_m(&self) -> Option<f64> {
        let steps = self.steps_m.len();
        (steps > 0).then(|| REACH_PER_STEP * self.steps_m[steps / 2])
    }

    /// The touch with the largest expected information about which live hypothesis is right. `None`
    /// if there is only one, or if half of the contacts were asked for already.
    pub fn next_touch(&self, library: &ObjectLibrary) -> Option<NextTouch> {
        // Models differ most where one of them errs most: contacts from anywhere keep question and
        // posterior unbiased, so that no more than every other touch is asked for.
        if 2 * self.aimed >= self.count {
            return None;
        }
        let mut objects = self.object_logs(library);
        if let Hypotheses::Translations(translations) = &self.hypotheses {
            self.counted(library, &mut objects, translations);
        }
        objects.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let all = log_sum(objects.iter().map(|object| object.1));
        let mut rivals = Vec::new();
        for (object, sum) in objects.into_iter().take(RIVALS_MAX) {
            let masses = self.masses(library, object, RIVALS_MAX);
            let own = self.mass_log(library, object);
            rivals.extend(masses.iter().map(|mass| WeightedPose {
                of: mass.of,
                map_from_episode: mass.map_from_episode,
                weight: (mass.log - own + sum - all).exp(),
            }));
        }
        next_touch(library, rivals, &self.contacts)
    }
}
