//! All pose hypotheses of an episode: each touch scores, refines, searches and prunes them.

use nalgebra::{Isometry3, Point3};

use crate::contact::Contact;
use crate::indexed_model::IndexedModel;
use crate::library::ObjectLibrary;
use crate::object_id::ObjectId;
use crate::poses::goodness_of_fit;
use crate::poses::hypothesis::PoseHypothesis;
use crate::poses::search::PoseSearch;
use crate::surfels::map::{PerceptContext, SurfelMap, relative_to};
use crate::surfels::pose_fit::PoseFit;
use crate::tuning::{
    EARLY_CONTACTS, POSES_MAX, REFINE_EVERY, REFINE_LOSS_MAX, REFINE_NATS, REFINED_ALWAYS,
    SEARCH_EVERY, SEARCH_NATS,
};

/// All hypotheses of an episode.
#[derive(Clone, Debug, Default)]
pub(crate) struct PoseHypotheses {
    /// The first contact: origin of the frame of all poses here, so that nothing is far away.
    origin: Option<Point3<f64>>,
    /// The contacts that are kept, in that frame.
    contacts: Vec<Contact>,
    /// All contacts so far.
    count: usize,
    pub(crate) all: Vec<PoseHypothesis>,
}

/// Score of a model's best hypothesis, as a log density.
#[derive(Clone, Copy)]
struct ModelScore {
    log: f64,
    /// What a score lacks of a log density.
    size_log: f64,
}

impl PoseHypotheses {
    /// Origin of the frame of the hypotheses' poses, in the episode's frame.
    pub(crate) fn origin(&self) -> Point3<f64> {
        self.origin.unwrap_or_else(Point3::origin)
    }

    /// Adds a contact and forgets the oldest beyond `kept`.
    ///
    /// `size_log` is what the number of contacts says of a model of its size: the difference
    /// between a log density and a score.
    pub(crate) fn touch(
        &mut self,
        library: &ObjectLibrary,
        contact: &Contact,
        kept: usize,
        size_log: &dyn Fn(&IndexedModel, &SurfelMap) -> f64,
    ) {
        let origin = *self.origin.get_or_insert(contact.position_m);
        if self.contacts.len() >= kept {
            self.contacts.remove(0);
        }
        let contact = relative_to(contact, &origin);
        self.count += 1;
        for hypothesis in &mut self.all {
            if let Some((indexed, surfel_map)) = surfel_map(library, hypothesis.object) {
                let context = library.percept_context(indexed);
                hypothesis.score += surfel_map.contact_log(&hypothesis.pose, &contact, context);
            }
        }
        self.all
            .retain(|hypothesis| surfel_map(library, hypothesis.object).is_some());
        self.contacts.push(contact);
        if self.contacts.len() >= 3 {
            let scores = self.model_scores(library, size_log);
            self.refine_and_search(library, &scores);
        }
    }

    /// The best score of each model of the library, in the library's order.
    fn model_scores(
        &self,
        library: &ObjectLibrary,
        size_log: &dyn Fn(&IndexedModel, &SurfelMap) -> f64,
    ) -> Vec<ModelScore> {
        let score = |(object, indexed): (ObjectId, &IndexedModel)| {
            let own = self.all.iter().filter(|h| h.object == object);
            let best = own.map(|h| h.score).fold(f64::NEG_INFINITY, f64::max);
            let map = indexed.surfel_map.as_ref();
            let size_log = map.map_or(0.0, |map| size_log(indexed, map));
            ModelScore {
                log: best + size_log,
                size_log,
            }
        };
        library.indexed_models().map(score).collect()
    }

    /// Refines the heavier hypotheses of each model, searches for new ones, and keeps the best.
    fn refine_and_search(&mut self, library: &ObjectLibrary, scores: &[ModelScore]) {
        let logs = scores.iter().map(|score| score.log);
        let best = logs.fold(f64::NEG_INFINITY, f64::max);
        let live = scores.iter().filter(|score| score.log > best - REFINE_NATS);
        let is_searching = live.count() > 1
            || self.count <= EARLY_CONTACTS
            || self.count.is_multiple_of(REFINE_EVERY);
        let mut all = std::mem::take(&mut self.all);
        for (at, (object, indexed)) in library.indexed_models().enumerate() {
            let Some(surfel_map) = &indexed.surfel_map else {
                continue;
            };
            let (mut own, others): (Vec<_>, Vec<_>) = all
                .into_iter()
                .partition(|hypothesis| hypothesis.object == object);
            all = others;
            let context = library.percept_context(indexed);
            for (rank, hypothesis) in own.iter_mut().enumerate() {
                let is_due =
                    rank < REFINED_ALWAYS || (self.count + rank).is_multiple_of(REFINE_EVERY);
                if is_due && hypothesis.score + scores[at].size_log > best - REFINE_NATS {
                    self.refine(surfel_map, context, hypothesis);
                }
            }
            let is_near = is_searching && scores[at].log > best - SEARCH_NATS;
            if own.is_empty() || is_near || (self.count + at).is_multiple_of(SEARCH_EVERY) {
                let search = PoseSearch {
                    object,
                    surfel_map,
                    context,
                    contacts: &self.contacts,
                    count: self.count,
                };
                search.run(&mut own);
            }
            all.extend(best_of_model(own));
        }
        self.all = all;
    }

    /// Moves a hypothesis by one Gauss-Newton step over all contacts, if its score hardly falls.
    fn refine(
        &self,
        surfel_map: &SurfelMap,
        context: PerceptContext<'_>,
        hypothesis: &mut PoseHypothesis,
    ) {
        let fit = |pose: &Isometry3<f64>| -> PoseFit {
            surfel_map.fit_pose(pose, self.contacts.iter(), 1.0, context)
        };
        let forgotten = self.count - self.contacts.len();
        let forgotten_score = if forgotten > 0 {
            hypothesis.score - fit(&hypothesis.pose).score
        } else {
            0.0
        };
        let pose = fit(&hypothesis.pose).step(&hypothesis.pose);
        let fit = fit(&pose);
        if fit.score + forgotten_score >= hypothesis.score - REFINE_LOSS_MAX {
            hypothesis.pose = pose;
            hypothesis.score = fit.score + forgotten_score;
            hypothesis.information = fit.information;
        }
    }

    /// Goodness of fit of a hypothesis: a standard normal number for the right one, lower for
    /// others.
    pub(crate) fn fit(&self, library: &ObjectLibrary, hypothesis: &PoseHypothesis) -> Option<f64> {
        let (indexed, surfel_map) = surfel_map(library, hypothesis.object)?;
        let context = library.percept_context(indexed);
        let z = goodness_of_fit::z_score(surfel_map, context, &hypothesis.pose, &self.contacts);
        Some(z)
    }

    /// Evidence of a contact with an object, as a share of that of one whose errors are independent
    /// of all others.
    pub(crate) fn evidence_share(&self, library: &ObjectLibrary, object: ObjectId) -> f64 {
        surfel_map(library, object).map_or(1.0, |(_, surfel_map)| {
            1.0 / goodness_of_fit::variance_inflation(surfel_map, &self.contacts)
        })
    }
}

fn surfel_map(library: &ObjectLibrary, object: ObjectId) -> Option<(&IndexedModel, &SurfelMap)> {
    let indexed = library.indexed(object)?;
    Some((indexed, indexed.surfel_map.as_ref()?))
}

/// The best hypotheses of one model, each pose once.
fn best_of_model(mut own: Vec<PoseHypothesis>) -> Vec<PoseHypothesis> {
    own.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut kept: Vec<PoseHypothesis> = Vec::with_capacity(POSES_MAX);
    for hypothesis in own {
        if kept.len() < POSES_MAX && kept.iter().all(|other| !other.is_same(&hypothesis)) {
            kept.push(hypothesis);
        }
    }
    kept
}
